// Where the tests find what they read. Functions, not macros: no object file depends on the folder
// it was compiled in, so that a compiler cache serves every checkout.
#pragma once

#include <string>

namespace counterpoint::test {

std::string source_dir();    ///< the project's root
std::string shared_data();   ///< recordings, problems and robots that are not part of the project
std::string command_file();  ///< the program `counterpoint` of this build

}  // namespace counterpoint::test
