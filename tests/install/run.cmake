# Installs the build tree into a scratch prefix, then builds and runs a project that finds it there.
# cmake -D BUILD_DIR= -D SOURCE_DIR= -D CONSUMER_SOURCE= -D GENERATOR= -P run.cmake
set(scratch ${BUILD_DIR}/installed)
file(REMOVE_RECURSE ${scratch})
function(run)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${SOURCE_DIR} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${scratch}/prefix)
run(${CMAKE_COMMAND} -G ${GENERATOR} -S ${SOURCE_DIR}/tests/install/consumer -B ${scratch}/build
    -D CMAKE_BUILD_TYPE=Release -D CMAKE_PREFIX_PATH=${scratch}/prefix
    -D CONSUMER_SOURCE=${CONSUMER_SOURCE})
run(${CMAKE_COMMAND} --build ${scratch}/build)
run(${scratch}/build/consumer)
# The template of docs/guide/cpp.md, as installed.
run(${CMAKE_COMMAND} -G ${GENERATOR} -S ${scratch}/prefix/share/doc/counterpoint/examples/template
    -B ${scratch}/template -D CMAKE_PREFIX_PATH=${scratch}/prefix)
run(${CMAKE_COMMAND} --build ${scratch}/template)
run(${scratch}/template/fall ${scratch}/prefix/share/counterpoint/scenes/cube_drop.yaml)
run(${scratch}/build/estimate ${scratch}/prefix/share/counterpoint/scenes/double_pendulum.yaml)
run(${scratch}/build/watch ${scratch}/prefix/share/counterpoint/scenes/cube_drop.yaml)
run(${scratch}/prefix/bin/counterpoint inspect ${scratch}/prefix/share/counterpoint/scenes/cube_drop.yaml)
