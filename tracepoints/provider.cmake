# The part of tracepoints/ that a robot needs: the provider behind its facade, and the recorder.
file(CONFIGURE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/generated/version.hpp" CONTENT
"// Version of this build, as run_begin and manifests carry it.
#pragma once

namespace cie {
inline constexpr const char* kToolVersion = \"@PROJECT_VERSION@\";
}  // namespace cie
" @ONLY)

cie_library(cie_tracepoints ALIAS tracepoints SHARED SOURCES
  base/background_thread.cpp
  base/priority_mutex.cpp
  base/sched_attr.cpp
  provider/announcer.cpp
  provider/hot.cpp
  provider/objects.cpp
  provider/process_info.cpp
  provider/provider.cpp
  provider/read_back.cpp
  provider/registry.cpp
  provider/ros2_profile.cpp)
target_link_libraries(cie_tracepoints PUBLIC cie_schema PRIVATE Threads::Threads)
# LTTng's macros define the provider in one source and declare it in the others.
set_target_properties(cie_tracepoints PROPERTIES UNITY_BUILD OFF)
target_include_directories(cie_tracepoints PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}"
  "${CMAKE_CURRENT_BINARY_DIR}/generated")
# Never unloaded: LTTng and threads of the process may call into it until the very end.
target_link_options(cie_tracepoints PRIVATE -Wl,-z,nodelete)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set_source_files_properties(provider/hot.cpp PROPERTIES COMPILE_OPTIONS -mcx16
    SKIP_PRECOMPILE_HEADERS ON)
endif()
if(CIE_WITH_LTTNG)
  pkg_check_modules(LTTNG_UST REQUIRED IMPORTED_TARGET lttng-ust>=2.13)
  target_link_libraries(cie_tracepoints PRIVATE PkgConfig::LTTNG_UST)
  target_compile_definitions(cie_tracepoints PRIVATE CIE_WITH_LTTNG)

  # The profile `ros2`, which cie::tracepoints loads where CIE_TRACE_PROFILE asks for it.
  cie_library(cie_ros2_profile ALIAS ros2_profile SHARED SOURCES provider/ros2_provider.cpp)
  target_include_directories(cie_ros2_profile PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}")
  target_link_libraries(cie_ros2_profile PRIVATE cie_schema PkgConfig::LTTNG_UST ${CMAKE_DL_LIBS})
  target_compile_definitions(cie_tracepoints PRIVATE
    CIE_ROS2_PROFILE_LIBRARY="$<TARGET_SONAME_FILE_NAME:cie_ros2_profile>")
  add_dependencies(cie_tracepoints cie_ros2_profile)
endif()

cie_pkg_config(cie-tracepoints DESCRIPTION "LTTng-UST tracepoints of callback-isolated executors"
  LIBRARY cie_tracepoints REQUIRES cie-schema)

if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/recorder/recorder.cmake")
  include(recorder/recorder.cmake)
endif()
