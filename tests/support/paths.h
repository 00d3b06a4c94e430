// Paths of the files that tests read and run. Functions, not macros, so that no object file depends
// on the folder it was compiled in and a compiler cache serves every checkout.
#pragma once

#include <string>

namespace counterpoint::test {

std::string source_dir();    ///< the project's root
std::string shared_data();   ///< recordings, problems and robots that are not part of the project
std::string command_file();  ///< the program `counterpoint` of this build

}  // namespace counterpoint::test
