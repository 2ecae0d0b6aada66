# Unpacks the packages into a new root, builds the outside project against them, runs its programs.
file(REMOVE_RECURSE "${SCRATCH}")
set(prefix "${SCRATCH}/root/usr")

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "failed (${status}): ${ARGN}\n${output}")
  endif()
endfunction()

file(MAKE_DIRECTORY "${SCRATCH}/root")
file(GLOB packages "${PACKAGES}/*.deb")
foreach(package IN LISTS packages)
  run(dpkg-deb -x "${package}" "${SCRATCH}/root")
endforeach()
run(${CMAKE_COMMAND} -S "${SOURCES}" -B "${SCRATCH}/build" -G "${GENERATOR}"
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_BUILD_TYPE=Debug)
run(${CMAKE_COMMAND} --build "${SCRATCH}/build")
run(${CMAKE_COMMAND} -E env CIE_LOOPBACK=1 CIE_DISCOVERY_TAG=package "${SCRATCH}/build/robot")
run("${SCRATCH}/build/scheduling")
run("${SCRATCH}/build/desk")

# The example of components, as the documentation has it.
file(GLOB example "${prefix}/share/doc/*/executor/examples/components/app.yaml")
get_filename_component(example "${example}" DIRECTORY)
run(${CMAKE_COMMAND} -S "${example}" -B "${SCRATCH}/components" -G "${GENERATOR}"
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_BUILD_TYPE=Debug)
run(${CMAKE_COMMAND} --build "${SCRATCH}/components")
run(${CMAKE_COMMAND} -E env CIE_DISCOVERY_TAG=package timeout --preserve-status -s TERM 5
  "${prefix}/bin/cie" run "${SCRATCH}/components/components/app.yaml")

# The same without CMake. The desk's libraries are static; of the robot's, what is linked must be found.
file(GLOB_RECURSE pc "${prefix}/lib/*/cie-analysis.pc" "${prefix}/lib/cie-analysis.pc")
get_filename_component(pkgconfig "${pc}" DIRECTORY)
set(ENV{PKG_CONFIG_PATH} "${pkgconfig}")
execute_process(COMMAND pkg-config --cflags --libs cie-viewer-export OUTPUT_VARIABLE flags COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(flags UNIX_COMMAND "${flags}")
run(${COMPILER} -std=c++20 "${SOURCES}/desk.cpp" -o "${SCRATCH}/desk" ${flags})
run("${SCRATCH}/desk")
execute_process(COMMAND pkg-config --cflags --libs cie-executor OUTPUT_VARIABLE flags COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(flags UNIX_COMMAND "${flags}")
run(${COMPILER} -std=c++20 -shared -fPIC "${SOURCES}/component.cpp" -o "${SCRATCH}/component.so" ${flags})

execute_process(COMMAND pkg-config --cflags --libs cie-scheduling OUTPUT_VARIABLE flags COMMAND_ERROR_IS_FATAL ANY)
if(flags MATCHES "dds")
  message(FATAL_ERROR "cie-scheduling.pc asks for DDS: ${flags}")
endif()
separate_arguments(flags UNIX_COMMAND "${flags}")
run(${COMPILER} -std=c++20 "${SOURCES}/scheduling.cpp" -o "${SCRATCH}/scheduling" ${flags})
run(${CMAKE_COMMAND} -E env "LD_LIBRARY_PATH=${pkgconfig}/.." "${SCRATCH}/scheduling")

run("${prefix}/bin/cie" --version)
run("${prefix}/bin/cie-record" --help)
# Ended by SIGTERM, cie-run says 0 if it could load its component; until it listens to signals it dies of them.
file(COPY "${SOURCES}/app.yaml" DESTINATION "${SCRATCH}")
run(${CMAKE_COMMAND} -E env CIE_DISCOVERY_TAG=package timeout --preserve-status -s TERM 5
  "${prefix}/bin/cie" run "${SCRATCH}/app.yaml")
