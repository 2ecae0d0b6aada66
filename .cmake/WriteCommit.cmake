# cmake -DSOURCE=… -DOUT=… -P WriteCommit.cmake: the commit that is built, as C++; written only when it changed.
execute_process(COMMAND git -C "${SOURCE}" describe --always --dirty --abbrev=12 --exclude=*
  OUTPUT_VARIABLE CIE_COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed)
  set(CIE_COMMIT "")  # a tarball
endif()
configure_file("${SOURCE}/viewer_export/cli/commit.cpp.in" "${OUT}" @ONLY)
