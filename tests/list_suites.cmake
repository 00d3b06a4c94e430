# Lists the suites of a GoogleTest program for ctest, one test a suite: most tests take less time than the start of a
# process.
# cmake -D PROGRAM= -D FOLDER= -D OUTPUT= -P list_suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listed COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+\\." suites "${listed}")
set(script "")
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "[\n.]" "" suite "${suite}")
  string(APPEND script "add_test([=[${FOLDER}.${suite}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${suite}.*]=])\n")
  # Pieces of meshes are cut anew, and nothing is left in the home of the user.
  string(APPEND script "set_tests_properties([=[${FOLDER}.${suite}]=] PROPERTIES ENVIRONMENT COUNTERPOINT_CACHE=off)\n")
endforeach()
file(WRITE ${OUTPUT} "${script}")
