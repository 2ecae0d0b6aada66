# What Debian wants in every package beside what is installed: copyright, changelogs, compressed manual pages, and why
# lintian may pass over what is only for packages in Debian's own archive.
# CPack runs this between installing the components and making their packages.
find_program(gzip gzip REQUIRED)
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # of SOURCE_DATE_EPOCH, where that is set
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} upper)
  set(package ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  set(root "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/${component}/usr")
  set(doc "${root}/share/doc/${package}")
  file(MAKE_DIRECTORY "${doc}")
  configure_file("${CPACK_CIE_SOURCE_DIR}/.cmake/debian/copyright" "${doc}/copyright" COPYONLY)
  configure_file("${CPACK_CIE_SOURCE_DIR}/CHANGELOG.md" "${doc}/changelog" COPYONLY)
  file(WRITE "${doc}/changelog.Debian" "cie (${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; "
    "urgency=medium\n\n  * Built from upstream's sources; see changelog.gz.\n\n -- ${CPACK_PACKAGE_CONTACT}  ${date}\n")
  set(overrides "# Not of Debian's archive: nobody asked for it there.\n${package}: initial-upload-closes-no-bugs\n")
  if(component STREQUAL runtime)
    string(APPEND overrides "# CPack does, beside the trigger.\n${package}: maintscript-calls-ldconfig\n"
      "# Several libraries, of one version.\n${package}: package-name-doesnt-match-sonames\n")
  endif()
  file(WRITE "${root}/share/lintian/overrides/${package}" "${overrides}")
  file(GLOB compressed "${doc}/changelog*" "${root}/share/man/man*/*.[17]")
  execute_process(COMMAND "${gzip}" -9nf ${compressed} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
