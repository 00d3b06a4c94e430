// Targets for files of robots and scenes.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "counterpoint/model/scene.h"
#include "counterpoint/model/urdf/srdf.h"
#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {
namespace {

/// A cube with edges of 2 m as a binary STL file.
std::string box_stl() {
  std::string out(80, ' ');
  const auto append = [&out](const auto& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  append(std::uint32_t{12});
  const auto corner = [&](int i) {
    for (int k = 0; k < 3; ++k) append((i >> k & 1) != 0 ? 1.0f : -1.0f);
  };
  constexpr std::array<std::array<int, 4>, 6> kFaces{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& f : kFaces) {
    for (const auto& t : {std::array{f[0], f[1], f[2]}, std::array{f[0], f[2], f[3]}}) {
      for (int k = 0; k < 3; ++k) append(0.0f);
      for (const int i : t) corner(i);
      append(std::uint16_t{0});
    }
  }
  return out;
}

/// Writes the cube beside the file under test, once.
void write_box() {
  [[maybe_unused]] static const std::filesystem::path mesh = write("box.stl", box_stl());
}

}  // namespace

/// URDF files: a single robot on a fixed and on a floating base; the only mesh beside the file is
/// box.stl.
void read_urdf(std::string_view input) {
  write_box();
  const std::filesystem::path file = write("robot.urdf", input);
  SceneOverrides overrides;
  // The length of the input selects the options, so that the same input always means the same.
  overrides.base = input.size() % 2 == 0 ? Base::kFixed : Base::kFloating;
  overrides.ground = input.size() % 4 >= 2;
  overrides.repair_inertias = input.size() % 8 >= 4;
  check(load_scene(file, overrides).model);
}

/// Single MJCF files; the only mesh beside the file is box.stl.
void read_mjcf(std::string_view input) {
  write_box();
  const std::filesystem::path file = write("model.mjcf", input);
  SceneOverrides overrides;
  overrides.repair_inertias = input.size() % 2 == 1;
  check(load_scene(file, overrides).model);
}

/// Single SDF files; beside the file are a mesh, box.stl, and a model to include, `part`.
void read_sdf(std::string_view input) {
  write_box();
  static const std::filesystem::path part =
      write("part.sdf", "<sdf version='1.9'><model name='part'><link name='l'/></model></sdf>");
  const std::filesystem::path file = write("model.sdf", input);
  SceneOverrides overrides;
  overrides.repair_inertias = input.size() % 2 == 1;
  check(load_scene(file, overrides).model);
}

/// SRDF files alone, without a check of the names in them, which the scene does.
void read_srdf(std::string_view input) { load_srdf(write("robot.srdf", input)); }

/// Scene files with a robot, a mesh, a table of heights and an SRDF file beside them.
void read_scene(std::string_view input) {
  write_box();
  static const std::filesystem::path others[] = {
      write("robot.urdf", kSmallRobot), write("heights.csv", "0,0,0\n0,1,0\n0,0,0\n"),
      write("robot.srdf",
            "<robot name='r'><disable_collisions link1='base' link2='arm'/></robot>")};
  const Scene scene = load_scene(write("scene.yaml", input));
  check(scene.model);
  if (!scene.q.allFinite() || !scene.v.allFinite()) std::abort();
  if (!(scene.options.time_step > 0.0)) std::abort();
}

}  // namespace counterpoint::fuzz
