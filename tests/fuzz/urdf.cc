// URDF files: a single robot on a fixed and on a floating base; the only mesh beside the file is
// box.stl.
#include "counterpoint/model/scene.h"
#include "fuzz/box_stl.h"
#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {

void read(std::string_view input) {
  static const std::filesystem::path mesh = write("box.stl", box_stl());
  const std::filesystem::path file = write("robot.urdf", input);
  SceneOverrides overrides;
  // The length of the input selects the options, so that the same input always means the same.
  overrides.base = input.size() % 2 == 0 ? Base::kFixed : Base::kFloating;
  overrides.ground = input.size() % 4 >= 2;
  overrides.repair_inertias = input.size() % 8 >= 4;
  check(load_scene(file, overrides).model);
}

}  // namespace counterpoint::fuzz
