# Helpers shared by every folder: how a cie target is compiled, installed and checked.
include(GNUInstallDirs)
include(CheckCXXSourceCompiles)
include(CheckLinkerFlag)
include(CMakePackageConfigHelpers)
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 17)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/lib")
set(CMAKE_ARCHIVE_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/lib")
file(RELATIVE_PATH CIE_RPATH_BIN_TO_LIB "/${CMAKE_INSTALL_BINDIR}" "/${CMAKE_INSTALL_LIBDIR}")
set(CMAKE_INSTALL_RPATH "$ORIGIN/${CIE_RPATH_BIN_TO_LIB}" "$ORIGIN" "$ORIGIN/../lib")

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)
endif()

# cie_find_ros(PREFIXES): the prefixes of ROS 2 that AMENT_PREFIX_PATH names, if one has rclcpp; else none.
function(cie_find_ros result)
  set(${result} "" PARENT_SCOPE)
  string(REPLACE ":" ";" prefixes "$ENV{AMENT_PREFIX_PATH}")
  foreach(prefix IN LISTS prefixes)
    if(EXISTS "${prefix}/share/rclcpp/cmake/rclcppConfig.cmake")
      set(${result} "${prefixes}" PARENT_SCOPE)
    endif()
  endforeach()
endfunction()

# Warnings, sanitizers: everything of ours is compiled with them, nothing of others.
function(cie_compile_options target)
  target_compile_options(${target} PRIVATE
    $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
      -Wnon-virtual-dtor -Woverloaded-virtual -Wold-style-cast -Wcast-align -Wformat=2>)
  # GCC 12 at -O3 sees overlapping copies in "text" + std::string (its bug 105651).
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-restrict>)
  if(CMAKE_UNITY_BUILD)  # whose sources GCC takes for headers, and for which it collects garbage too often: a tenth of its time
    target_compile_options(${target} PRIVATE
      $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage;--param=ggc-min-heapsize=600000>)
  endif()
  # A recording has the same numbers on every machine: AArch64 would multiply and add with one rounding, x86-64 does not.
  if(CMAKE_SYSTEM_PROCESSOR STREQUAL aarch64)
    target_compile_options(${target} PRIVATE -ffp-contract=off)
  endif()
  if(CIE_WERROR)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Werror>)
  endif()
  if(CIE_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${CIE_SANITIZE} -fno-omit-frame-pointer
      -fno-sanitize-recover=all)
    target_link_options(${target} PRIVATE -fsanitize=${CIE_SANITIZE})
  endif()
  if(CIE_SANITIZE MATCHES thread)
    # ThreadSanitizer knows no fences, which g++ therefore refuses; Boost.Asio's are not needed where its
    # queue of work is under a mutex.
    target_compile_definitions(${target} PRIVATE BOOST_ASIO_DISABLE_FENCED_BLOCK)
  endif()
endfunction()

# cie_guide_fuzzers(cie_analysis): what a fuzzer reaches in this library tells it where to go on. A fifth of the
# compiler's time, so only what is fuzzed has it.
function(cie_guide_fuzzers target)
  if(CIE_BUILD_FUZZERS)
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
endfunction()

# What most sources include, compiled once for a target, where the build asks for it (the trees of
# sanitizers and fuzzers do): a quarter of the time. Where g++ 12 optimises, it gives false warnings about
# strings (-Warray-bounds).
#
# For the same reason the trees in which one develops are unity builds (CMakePresets.json): twelve sources are
# compiled as one, in half of the time or less; tests are so in every tree. So names in the anonymous
# namespaces of one target differ, or a source says SKIP_UNITY_BUILD_INCLUSION. Both hide a missing #include,
# which the trees `release` and `package` find, and of most names tests/unit/suite/includes_test.py.
function(cie_precompile_headers target)
  if(CIE_PRECOMPILED_HEADERS)
    foreach(header algorithm chrono filesystem functional map memory mutex optional ostream set span string
        unordered_map variant vector)
      target_precompile_headers(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:<${header}$<ANGLE-R>>")
    endforeach()
  endif()
endfunction()

# cie_check_headers(cie_analysis [FOLDER]): each public header (of the folder of include/) is compiled alone,
# with what the target is linked to, so that it includes what it uses. For who develops, as the tests are.
function(cie_check_headers target)
  if(NOT CIE_BUILD_TESTS)
    return()
  endif()
  get_target_property(source_dir ${target} SOURCE_DIR)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS RELATIVE "${source_dir}/include"
    "${source_dir}/include/${ARGV1}/*.hpp")
  set(units "")
  foreach(header IN LISTS headers)
    string(REPLACE "/" "_" unit "${header}")
    set(unit "${CMAKE_CURRENT_BINARY_DIR}/header_check/${unit}.cpp")
    file(GENERATE OUTPUT "${unit}" CONTENT "#include <${header}>\n#include <${header}>\n")
    list(APPEND units "${unit}")
  endforeach()
  if(units)
    add_library(${target}_header_check OBJECT ${units})
    target_link_libraries(${target}_header_check PRIVATE ${target})
    set_target_properties(${target}_header_check PROPERTIES UNITY_BUILD OFF)
    cie_compile_options(${target}_header_check)
    target_compile_options(${target}_header_check PRIVATE -O0 -g0)
  endif()
endfunction()

# What is installed looks for libraries in the build tree as it does elsewhere. Otherwise CMake would end its
# path with colons, and to the loader an empty entry is the directory in which one happens to stand.
function(cie_keep_rpath target)
  set_target_properties(${target} PROPERTIES BUILD_WITH_INSTALL_RPATH ON)
endfunction()

# cie_library(cie_analysis ALIAS analysis [SHARED] SOURCES ...): library cie::analysis, exported.
function(cie_library target)
  cmake_parse_arguments(ARG "SHARED" "ALIAS" "SOURCES" ${ARGN})
  if(ARG_SHARED)
    add_library(${target} SHARED ${ARG_SOURCES})
    set_target_properties(${target} PROPERTIES VERSION ${PROJECT_VERSION}
      SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  else()
    add_library(${target} STATIC ${ARG_SOURCES})
  endif()
  add_library(cie::${ARG_ALIAS} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${ARG_ALIAS})
  target_include_directories(${target}
    PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
           $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_compile_features(${target} PUBLIC cxx_std_20)
  cie_compile_options(${target})
  cie_precompile_headers(${target})
  cie_keep_rpath(${target})
  install(TARGETS ${target} EXPORT cieTargets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT dev
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endfunction()

# cie_pkg_config(cie-analysis DESCRIPTION "..." LIBRARY cie_analysis [REQUIRES cie-schema ...] [LIBS -lz ...]):
# the same for builds without CMake.
function(cie_pkg_config name)
  cmake_parse_arguments(ARG "" "DESCRIPTION;LIBRARY" "REQUIRES;LIBS" ${ARGN})
  list(JOIN ARG_REQUIRES ", " requires)
  list(JOIN ARG_LIBS " " libs)
  file(RELATIVE_PATH prefix "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
  file(GENERATE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/${name}.pc" CONTENT
"prefix=\${pcfiledir}/${prefix}
Name: ${name}
Description: ${ARG_DESCRIPTION}
Version: ${PROJECT_VERSION}
Requires: ${requires}
Cflags: -I\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}
Libs: -L\${prefix}/${CMAKE_INSTALL_LIBDIR} -l${ARG_LIBRARY} ${libs}
")
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/${name}.pc" DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endfunction()

# cie_archives(RESULT sqlite3 z ...): these libraries' archives, if the system has them all and they are wanted; else none.
# A program takes from them what it uses if they stand behind all of our libraries that use them and before the shared
# ones, which then are not needed any more: looking up their symbols was half of a program's start, and a tenth of a
# report on a recording of ROS 2.
function(cie_archives result)
  set(${result} "" PARENT_SCOPE)
  if(NOT CIE_LINK_ARCHIVES OR CIE_SANITIZE OR NOT CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    return()
  endif()
  set(archives "")
  foreach(name IN LISTS ARGN)
    find_library(CIE_ARCHIVE_${name} lib${name}.a)
    mark_as_advanced(CIE_ARCHIVE_${name})
    if(NOT CIE_ARCHIVE_${name})
      message(STATUS "Programs are linked with shared libraries: there is no lib${name}.a")
      return()
    endif()
    list(APPEND archives "${CIE_ARCHIVE_${name}}")
  endforeach()
  set(${result} "${archives}" PARENT_SCOPE)
endfunction()

# cie_link_static(cie): without any shared library, the C library's included, where the system has its archive. A start
# maps and looks up nothing, which was a fifth of it. Addresses stay random (static PIE). The linker warns of what
# needs shared libraries after all: modules of NSS (users and hosts) and plugins of SQLite, none of which cie asks for.
function(cie_link_static target)
  set(CMAKE_REQUIRED_LINK_OPTIONS -static-pie)
  # Of each linker by itself: a build tree may get another one.
  string(MAKE_C_IDENTIFIER "CIE_IS_QUIET_LINKER ${CMAKE_EXE_LINKER_FLAGS}" is_quiet)
  check_linker_flag(CXX LINKER:--no-warnings ${is_quiet})
  if(${is_quiet})
    list(APPEND CMAKE_REQUIRED_LINK_OPTIONS LINKER:--no-warnings)
  endif()
  check_cxx_source_compiles("
    #if !defined __PIE__ && !defined __PIC__
    #error not for a static PIE
    #endif
    #include <iostream>
    int main() { std::cout << 1; }" CIE_LINKS_STATIC_PIE)
  if(CIE_LINKS_STATIC_PIE)
    set_target_properties(${target} PROPERTIES CIE_IS_STATIC ON)
    target_link_options(${target} PRIVATE ${CMAKE_REQUIRED_LINK_OPTIONS} LINKER:--gc-sections)
  else()
    target_link_options(${target} PRIVATE -static-libstdc++ -static-libgcc)
  endif()
endfunction()

# cie_shared(RESULT ZLIB::ZLIB ...): these libraries, for all but a program without shared libraries (cie_link_static).
function(cie_shared result)
  set(libraries "")
  foreach(library IN LISTS ARGN)
    list(APPEND libraries "$<BUILD_INTERFACE:$<$<NOT:$<BOOL:$<TARGET_PROPERTY:CIE_IS_STATIC>>>:${library}>>"
      "$<INSTALL_INTERFACE:${library}>")
  endforeach()
  set(${result} "${libraries}" PARENT_SCOPE)
endfunction()

# cie_program(cie-run SOURCES ... LIBRARIES ...): an installed command, which bash completes.
# OF_PACKAGES: shared libraries come from the system's packages alone, which are searched for nowhere else.
function(cie_program target)
  cmake_parse_arguments(ARG "NO_INSTALL;OF_PACKAGES" "" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${target} ${ARG_SOURCES})
  target_link_libraries(${target} PRIVATE ${ARG_LIBRARIES})
  cie_compile_options(${target})
  target_link_options(${target} PRIVATE LINKER:--as-needed)
  if(ARG_OF_PACKAGES)
    set_target_properties(${target} PROPERTIES INSTALL_RPATH "")
  endif()
  if(NOT ARG_NO_INSTALL)
    cie_keep_rpath(${target})
    install(TARGETS ${target} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
    # bash looks for a file of the command's name; one script knows all of them.
    install(FILES "${PROJECT_SOURCE_DIR}/viewer_export/completions/cie" RENAME ${target}
      DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  endif()
endfunction()

function(cie_install_headers)
  set(folder "${ARGV0}")
  install(DIRECTORY include/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder} COMPONENT dev
    FILES_MATCHING PATTERN "*.hpp")
endfunction()

# cie_manual_pages(PROGRAM PAGE...): manual pages of a program and of its commands (cie-report is of `cie report`), from
# what it prints of itself and from this folder's man/PAGE.h2m. The build runs the program for that.
function(cie_manual_pages program)
  if(CIE_SANITIZE)
    return()
  endif()
  find_program(CIE_HELP2MAN help2man)
  if(CMAKE_CROSSCOMPILING)
    message(STATUS "manual pages of ${program}: not built: it does not run on this machine")
    return()
  elseif(NOT CIE_HELP2MAN)
    message(STATUS "manual pages of ${program}: not built: there is no help2man")
    return()
  endif()
  set(pages "")
  foreach(name IN LISTS ARGN)
    string(REGEX REPLACE "^${program}-?" "" command "${name}")
    set(page "${PROJECT_BINARY_DIR}/man/${name}.1")
    set(more "${CMAKE_CURRENT_SOURCE_DIR}/man/${name}.h2m")
    add_custom_command(OUTPUT "${page}"
      COMMAND "${CMAKE_COMMAND}" -E make_directory "${PROJECT_BINARY_DIR}/man"
      COMMAND "${PROJECT_SOURCE_DIR}/.cmake/manual_page" "${page}" "${more}" ${PROJECT_VERSION}
        "$<TARGET_FILE:${program}>" ${command}
      DEPENDS ${program} "${more}" "${PROJECT_SOURCE_DIR}/.cmake/manual_page" VERBATIM)
    list(APPEND pages "${page}")
  endforeach()
  add_custom_target(${program}-manual ALL DEPENDS ${pages})
  install(FILES ${pages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
endfunction()

# The manual pages that are written by hand, of this folder's man/.
function(cie_install_manual)
  file(GLOB pages CONFIGURE_DEPENDS man/*.7)
  install(FILES ${pages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man7)
endfunction()

function(cie_install_package)
  set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/cie)
  install(EXPORT cieTargets NAMESPACE cie:: DESTINATION ${package_dir} COMPONENT dev)
  set(CIE_COMPONENTS "")
  foreach(component scheduling executor analysis)
    if(TARGET cie_${component})
      list(APPEND CIE_COMPONENTS ${component})
    endif()
  endforeach()
  list(JOIN CIE_COMPONENTS " " CIE_COMPONENTS)
  configure_package_config_file("${PROJECT_SOURCE_DIR}/.cmake/cieConfig.cmake.in"
    "${PROJECT_BINARY_DIR}/cieConfig.cmake" INSTALL_DESTINATION ${package_dir})
  write_basic_package_version_file("${PROJECT_BINARY_DIR}/cieConfigVersion.cmake"
    COMPATIBILITY SameMinorVersion)
  install(FILES "${PROJECT_BINARY_DIR}/cieConfig.cmake" "${PROJECT_BINARY_DIR}/cieConfigVersion.cmake"
    DESTINATION ${package_dir} COMPONENT dev)
endfunction()
