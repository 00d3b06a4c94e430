# Builds contact/ alone, installs it into a scratch prefix, then builds and runs a project that finds it there.
# Without optimization, which would take most of the time; the build folder is kept for the next run.
# cmake -D BUILD_DIR= -D SOURCE_DIR= -D GENERATOR= -D COMPILER= -D LAUNCHER= -P contact_alone.cmake
set(scratch ${BUILD_DIR}/contact_alone)
file(REMOVE_RECURSE ${scratch}/prefix ${scratch}/consumer)
function(run)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${SOURCE_DIR} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
set(options -G ${GENERATOR} -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=Debug
            -D CMAKE_CXX_FLAGS_DEBUG=-O0)
if(LAUNCHER)
  list(APPEND options -D CMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER})
endif()
run(${CMAKE_COMMAND} -S ${SOURCE_DIR}/contact -B ${scratch}/build ${options}
    -D COUNTERPOINT_BUILD_TESTS=OFF -D COUNTERPOINT_UNITY=ON)
run(${CMAKE_COMMAND} --build ${scratch}/build --parallel 2)
run(${CMAKE_COMMAND} --install ${scratch}/build --prefix ${scratch}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE_DIR}/tests/install/contact_consumer -B ${scratch}/consumer ${options}
    -D CMAKE_PREFIX_PATH=${scratch}/prefix)
run(${CMAKE_COMMAND} --build ${scratch}/consumer)
run(${scratch}/consumer/consumer)
