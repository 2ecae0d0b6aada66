# cie-record. It drives LTTng's session daemon, whether or not this build carries tracepoints itself.
pkg_check_modules(LTTNG_CTL REQUIRED IMPORTED_TARGET lttng-ctl>=2.13)
pkg_check_modules(LIBTRACEEVENT REQUIRED IMPORTED_TARGET libtraceevent)
find_package(nlohmann_json REQUIRED)
find_package(fmt REQUIRED)

add_library(cie_recorder STATIC
  base/sched_attr.cpp
  recorder/collection.cpp
  recorder/ctf/stream_check.cpp
  recorder/keeping/chunk_names.cpp
  recorder/keeping/chunks_keeping.cpp
  recorder/keeping/directory_keeping.cpp
  recorder/keeping/flight_recorder.cpp
  recorder/keeping/kernel_beside.cpp
  recorder/keeping/kernel_snapshots.cpp
  recorder/keeping/live_keeping.cpp
  recorder/keeping/manifest.cpp
  recorder/keeping/outcome.cpp
  recorder/keeping/relay_keeping.cpp
  recorder/keeping/rotation.cpp
  recorder/keeping/snapshots_keeping.cpp
  recorder/keeping/tracing.cpp
  recorder/kernel/ctf_stream.cpp
  recorder/kernel/kernel_clock.cpp
  recorder/kernel/kernel_events.cpp
  recorder/kernel/kernel_reader.cpp
  recorder/kernel/kernel_recording.cpp
  recorder/kernel/kernel_ring.cpp
  recorder/kernel/kernel_source.cpp
  recorder/kernel/kernel_trial.cpp
  recorder/kernel/switch_check.cpp
  recorder/kernel/tracefs.cpp
  recorder/kernel/tracefs_source.cpp
  recorder/lttng/consumer_daemons.cpp
  recorder/lttng/deadline_watch.cpp
  recorder/lttng/event_watch.cpp
  recorder/lttng/lttng_calls.cpp
  recorder/lttng/pending_chunk.cpp
  recorder/lttng/process_watch.cpp
  recorder/lttng/relay_daemon.cpp
  recorder/lttng/relay_link.cpp
  recorder/lttng/session_channels.cpp
  recorder/lttng/session_daemon.cpp
  recorder/lttng/tracing_session.cpp
  recorder/options/command_line.cpp
  recorder/record.cpp
  recorder/system/child_process.cpp
  recorder/system/connection.cpp
  recorder/system/console.cpp
  recorder/system/directory_claim.cpp
  recorder/system/error.cpp
  recorder/system/group_witness.cpp
  recorder/system/instant.cpp
  recorder/system/processes.cpp
  recorder/system/signals.cpp
  recorder/system/temporary_directory.cpp
  recorder/target/escalation.cpp
  recorder/target/registration.cpp
  recorder/target/target.cpp)
target_link_libraries(cie_recorder
  PUBLIC cie_schema PkgConfig::LTTNG_CTL
  PRIVATE cie_help PkgConfig::LIBTRACEEVENT nlohmann_json::nlohmann_json fmt::fmt)
target_include_directories(cie_recorder
  PUBLIC "${CMAKE_CURRENT_SOURCE_DIR}/recorder" "${CMAKE_CURRENT_SOURCE_DIR}"
  PRIVATE "${CMAKE_CURRENT_BINARY_DIR}/generated")
cie_compile_options(cie_recorder)
cie_precompile_headers(cie_recorder)

# Kernel events by BPF, if there is what it takes to build that; by tracefs in any case.
find_program(CIE_BPF_CLANG clang DOC "clang, to compile the BPF programs of cie-record")
pkg_check_modules(LIBBPF IMPORTED_TARGET libbpf>=1.0)
if(CIE_BPF_CLANG AND LIBBPF_FOUND)
  set(source "${CMAKE_CURRENT_SOURCE_DIR}/recorder/kernel/sched.bpf.c")
  set(object "${CMAKE_CURRENT_BINARY_DIR}/sched.bpf.o")
  add_custom_command(OUTPUT "${object}"
    COMMAND "${CIE_BPF_CLANG}" -target bpf -O2 -g -ffreestanding -Wall -Wextra
      $<$<BOOL:${CIE_WERROR}>:-Werror>
      -idirafter "/usr/include/${CMAKE_LIBRARY_ARCHITECTURE}" -c "${source}" -o "${object}"
    DEPENDS "${source}" "${CMAKE_CURRENT_SOURCE_DIR}/recorder/kernel/kernel_record.h"
    COMMENT "Compiling the BPF programs" VERBATIM COMMAND_EXPAND_LISTS)
  set_source_files_properties(recorder/kernel/sched_bpf_object.cpp PROPERTIES
    COMPILE_DEFINITIONS "CIE_SCHED_BPF_OBJECT=\"${object}\"" OBJECT_DEPENDS "${object}")
  target_sources(cie_recorder PRIVATE recorder/kernel/bpf_source.cpp recorder/kernel/sched_bpf_object.cpp)
  target_link_libraries(cie_recorder PRIVATE PkgConfig::LIBBPF)
else()
  message(STATUS "clang or libbpf not found: cie-record has no BPF, only tracefs, for kernel events")
  target_sources(cie_recorder PRIVATE recorder/kernel/no_bpf_source.cpp)
endif()

cie_program(cie-record OF_PACKAGES SOURCES recorder/main.cpp LIBRARIES cie_recorder cie_help)
cie_program(cie-collect OF_PACKAGES SOURCES recorder/collect_main.cpp LIBRARIES cie_recorder cie_help fmt::fmt)
target_include_directories(cie-collect PRIVATE "${CMAKE_CURRENT_BINARY_DIR}/generated")
cie_manual_pages(cie-record cie-record)
cie_manual_pages(cie-collect cie-collect)
# An always-on recorder, and a collector. systemd looks for units and users of packages below /usr/lib, whatever the architecture.
foreach(unit cie-record cie-collect)
  install(FILES systemd/${unit}.service DESTINATION lib/systemd/system)
  install(FILES systemd/${unit}.sysusers DESTINATION lib/sysusers.d RENAME ${unit}.conf)
  install(FILES systemd/${unit}.tmpfiles DESTINATION lib/tmpfiles.d RENAME ${unit}.conf)
endforeach()
