# Installs the build tree into a new prefix, builds the outside project against it, runs its programs.
file(REMOVE_RECURSE "${SCRATCH}")
set(prefix "${SCRATCH}/prefix")

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "failed (${status}): ${ARGN}\n${output}")
  endif()
endfunction()

run(${CMAKE_COMMAND} --install "${BUILD_TREE}" --prefix "${prefix}")
run(${CMAKE_COMMAND} -S "${SOURCES}" -B "${SCRATCH}/build" -G "${GENERATOR}"
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_BUILD_TYPE=Debug)
run(${CMAKE_COMMAND} --build "${SCRATCH}/build")
run(${CMAKE_COMMAND} -E env CIE_LOOPBACK=1 CIE_DISCOVERY_TAG=package "${SCRATCH}/build/robot")
run("${SCRATCH}/build/desk")
run("${prefix}/bin/cie" --version)
run("${prefix}/bin/cie-record" --help)
# Ended by SIGTERM, cie-run says 0 if it could load its component.
file(COPY "${SOURCES}/app.yaml" DESTINATION "${SCRATCH}")
run(${CMAKE_COMMAND} -E env CIE_DISCOVERY_TAG=package timeout --preserve-status -s TERM 1
  "${prefix}/bin/cie" run "${SCRATCH}/app.yaml")
