// Single MJCF files; the only mesh beside the file is box.stl.
#include "counterpoint/model/scene.h"
#include "fuzz/box_stl.h"
#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {

void read(std::string_view input) {
  static const std::filesystem::path mesh = write("box.stl", box_stl());
  const std::filesystem::path file = write("model.mjcf", input);
  SceneOverrides overrides;
  overrides.repair_inertias = input.size() % 2 == 1;
  check(load_scene(file, overrides).model);
}

}  // namespace counterpoint::fuzz
