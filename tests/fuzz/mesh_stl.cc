// Meshes in STL files, including the conversion to hull and terrain.
#include "fuzz/mesh.h"

namespace counterpoint::fuzz {

void read(std::string_view input) { read_mesh(write("mesh.stl", input)); }

}  // namespace counterpoint::fuzz
