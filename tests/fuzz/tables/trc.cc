// Marker files in TRC.
#include "fuzz/tables/read_table.h"

namespace counterpoint::fuzz {

void read(std::string_view input) { read_table("table.trc", input); }

}  // namespace counterpoint::fuzz
