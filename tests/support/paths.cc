#include "support/paths.h"

namespace counterpoint::test {

std::string source_dir() { return COUNTERPOINT_SOURCE_DIR; }
std::string shared_data() { return COUNTERPOINT_SHARED_DATA; }
std::string command_file() { return COUNTERPOINT_COMMAND; }

}  // namespace counterpoint::test
