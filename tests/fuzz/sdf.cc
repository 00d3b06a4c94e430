// Single SDF files; beside the file are a mesh, box.stl, and a model to include, `part`.
#include "counterpoint/model/scene.h"
#include "fuzz/box_stl.h"
#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {

void read(std::string_view input) {
  static const std::filesystem::path mesh = write("box.stl", box_stl());
  static const std::filesystem::path part =
      write("part.sdf", "<sdf version='1.9'><model name='part'><link name='l'/></model></sdf>");
  const std::filesystem::path file = write("model.sdf", input);
  SceneOverrides overrides;
  overrides.repair_inertias = input.size() % 2 == 1;
  check(load_scene(file, overrides).model);
}

}  // namespace counterpoint::fuzz
