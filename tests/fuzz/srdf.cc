// SRDF files, by themselves: which names they list is the business of the scene.
#include "counterpoint/model/urdf/srdf.h"

#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {

void read(std::string_view input) { load_srdf(write("robot.srdf", input)); }

}  // namespace counterpoint::fuzz
