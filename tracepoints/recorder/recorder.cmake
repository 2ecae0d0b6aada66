# cie-record. It drives LTTng's session daemon, whether or not this build carries tracepoints itself.
pkg_check_modules(LTTNG_CTL REQUIRED IMPORTED_TARGET lttng-ctl>=2.13)
pkg_check_modules(LIBTRACEEVENT REQUIRED IMPORTED_TARGET libtraceevent)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)

add_library(cie_recorder STATIC
  recorder/child_process.cpp
  recorder/collection.cpp
  recorder/ctf_stream.cpp
  recorder/deadline_watch.cpp
  recorder/error.cpp
  recorder/flight_recorder.cpp
  recorder/kernel_clock.cpp
  recorder/kernel_events.cpp
  recorder/kernel_reader.cpp
  recorder/kernel_recording.cpp
  recorder/kernel_ring.cpp
  recorder/kernel_snapshots.cpp
  recorder/kernel_source.cpp
  recorder/live_stream.cpp
  recorder/manifest.cpp
  recorder/network_address.cpp
  recorder/options.cpp
  recorder/pending_chunk.cpp
  recorder/processes.cpp
  recorder/recording.cpp
  recorder/recording_always_on.cpp
  recorder/recording_messages.cpp
  recorder/recording_relay.cpp
  recorder/relay_daemon.cpp
  recorder/relay_link.cpp
  recorder/rotation.cpp
  recorder/session_daemon.cpp
  recorder/signals.cpp
  recorder/stream_check.cpp
  recorder/switch_check.cpp
  recorder/tracefs.cpp
  recorder/tracefs_source.cpp
  recorder/tracing_session.cpp)
target_link_libraries(cie_recorder
  PUBLIC cie_schema PkgConfig::LTTNG_CTL
  PRIVATE PkgConfig::LIBTRACEEVENT nlohmann_json::nlohmann_json CLI11::CLI11)
target_include_directories(cie_recorder
  PUBLIC "${CMAKE_CURRENT_SOURCE_DIR}/recorder"
  PRIVATE "${CMAKE_CURRENT_BINARY_DIR}/generated")
cie_compile_options(cie_recorder)

# Kernel events by BPF, if there is what it takes to build that; by tracefs in any case.
find_program(CIE_BPF_CLANG clang DOC "clang, to compile the BPF programs of cie-record")
pkg_check_modules(LIBBPF IMPORTED_TARGET libbpf>=1.0)
if(CIE_BPF_CLANG AND LIBBPF_FOUND)
  set(source "${CMAKE_CURRENT_SOURCE_DIR}/recorder/sched.bpf.c")
  set(object "${CMAKE_CURRENT_BINARY_DIR}/sched.bpf.o")
  add_custom_command(OUTPUT "${object}"
    COMMAND "${CIE_BPF_CLANG}" -target bpf -O2 -g -ffreestanding -Wall -Wextra -Werror
      -idirafter "/usr/include/${CMAKE_LIBRARY_ARCHITECTURE}" -c "${source}" -o "${object}"
    DEPENDS "${source}" "${CMAKE_CURRENT_SOURCE_DIR}/recorder/kernel_record.h"
    COMMENT "Compiling the BPF programs" VERBATIM)
  set_source_files_properties(recorder/sched_bpf_object.cpp PROPERTIES
    COMPILE_DEFINITIONS "CIE_SCHED_BPF_OBJECT=\"${object}\"" OBJECT_DEPENDS "${object}")
  target_sources(cie_recorder PRIVATE recorder/bpf_source.cpp recorder/sched_bpf_object.cpp)
  target_link_libraries(cie_recorder PRIVATE PkgConfig::LIBBPF)
else()
  message(STATUS "clang or libbpf not found: cie-record has no BPF, only tracefs, for kernel events")
  target_sources(cie_recorder PRIVATE recorder/no_bpf_source.cpp)
endif()

cie_program(cie-record SOURCES recorder/main.cpp LIBRARIES cie_recorder)
cie_program(cie-collect SOURCES recorder/collect_main.cpp LIBRARIES cie_recorder CLI11::CLI11)
target_include_directories(cie-collect PRIVATE "${CMAKE_CURRENT_BINARY_DIR}/generated")
cie_install_manual()
# An always-on recorder. systemd looks for units and users of packages below /usr/lib, whatever the architecture.
install(FILES systemd/cie-record.service DESTINATION lib/systemd/system)
install(FILES systemd/cie-record.sysusers DESTINATION lib/sysusers.d RENAME cie-record.conf)
install(FILES systemd/cie-record.tmpfiles DESTINATION lib/tmpfiles.d RENAME cie-record.conf)
