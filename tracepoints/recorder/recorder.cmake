# cie-record. It drives LTTng's session daemon, whether or not this build carries tracepoints itself.
pkg_check_modules(LTTNG_CTL REQUIRED IMPORTED_TARGET lttng-ctl>=2.13)
pkg_check_modules(LIBTRACEEVENT REQUIRED IMPORTED_TARGET libtraceevent)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)

add_library(cie_recorder STATIC
  recorder/child_process.cpp
  recorder/ctf_stream.cpp
  recorder/error.cpp
  recorder/kernel_events.cpp
  recorder/kernel_recording.cpp
  recorder/manifest.cpp
  recorder/options.cpp
  recorder/processes.cpp
  recorder/recording.cpp
  recorder/session_daemon.cpp
  recorder/signals.cpp
  recorder/stream_check.cpp
  recorder/tracefs.cpp
  recorder/tracing_session.cpp)
target_link_libraries(cie_recorder
  PUBLIC cie_schema PkgConfig::LTTNG_CTL
  PRIVATE PkgConfig::LIBTRACEEVENT nlohmann_json::nlohmann_json CLI11::CLI11)
target_include_directories(cie_recorder
  PUBLIC "${CMAKE_CURRENT_SOURCE_DIR}/recorder"
  PRIVATE "${CMAKE_CURRENT_BINARY_DIR}/generated")
cie_compile_options(cie_recorder)

cie_program(cie-record SOURCES recorder/main.cpp LIBRARIES cie_recorder)
