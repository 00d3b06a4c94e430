// Tables in NumPy's .npz format.
#include "fuzz/tables/read_table.h"

namespace counterpoint::fuzz {

void read(std::string_view input) { read_table("table.npz", input); }

}  // namespace counterpoint::fuzz
