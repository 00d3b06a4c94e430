# Instruments everything in this build for coverage, and with the address and undefined behaviour
# sanitizers.
if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  message(FATAL_ERROR "COUNTERPOINT_BUILD_FUZZERS needs Clang with libFuzzer; this is "
    "${CMAKE_CXX_COMPILER_ID}. Configure an empty build folder with -DCMAKE_CXX_COMPILER=clang++ "
    "(Debian: clang, libclang-rt-14-dev), or leave the option off: the replay of known inputs needs "
    "no Clang.")
endif()
add_compile_options(-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined
                    -fno-omit-frame-pointer -Wno-unknown-warning-option)
add_link_options(-fsanitize=address,undefined)
