# Defines the tests of contact/ when it is built alone; otherwise tests/CMakeLists.txt does.
enable_testing()
find_package(GTest REQUIRED)
include(GoogleTest)
set(tests_dir ${CMAKE_CURRENT_SOURCE_DIR}/../tests)
set(COUNTERPOINT_SHARED_DATA "${CMAKE_CURRENT_SOURCE_DIR}/../../shared/data" CACHE PATH
    "Folder with contact_problems")
file(GLOB sources CONFIGURE_DEPENDS ${tests_dir}/contact/*_test.cc)
add_executable(contact_test ${sources} ${tests_dir}/support/allocation_guard.cc
               ${tests_dir}/support/paths.cc)
target_link_libraries(contact_test PRIVATE counterpoint::contact GTest::gtest GTest::gtest_main
                      counterpoint_flags)
target_include_directories(contact_test PRIVATE ${tests_dir})
target_compile_definitions(contact_test PRIVATE COUNTERPOINT_SHARED_DATA="${COUNTERPOINT_SHARED_DATA}")
# The tests of contact/ use neither the other files of the project nor its program.
set_source_files_properties(${tests_dir}/support/paths.cc PROPERTIES COMPILE_DEFINITIONS
                            "COUNTERPOINT_SOURCE_DIR=\"\";COUNTERPOINT_COMMAND=\"\"")
gtest_discover_tests(contact_test)
