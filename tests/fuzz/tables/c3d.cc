// Motion capture files in C3D.
#include "fuzz/tables/read_table.h"

namespace counterpoint::fuzz {

void read(std::string_view input) { read_table("table.c3d", input); }

}  // namespace counterpoint::fuzz
