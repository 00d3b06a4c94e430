// Scene files with a robot, a mesh, a table of heights and an SRDF file beside them.
#include "counterpoint/model/scene.h"

#include "fuzz/box_stl.h"
#include "fuzz/fuzz.h"
#include "fuzz/small_robot.h"

namespace counterpoint::fuzz {

void read(std::string_view input) {
  static const std::filesystem::path others[] = {
      write("box.stl", box_stl()), write("robot.urdf", kSmallRobot),
      write("heights.csv", "0,0,0\n0,1,0\n0,0,0\n"),
      write("robot.srdf",
            "<robot name='r'><disable_collisions link1='base' link2='arm'/></robot>")};
  const Scene scene = load_scene(write("scene.yaml", input));
  check(scene.model);
  if (!scene.q.allFinite() || !scene.v.allFinite()) std::abort();
  if (!(scene.options.time_step > 0.0)) std::abort();
}

}  // namespace counterpoint::fuzz
