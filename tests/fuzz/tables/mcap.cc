// Tables in MCAP.
#include "fuzz/tables/read_table.h"

namespace counterpoint::fuzz {

void read(std::string_view input) { read_table("table.mcap", input); }

}  // namespace counterpoint::fuzz
