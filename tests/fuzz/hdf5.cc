// Tables as HDF5.
#include "fuzz/tables.h"

namespace counterpoint::fuzz {

void read(std::string_view input) { read_table("table.h5", input); }

}  // namespace counterpoint::fuzz
