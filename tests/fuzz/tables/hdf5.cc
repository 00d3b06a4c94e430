// Tables in HDF5.
#include "fuzz/tables/read_table.h"

namespace counterpoint::fuzz {

void read(std::string_view input) { read_table("table.h5", input); }

}  // namespace counterpoint::fuzz
