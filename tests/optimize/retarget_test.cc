// Retargeting: fits of recorded motions, and motions that a robot can do near them.
#include "counterpoint/engine/optimize/retarget.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/trajectory.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::optimization::retarget_test {
namespace {

std::filesystem::path data() { return std::filesystem::path(test::source_dir()) / "data"; }

std::string hopper_scene() {
  return "scene: " + (data() / "scenes/optimize/scenes/hopper.yaml").string() + "\n";
}

void write_motion(const std::filesystem::path& file, const Model& model, double h,
                  const std::vector<VectorX>& q) {
  TrajectoryWriter writer(file, model);
  const VectorX none = VectorX::Zero(model.nv());
  for (std::size_t t = 0; t + 1 < q.size(); ++t)
    writer.write_step({static_cast<double>(t) * h, q[t], none}, {}, h);
  writer.write_end({static_cast<double>(q.size() - 1) * h, q.back(), none});
}

/// A problem that follows motion.csv of a folder by its coordinates, beside no other wish.
std::string follower(double h, std::size_t frames, const std::string& scene) {
  return scene + "time_step: " + std::to_string(h) + "\nsteps: " + std::to_string(frames - 1) +
         "\nviolation_tolerance: 1.0e-6\npassive: [slide_x, slide_z, pitch]\nstart: {fixed: "
         "false}\n"
         "retarget:\n  motion: motion.csv\n"
         "  fit:\n    - {quantity: configuration, target: source}\n"
         "terms:\n  - {quantity: configuration, target: fit}\n"
         "continuation: {start: 1.0e-6}\n";
}

struct Hops {
  ProblemFile file;
  Result result;
};

Hops hops() {
  Hops out{load_problem(data() / "scenes/optimize/hopper.yaml"), {}};
  out.file.settings.threads = 1;
  out.result = optimize(out.file.problem, out.file.guess, out.file.settings);
  return out;
}

// A motion that obeys physics is its own nearest one. It obeys them to 1e-5 of the weight, which
// moves it in 1 s by 5e-5 m at most.
TEST(Retarget, AFeasibleMotionStaysAsItIs) {
  const Hops given = hops();
  ASSERT_EQ(given.result.outcome, Outcome::kConverged);
  const Model& model = *given.file.problem.model;
  const test::TempFolder folder;
  write_motion(folder.path() / "motion.csv", model, given.file.problem.h(), given.result.q);
  ProblemFile file = load_problem(folder.write(
      "p.yaml", follower(given.file.problem.h(), given.result.q.size(), hopper_scene())));
  const Fit fit = fit_motion(file);
  EXPECT_LT(rms_deviation(model, given.result.q, fit.q).maxCoeff(), 1e-12);
  const Result result = optimize(file.problem, file.guess, file.settings);
  EXPECT_EQ(result.outcome, Outcome::kConverged);
  EXPECT_LT(rms_deviation(model, given.result.q, result.q).maxCoeff(), 5e-5);
}

// A motion that no force explains, since its base is 2 cm too high at all times and its joints
// tremble, becomes one that obeys physics within a few of these distances.
TEST(Retarget, APerturbedMotionBecomesFeasible) {
  const Hops given = hops();
  const Model& model = *given.file.problem.model;
  const double h = given.file.problem.h();
  std::vector<VectorX> wrong = given.result.q;
  for (std::size_t t = 0; t < wrong.size(); ++t) {
    VectorX change = VectorX::Constant(model.nv(), 0.02 * std::sin(0.9 * static_cast<double>(t)));
    change[1] = 0.02;
    integrate_configuration(model, given.result.q[t], change, 1.0, wrong[t]);
  }
  const test::TempFolder folder;
  write_motion(folder.path() / "motion.csv", model, h, wrong);
  std::string text = follower(h, wrong.size(), hopper_scene());
  text.replace(text.rfind("1.0e-6"), 6, "1.0e-2");
  ProblemFile file = load_problem(folder.write("p.yaml", text));
  const Fit fit = fit_motion(file);
  const Verification before =
      verify(model, file.problem.options, file.problem.motors, fit.q, file.problem.start_v);
  EXPECT_GT(before.unactuated_max, 0.1);
  const Result result = optimize(file.problem, file.guess, file.settings);
  EXPECT_EQ(result.outcome, Outcome::kConverged);
  const Verification after =
      verify(model, result.options, file.problem.motors, result.q, result.v.front());
  EXPECT_LT(after.unactuated_max, 1e-6);
  EXPECT_LT(rms_deviation(model, wrong, result.q).maxCoeff(), 0.1);
}

// The places and orientations of a robot's own links determine its configuration, which the fit
// recovers, at any scale of the motion that is undone by the points.
TEST(Retarget, AFitOfItsOwnLinksRecoversTheMotion) {
  const Scene scene = load_scene(data() / "scenes/optimize/scenes/humanoid.yaml");
  const Model& model = scene.model;
  std::vector<VectorX> q(6, scene.q);
  for (std::size_t t = 0; t < q.size(); ++t) {
    VectorX change =
        VectorX::LinSpaced(model.nv(), -0.3, 0.4) * std::sin(1.0 + static_cast<double>(t));
    integrate_configuration(model, scene.q, change, 1.0, q[t]);
  }
  const test::TempFolder folder;
  write_motion(folder.path() / "motion.csv", model, 0.05, q);
  std::string map = "{pelvis: {link: pelvis, point: [0.1, 0, 0.2], source_point: [0.1, 0, 0.2]}";
  for (int i = 1; i < model.num_joints(); ++i)
    map += ", " + model.joint(i).link + ": " + model.joint(i).link;
  ProblemFile file = load_problem(folder.write(
      "p.yaml", "scene: " + (data() / "scenes/optimize/scenes/humanoid.yaml").string() +
                    "\ntime_step: 0.05\nsteps: 5\nretarget:\n  motion: motion.csv\n  map: " + map +
                    "}\n  fit:\n    - {quantity: position, sources: pelvis}\n"
                    "    - {quantity: orientation, sources: \"*\"}\nterms:\n  - {quantity: "
                    "configuration, target: fit}\n"));
  const Fit fit = fit_motion(file);
  // Gauss-Newton ends where a step gains 1e-5 of the cost; its last steps converge quadratically.
  EXPECT_LT(rms_deviation(model, q, fit.q).maxCoeff(), 1e-8);
  EXPECT_EQ(file.problem.terms[0].targets, fit.q);
  EXPECT_EQ(file.problem.start_q, fit.q.front());
}

TEST(Retarget, RefusalsSayWhatIsMissing) {
  const test::TempFolder folder;
  folder.write("motion.csv", "time,a\n0,0\n");
  const auto refusal = [&](const std::string& text, const SourceFiles& source) {
    try {
      ProblemFile file = load_problem(folder.write("p.yaml", hopper_scene() + text), {}, source);
      fit_motion(file);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const struct {
    std::string text, expected;
    SourceFiles source;
  } cases[] = {
      {"steps: 4\nterms:\n  - {quantity: velocity}\n", "the key 'retarget' is missing", {}},
      {"steps: 4\nterms:\n  - {quantity: velocity}\n", "the key 'retarget' is missing", {"x", ""}},
      {"steps: 4\nterms:\n  - {quantity: configuration, target: fit}\n",
       "p.yaml:4: terms[0].target: there is no 'retarget' in this file",
       {}},
      {"steps: 4\nterms:\n  - {quantity: configuration, target: source}\n",
       "there is no motion to follow",
       {}},
      {"steps: 4\nretarget: {fit: []}\nterms: []\n", "or give --motion FILE", {}},
      {"steps: 4\nretarget: {motion: motion.csv, fit: []}\nterms: []\n", "motion.csv:1", {}},
  };
  for (const auto& c : cases)
    EXPECT_NE(refusal(c.text, c.source).find(c.expected), std::string::npos)
        << c.text << "gave: " << refusal(c.text, c.source);
}

/// The demands of a motion that a robot can do near another one.
void expect_done(const std::string& name, const SourceFiles& source, int steps) {
  ProblemFile file = load_problem(data() / "scenes/retarget" / (name + ".yaml"), steps, source);
  const Fit fit = fit_motion(file);
  const Model& model = *file.problem.model;
  const Result result = optimize(file.problem, file.guess, file.settings);
  EXPECT_EQ(result.outcome, Outcome::kConverged);
  const Verification found =
      verify(model, result.options, file.problem.motors, result.q, result.v.front());
  EXPECT_LT(found.unactuated_max, 1e-3);
  EXPECT_LT(found.forward_check_max, 1e-8);
  EXPECT_LT(found.stance_slip_max, 1e-3);
  const VectorX off = rms_deviation(model, fit.q, result.q).tail(model.nv() - 6);
  EXPECT_LT(std::sqrt(off.squaredNorm() / static_cast<double>(off.size())), 0.1);
}

TEST(Retarget, AManWalksAsHumanoid) {
  const std::filesystem::path walk = std::filesystem::path(test::shared_data()) / "human_walk";
  if (!std::filesystem::exists(walk)) GTEST_SKIP() << walk << " is missing";
  expect_done("human_walk", {walk / "recording_raw.csv", walk / "scene.yaml"}, 30);
}

TEST(Retarget, AHumanoidJumpsAndTurns) { expect_done("turning_jump", {}, 73); }

}  // namespace
}  // namespace counterpoint::optimization::retarget_test
