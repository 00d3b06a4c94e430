// References: targets over time, from tables, and the problems and planners that follow them.
#include "counterpoint/engine/optimize/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/control.h"
#include "support/allocation_guard.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::optimization::reference_test {
namespace {

/// Rounding of a few products of numbers of order one.
constexpr double kRounding = 1e-12;

std::filesystem::path data() { return std::filesystem::path(test::source_dir()) / "data"; }

/// Motion at constant velocity v (nv) from q, sampled at uneven times.
Samples steady_motion(const Model& model, const VectorX& q, const VectorX& v) {
  Samples samples{{0.5, 0.6, 0.9, 1.5}, MatrixX(model.nq(), 4)};
  for (Eigen::Index i = 0; i < 4; ++i) {
    VectorX at = q;
    integrate_configuration(model, q, v, samples.time[static_cast<std::size_t>(i)] - 0.5, at);
    samples.values.col(i) = at;
  }
  return samples;
}

// Between samples, positions move and rotations turn at constant speed: a steady motion is
// reproduced exactly. Outside of the samples the ends are held.
TEST(Reference, ASteadyMotionIsReproducedBetweenItsSamples) {
  const Scene scene = load_scene(data() / "scenes/optimize/scenes/humanoid.yaml");
  const Model& model = scene.model;
  VectorX v = VectorX::LinSpaced(model.nv(), -1.0, 1.5), out;
  const Samples samples = steady_motion(model, scene.q, v);
  const Reference reference(model, Quantity::kConfiguration, samples, {0.5, 2.0});
  for (const double time : {0.0, 0.05, 0.1, 0.33, 0.5, 0.7, -1.0}) {
    reference.sample(time, out);
    VectorX expected = scene.q;
    integrate_configuration(model, scene.q, v, std::clamp(2.0 * time, 0.0, 1.0), expected);
    VectorX error(model.nv());
    configuration_difference(model, expected, out, error);
    EXPECT_LT(error.cwiseAbs().maxCoeff(), kRounding) << time;
  }
}

// A loop carries floating bodies on by the way of a cycle; speeds scale with the rate and are zero
// beyond a motion that does not loop.
TEST(Reference, ALoopGoesOnAndARateScalesSpeeds) {
  const Scene scene = load_scene(data() / "scenes/optimize/scenes/humanoid.yaml");
  const Model& model = scene.model;
  VectorX v = VectorX::Zero(model.nv()), out;
  v[0] = 2.0;
  const Samples samples = steady_motion(model, scene.q, v);
  const Reference loop(model, Quantity::kConfiguration, samples, {0.5, 1.0, true});
  for (const double time : {0.0, 0.7, 1.0, 7.3, -2.4}) {
    loop.sample(time, out);
    EXPECT_NEAR(out[0], scene.q[0] + 2.0 * time, 10 * kRounding) << time;
    EXPECT_EQ(out[2], scene.q[2]);
  }
  const Samples speeds{{0.0, 1.0}, MatrixX::Constant(3, 2, 4.0)};
  const Reference half(model, Quantity::kPointVelocity, speeds, {0.0, 0.5});
  half.sample(1.9, out);
  EXPECT_EQ(out, VectorX::Constant(3, 2.0));
  half.sample(2.1, out);
  EXPECT_TRUE(out.isZero(0.0));
}

/// A table of a body that steps to its left side and a foot of it, 1 m in a second.
constexpr const char* kSteps =
    "time,ball/body.x,ball/body.y,ball/body.z,ball/body.qw,ball/body.qx,ball/body.qy,ball/body.qz,"
    "left.x,left.y,left.z,right.x,right.y,right.z\n"
    "0,0,0.1,0,1,0,0,0,10,1,0,20,-3,0\n"
    "1,1,-0.1,0,1,0,0,0,11,3,0,21,-1,0\n";

ProblemFile problem_with(const test::TempFolder& folder, const std::string& terms) {
  folder.write("scene.yaml", "models: [{name: ball, sphere: 0.1, mass: 1, position: [7, 8, 9]}]\n");
  folder.write("steps.csv", kSteps);
  return load_problem(folder.write(
      "p.yaml", "scene: scene.yaml\ntime_step: 0.5\nsteps: 6\n" + ("terms:\n" + terms)));
}

// Every other cycle is the mirror image in y = 0, where left and right change places.
TEST(Reference, AMirroredLoopAlternates) {
  const test::TempFolder folder;
  const ProblemFile file = problem_with(
      folder,
      "  - {quantity: position, link: ball/body, target: {file: steps.csv, columns: left, loop: "
      "true, mirror: [left, right]}}\n"
      "  - {quantity: configuration, target: {file: steps.csv, loop: true, mirror: [left, "
      "right]}}\n"
      "  - {quantity: position, link: ball/body, target: {file: steps.csv, columns: left, mirror: "
      "[left, right]}}\n");
  const auto& left = file.problem.terms[0].targets;
  const auto& ball = file.problem.terms[1].targets;
  ASSERT_EQ(left.size(), 7u);
  // The image of the right foot goes from y = 3 to y = 1 and starts where the left one has ended.
  const double y[] = {1, 2, 3, 2, 1, 2, 3}, base_y[] = {0.1, 0, -0.1, 0, 0.1, 0, -0.1};
  for (std::size_t t = 0; t < left.size(); ++t) {
    EXPECT_NEAR(left[t][0], 10.0 + 0.5 * static_cast<double>(t), kRounding) << t;
    EXPECT_NEAR(left[t][1], y[t], kRounding) << t;
    EXPECT_NEAR(ball[t][0], 0.5 * static_cast<double>(t), kRounding) << t;
    EXPECT_NEAR(ball[t][1], base_y[t], kRounding) << t;
  }
  EXPECT_EQ(file.problem.terms[2].targets[0], Vector3(20, 3, 0));
}

TEST(Reference, RefusalsNameFileLineAndColumn) {
  const struct {
    const char *target, *expected;
  } cases[] = {
      {"position, link: ball/body, target: {file: none.csv, columns: left}", "none.csv"},
      {"position, link: ball/body, target: {file: steps.csv, columns: foot}",
       "p.yaml:5: terms[0].target: "},
      {"position, link: ball/body, target: {file: steps.csv, columns: foot}", "'foot.x'"},
      {"position, link: ball/body, target: {file: steps.csv}", "'columns' is missing"},
      {"position, link: ball/body, points: [[0, 0, 0], [1, 0, 0]], target: {file: steps.csv, "
       "columns: left}",
       "of one link and one point"},
      {"velocity, target: {file: steps.csv}", "'ball/body.vx'"},
      {"configuration, target: {file: steps.csv, columns: {knee: x}}",
       "'knee' is no coordinate of the scene; known: ball/body.x"},
      {"sliding, link: ball/body, target: {file: steps.csv, columns: left}",
       "sliding takes no target from a file"},
      {"configuration, target: {file: torn.csv}", "torn.csv:3"},
      {"configuration, target: {file: turned.csv}", "turned.csv:2: a quaternion has the length 2"},
  };
  const test::TempFolder folder;
  folder.write("torn.csv", "time\n0\n0\n");
  std::string turned = kSteps;
  turned.replace(turned.find("0,1,0,0,0,10"), 3, "0,2");
  folder.write("turned.csv", turned);
  for (const auto& c : cases) {
    try {
      problem_with(folder, std::string("  - {quantity: ") + c.target + "}\n");
      ADD_FAILURE() << c.target << " was accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(c.expected), std::string::npos)
          << c.target << " gave: " << error.what();
    }
  }
}

// At each replan the targets are those of the frames' times, without memory from the heap.
TEST(Reference, APlannerMovesTargetsWithTime) {
  ControlFile file = load_control(data() / "scenes/control/quadruped_walk.yaml");
  file.planner.first_iterations = 3;
  Problem& problem = file.file.problem;
  const Model& model = *problem.model;
  std::erase_if(problem.terms, [](const Term& known) { return known.name == "speed"; });
  Term& term = problem.terms.emplace_back();
  term.quantity = Quantity::kConfiguration;
  term.weight.setZero(model.nv());
  term.weight[0] = 20.0;
  VectorX v = VectorX::Zero(model.nv());
  v[0] = 0.3;
  const Samples samples = steady_motion(model, problem.start_q, v);
  term.reference = std::make_shared<const Reference>(model, term.quantity, samples,
                                                     Playback{samples.time[0], 1.0, true});
  set_targets(problem, 0.0);
  Planner planner(problem, file.planner);
  VectorX q = problem.start_q, u = v;
  constexpr int kWarm = 150, kCounted = 5;
  std::size_t before = 0;
  for (int i = 0; i < kWarm; ++i) {
    if (i == kWarm - kCounted) before = test::allocation_count();
    planner.replan(i * file.interval, q, v);
    planner.sample((i + 1) * file.interval, q, v, u);
  }
  EXPECT_EQ(test::allocation_count(), before);
  const double time = (kWarm - 1) * file.interval;
  const auto& targets = planner.problem().terms.back().targets;
  for (std::size_t t = 0; t < targets.size(); ++t)
    EXPECT_NEAR(targets[t][0],
                problem.start_q[0] + 0.3 * (time + static_cast<double>(t) * problem.h()),
                10 * kRounding);
  // Nothing but the reference says that the quadruped goes anywhere, 0.9 m in all.
  EXPECT_NEAR(q[0] - problem.start_q[0], 0.3 * time, 0.05);
}

// With a free start a motion that obeys physics and its own targets is found from any first guess:
// a ball in free fall, whose speed at the start follows from the targets.
TEST(Reference, AFreeStartFindsTheSpeedOfAThrow) {
  const test::TempFolder folder;
  const double h = 0.05, speed = 3.0;
  std::string table = "time,b.x,b.y,b.z\n";
  // Semi-implicit Euler steps of a throw: z_t = v h t - g h^2 t (t + 1) / 2.
  for (int t = 0; t <= 8; ++t)
    table += std::to_string(h * t) + ",0,0," +
             std::to_string(5.0 + speed * h * t - kStandardGravity * h * h * t * (t + 1) / 2.0) +
             "\n";
  folder.write("throw.csv", table);
  folder.write("scene.yaml", "models: [{name: ball, sphere: 0.1, mass: 1, position: [0, 0, 4]}]\n");
  const ProblemFile file = load_problem(folder.write(
      "p.yaml",
      "scene: scene.yaml\ntime_step: 0.05\nsteps: 8\nstart: {fixed: false}\nterms:\n  - {quantity: "
      "position, link: ball/body, target: {file: throw.csv, columns: b}}\n"));
  const Result result = optimize(file.problem, file.guess, file.settings);
  EXPECT_EQ(result.outcome, Outcome::kConverged);
  // The table has six digits.
  EXPECT_NEAR(result.q[0][2], 5.0, 1e-5);
  EXPECT_NEAR(result.v[0][2], speed, 1e-4);
  EXPECT_NEAR(result.q[8][2], 5.0 + speed * h * 8 - kStandardGravity * h * h * 36, 1e-5);
}

}  // namespace
}  // namespace counterpoint::optimization::reference_test
