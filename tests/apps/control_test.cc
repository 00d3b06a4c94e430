// `control` through files: its table tells `inverse` of the pushes.
#include <gtest/gtest.h>

#include "apps/command.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::test::control_test {
namespace {

// A free base has no motor, so that nothing but the push and contacts moves it. The inverse takes
// the push from the table and finds no other force, to 1e-8 of the largest force (it is exact to
// the solver's 1e-10); without these columns it finds 60 N on the base, a tenth of that force.
TEST(Control, ThePushIsInTheTableForTheInverse) {
  const CommandFolder folder("control_push");
  const CommandResult run = folder.run(
      "control quadruped_walk --duration 0.2 --push-link trunk --push 0,60,0,0.1,0.05 --output "
      "{}/push.csv");
  EXPECT_EQ(run.exit_code, 1) << run.errors;  // its success tests ask for longer runs
  const std::string scene = "data/scenes/optimize/scenes/quadruped.yaml";
  const Trajectory table = read_trajectory(
      folder.path("push.csv"), load_scene(std::filesystem::path(source_dir()) / scene).model);
  ASSERT_EQ(table.known.rows(), 6);
  for (int step = 0; step < table.num_steps(); ++step)
    EXPECT_EQ(table.known(1, step), step >= 100 && step < 150 ? 60.0 : 0.0) << step;
  const nlohmann::json found = folder.report("inverse " + scene + " {}/push.csv");
  EXPECT_LT(found["unactuated_force_max"].get<double>(),
            1e-8 * found["force_scale_max"].get<double>());
}

}  // namespace
}  // namespace counterpoint::test::control_test
