# What sources of ours need of Cyclone DDS beyond what it promises is compiled and linked while configuring, so that
# a version without it is told of here, and not by a compiler's errors, or by a crash.
function(cie_cyclonedds_has needs sources)
  try_compile(has "${CMAKE_CURRENT_BINARY_DIR}/cyclonedds/${needs}"
    "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/cyclonedds/${needs}.cpp"
    LINK_LIBRARIES CycloneDDS::ddsc CXX_STANDARD 20 CXX_STANDARD_REQUIRED ON OUTPUT_VARIABLE output)
  if(NOT has)
    string(REGEX MATCHALL "[^\n]*(error|undefined reference|No such file)[^\n]*" errors "${output}")
    list(SUBLIST errors 0 3 errors)
    list(JOIN errors "\n  " errors)
    message(FATAL_ERROR "Cyclone DDS ${CycloneDDS_VERSION} of ${CycloneDDS_DIR} lacks what ${sources} of "
      "executor/src need (executor/cmake/cyclonedds/${needs}.cpp):\n  ${errors}\n${CIE_CYCLONEDDS_ADVICE}")
  endif()
endfunction()

if(NOT COMMAND idlc_generate)
  message(FATAL_ERROR "Cyclone DDS ${CycloneDDS_VERSION} of ${CycloneDDS_DIR} was built without its compiler of IDL "
    "(BUILD_IDLC=OFF), which makes the messages.\n${CIE_CYCLONEDDS_ADVICE}")
endif()
# Once for each that is found.
if(NOT CIE_CYCLONEDDS_CHECKED STREQUAL "${CycloneDDS_DIR} ${CycloneDDS_VERSION} ${CIE_MESSAGES_BY_POINTER}")
  cie_cyclonedds_has(sample_cache "dds/delivery.cpp")
  cie_cyclonedds_has(cdr_stream "dds/cdr_bytes.cpp and others")
  if(CIE_MESSAGES_BY_POINTER)
    cie_cyclonedds_has(pointer_type "dds/message_data.cpp")
  endif()
  set(CIE_CYCLONEDDS_CHECKED "${CycloneDDS_DIR} ${CycloneDDS_VERSION} ${CIE_MESSAGES_BY_POINTER}" CACHE INTERNAL "")
endif()
