# Debian packages: `./run package`, which has the right prefix and options. A component is a package:
#   runtime libcieX.Y · robot cie-robot · desk cie · babeltrace2 babeltrace2-plugin-cie · dev libcie-dev
#   doc cie-doc
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME cie)
set(CPACK_PACKAGE_CONTACT "cie developers <cie@cie.invalid>" CACHE STRING "Maintainer of the packages: whoever builds them for others")
# Else CPack puts the project's description before those of the packages.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${CMAKE_PROJECT_NAME} built using CMake")
set(CPACK_PACKAGE_DIRECTORY "${PROJECT_BINARY_DIR}/packages")
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# What one package has for another is not installed while they are made.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${CMAKE_LIBRARY_OUTPUT_DIRECTORY}")
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_PRE_BUILD_SCRIPTS "${PROJECT_SOURCE_DIR}/.cmake/debian/finish.cmake")
set(CPACK_CIE_SOURCE_DIR "${PROJECT_SOURCE_DIR}")  # for that script

set(CPACK_COMPONENTS_ALL "")
# cie_package(COMPONENT NAME SECTION "summary\ntext" [DEPENDS ...] [RECOMMENDS ...] [SUGGESTS ...] [BREAKS ...]
#   [REPLACES ...])
macro(cie_package component name section description)
  cmake_parse_arguments(ARG "" "" "DEPENDS;RECOMMENDS;SUGGESTS;BREAKS;REPLACES" ${ARGN})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${description}\n\n\
cie gives every callback of a publish-subscribe application a thread of its\n\
own, and proves from LTTng traces that callbacks and threads stand in a\n\
one-to-one mapping and run with the parameters they were given.")
  foreach(relation DEPENDS RECOMMENDS SUGGESTS BREAKS REPLACES)
    list(JOIN ARG_${relation} ", " packages)
    set(CPACK_DEBIAN_${upper}_PACKAGE_${relation} "${packages}")
  endforeach()
  list(APPEND CPACK_COMPONENTS_ALL ${component})
endmacro()

# cie_package_units(COMPONENT UNIT...): what installing and removing does about units of systemd, their users and files.
macro(cie_package_units component)
  string(JOIN " " units ${ARGN})
  string(TOUPPER ${component} upper)
  foreach(script postinst prerm postrm)
    configure_file(.cmake/debian/units/${script}.in "${PROJECT_BINARY_DIR}/debian/${component}/${script}" @ONLY)
    list(APPEND CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA "${PROJECT_BINARY_DIR}/debian/${component}/${script}")
  endforeach()
endmacro()

set(library libcie${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(this_version "(= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
set(needed_to_build libyaml-cpp-dev libgcrypt20-dev)
if(CIE_BUILD_ROBOT AND CIE_WITH_DDS)
  # It uses what Cyclone DDS does not promise: no other version than the one it was built with.
  find_package(CycloneDDS REQUIRED)
  get_target_property(ddsc CycloneDDS::ddsc LOCATION)
  execute_process(COMMAND dpkg-query -S "${ddsc}" OUTPUT_VARIABLE ddsc ERROR_QUIET)
  set(needed_to_run "")
  if(ddsc MATCHES "^([^:,]+)")  # not if it comes from elsewhere
    set(ddsc ${CMAKE_MATCH_1})
    string(REGEX MATCH "[0-9]+$" after ${CycloneDDS_VERSION})
    math(EXPR after "${after} + 1")
    string(REGEX REPLACE "[0-9]+$" ${after} after ${CycloneDDS_VERSION})
    set(needed_to_run "${ddsc} (>= ${CycloneDDS_VERSION})" "${ddsc} (<< ${after})")
  endif()
  cie_package(runtime ${library} libs "callback-isolated executor over Cyclone DDS\n\
Nodes, timers, publishers, subscriptions and services over Cyclone DDS, the\n\
executors that decide which thread runs their callbacks, and their LTTng\n\
tracepoints: what programs are linked with."
    DEPENDS ${needed_to_run})
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/.cmake/debian/triggers")
  cie_package(robot cie-robot devel "run and record callback-isolated applications\n\
What runs on the robot: the container of components, the recorder, and a\n\
demo to be recorded."
    DEPENDS "${library} ${this_version}" lttng-tools passwd RECOMMENDS cie)
  cie_package_units(robot cie-record cie-collect)
  list(APPEND needed_to_build "${library} ${this_version}" cyclonedds-dev cyclonedds-tools)
endif()
if(CIE_BUILD_DESK)
  cie_package(desk cie devel "response times and proof of callback isolation from traces\n\
The command that reads traces and makes reports, verdicts, tables and files\n\
for viewers of them. It needs neither DDS nor LTTng."
    RECOMMENDS babeltrace2 SUGGESTS cie-doc cie-robot graphviz lttng-tools)
  cie_package_units(desk cie-live)
  cie_package(babeltrace2 babeltrace2-plugin-cie devel "response times of callbacks in babeltrace2\n\
The component sink.cie.report of babeltrace2."
    DEPENDS babeltrace2)
  list(APPEND needed_to_build libbabeltrace2-dev libfmt-dev libsqlite3-dev libsnappy-dev zlib1g-dev)
endif()
cie_package(dev libcie-dev libdevel "callback-isolated executor and trace analysis (development files)\n\
Headers, libraries, message types of ROS 2, and files for CMake and pkg-config."
  DEPENDS ${needed_to_build} SUGGESTS cie-doc)
# In 0.1.0 it was in libcie-dev.
cie_package(doc cie-doc doc "callback isolation and its proof (documentation)\n\
Tutorials, the reference of events, rules, specs and formats, how the executor\n\
and the analysis work, and examples of components."
  BREAKS "libcie-dev (<< 0.2.0)" REPLACES "libcie-dev (<< 0.2.0)")
set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
include(CPack)
