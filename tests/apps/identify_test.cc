// identify: figures found from recordings, and what is said of bad input.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "apps/command.h"

namespace counterpoint {
namespace {

using test::CommandFolder;
using test::CommandResult;

/// Cube tosses with other figures than the scene's, one file a toss; rows 1/148 s apart.
void toss(const CommandFolder& folder, int count, const std::string& figures) {
  for (int i = 0; i < count; ++i) {
    folder.write(fmt::format("toss{}.yaml", i),
                 fmt::format("gravity: [0, 0, -9.81]\ntime_step: {:.17g}\nduration: 0.6\n"
                             "ground: {{{}}}\nmodels:\n"
                             "  - {{name: cube, box: [0.0524, 0.0524, 0.0524], mass: 0.37, {},\n"
                             "     position: [0, 0, {}], rpy: [{}, 0.3, 0.1],\n"
                             "     velocity: {{linear: [{}, 0.4, -0.5], angular: [2, {}, 1]}}}}\n",
                             1.0 / 148, figures, figures, 0.12 + 0.01 * i, 0.1 * i, 0.8 + 0.1 * i,
                             1.0 - 0.7 * i));
    const CommandResult result =
        folder.run(fmt::format("simulate {{}}/toss{0}.yaml --output {{}}/toss{0}.csv", i));
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  std::string map = "time: time\nfree: cube/body\nsubsteps: 1\ncolumns:\n";
  for (const char* name :
       {"x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"})
    map += fmt::format("  cube/body.{0}: cube/body.{0}\n", name);
  folder.write("map.yaml", map);
  folder.write("scene.yaml",
               fmt::format("gravity: [0, 0, -9.81]\ntime_step: {:.17g}\n"
                           "ground: {{friction: 0.4, restitution: 0.1}}\nmodels:\n"
                           "  - {{name: cube, box: [0.0524, 0.0524, 0.0524], mass: 0.37,\n"
                           "     friction: 0.4, restitution: 0.1, position: [0, 0, 1]}}\n",
                           1.0 / 148));
}

TEST(Identify, FindsTheFiguresOfItsOwnTosses) {
  const CommandFolder folder("identify_own");
  toss(folder, 6, "friction: 0.25, restitution: 0.3");
  const CommandResult result = folder.run(
      "identify {}/scene.yaml {}/toss*.csv --columns {}/map.yaml --parameters "
      "friction=0.05..0.8,restitution=0..0.8,mass --objective one-step --samples 20 --json "
      "{}/r.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json report = folder.json("r.json");
  const auto& found = report["parameters"];
  ASSERT_EQ(found.size(), 3u);
  // The recordings are exact: what is left is where Levenberg-Marquardt stops.
  constexpr double kTolerance = 1e-6;
  EXPECT_NEAR(found[0]["value"], 0.25, kTolerance);
  EXPECT_NEAR(found[1]["value"], 0.3, kTolerance);
  for (int i = 0; i < 2; ++i) {
    EXPECT_LE(found[i]["lower_95"], i == 0 ? 0.25 + kTolerance : 0.3 + kTolerance);
    EXPECT_GE(found[i]["upper_95"], i == 0 ? 0.25 - kTolerance : 0.3 - kTolerance);
  }
  // A free body falls and slides the same whatever its mass.
  EXPECT_FALSE(found[2]["identifiable"]);
  EXPECT_TRUE(found[2]["lower_95"].is_null());
  EXPECT_NEAR(found[2]["value"], 0.37, 1e-12);  // left as it is
  EXPECT_LT(report["test"]["found"]["position_error_mean_m"], 1e-6);
  EXPECT_GT(report["test"]["scene"]["position_error_mean_m"], 1e-3);
}

TEST(Identify, SaysWhatIsWrongInItsArguments) {
  const CommandFolder folder("identify_bad");
  toss(folder, 1, "friction: 0.25");
  const auto expect = [&](const std::string& arguments, const std::string& part) {
    const CommandResult result =
        folder.run("identify {}/scene.yaml {}/toss0.csv --columns {}/map.yaml " + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_NE(result.errors.find(part), std::string::npos) << result.errors;
  };
  expect("", "--parameters");
  expect("--parameters stickiness", "'stickiness': expected one of friction");
  expect("--parameters friction:ball", "'ball' is no geometry");
  expect("--parameters mass:ball", "one of the links cube/body");
  expect("--parameters damping", "joints are none");
  expect("--parameters gravity:cube", "of the whole scene");
  expect("--parameters friction=1", "expected NAME=LOW..HIGH");
  expect("--parameters friction=1..0.5", "lower bound 1 is not below 0.5");
  expect("--parameters friction=a..0.5", "'a' is no finite number");
  expect("--parameters restitution=0..1.5", "restitution 1.5; expected 0 to 1");
  expect("--parameters friction,friction", "given twice");
  expect("--parameters mass=0..1", "must be positive");
  expect("--parameters friction --train 0", "no recording is left");
  expect("--parameters friction --set friction", "expected NAME=VALUE");
}

}  // namespace
}  // namespace counterpoint
