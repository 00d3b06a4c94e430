// SRDF files alone, without a check of the names in them, which the scene does.
#include "counterpoint/model/urdf/srdf.h"

#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {

void read(std::string_view input) { load_srdf(write("robot.srdf", input)); }

}  // namespace counterpoint::fuzz
