// Terms that count in frames named by a table: wishes for a contact schedule.
#include <gtest/gtest.h>

#include <filesystem>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/control.h"
#include "counterpoint/engine/optimize/terms/evaluator.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::optimization::schedule_test {
namespace {

const char* const kScene =
    "ground: {}\nmodels: [{name: ball, sphere: 0.1, mass: 1, position: [0, 0, 0.1]}]\n";

/// A problem of 6 steps of 0.1 s with one term besides the condition on forces.
std::string problem_with(const std::string& when) {
  return "scene: scene.yaml\ntime_step: 0.1\nsteps: 6\nterms:\n"
         "  - {quantity: contact_force, link: ball/body, when: " +
         when + "}\n";
}

ProblemFile load(const std::string& when, const std::string& table) {
  const test::TempFolder folder;
  folder.write("scene.yaml", kScene);
  folder.write("contacts.csv", table);
  return load_problem(folder.write("problem.yaml", problem_with(when)));
}

std::string refusal(const std::string& when, const std::string& table) {
  try {
    load(when, table);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

// A row holds from its time to that of the next one.
TEST(Schedule, TermsCountWhereTheTableSaysSo) {
  const std::string table = "time,foot\n1.0,1\n1.2,0\n1.45,1\n";
  const ProblemFile off = load("{file: contacts.csv, column: foot, is: 0}", table);
  EXPECT_EQ(off.problem.terms[0].active, (std::vector<char>{0, 0, 1, 1, 1, 0, 0}));
  const ProblemFile on = load("{file: contacts.csv, column: foot, start: 1.1}", table);
  EXPECT_EQ(on.problem.terms[0].active, (std::vector<char>{1, 0, 0, 0, 1, 1, 1}));
  const Layout layout(off.problem);
  for (int t = 0; t < off.problem.steps; ++t) {
    int rows = 0;
    for (const Span& span : layout.spans(t)) rows += span.term == 0 ? span.rows : 0;
    EXPECT_EQ(rows, off.problem.terms[0].active[static_cast<std::size_t>(t)] ? 3 : 0) << t;
  }
}

TEST(Schedule, RefusesNonsenseWithLineAndRemedy) {
  const std::string table = "time,foot\n0,1\n0.2,0.5\n";
  EXPECT_NE(refusal("{file: contacts.csv, column: foot}", table).find("is neither 0 nor 1"),
            std::string::npos);
  EXPECT_NE(refusal("{file: contacts.csv, column: hand}", table).find("hand"), std::string::npos);
  EXPECT_NE(
      refusal("{file: contacts.csv, column: foot, is: 2}", "time,foot\n0,1\n").find("out of range"),
      std::string::npos);
  EXPECT_NE(refusal("{file: none.csv, column: foot}", table).find("none.csv"), std::string::npos);
  const ProblemFile off = load("{file: contacts.csv, column: foot}", "time,foot\n0,1\n");
  EXPECT_THROW(Planner(off.problem, PlannerSettings()), InputError);
}

// A leg that has 1 s for a hop of 0.5 m shall be in the air from 0.4 s to 0.56 s, 5 cm high.
TEST(Schedule, AHopperFliesWhenItShall) {
  const std::filesystem::path scenes =
      std::filesystem::path(test::source_dir()) / "data/scenes/optimize/scenes";
  const test::TempFolder folder;
  folder.write("contacts.csv", "time,foot\n0,1\n0.4,0\n0.56,1\n");
  const std::string when = "when: {file: contacts.csv, column: foot, is: 0}}\n";
  const ProblemFile file = load_problem(folder.write(
      "hop.yaml",
      "scene: " + (scenes / "hopper.yaml").string() +
          "\ntime_step: 0.02\nsteps: 50\npassive: [slide_x, slide_z, pitch]\n"
          "start: {pose: {hip: 0.6, knee: -1.2, slide_z: 0.7}, stand: true}\n"
          "goal: {pose: {slide_x: 0.5}, fixed: false}\nterms:\n"
          "  - {quantity: applied_force, weight: 2, over: effort_limit}\n"
          "  - {quantity: acceleration, weight: 0.002}\n"
          "  - {quantity: configuration, weight: {pitch: 1, hip: 0.1, knee: 0.1}}\n"
          "  - {quantity: configuration, weight: 20, target: goal, frames: last}\n"
          "  - {quantity: velocity, weight: 5, frames: last}\n"
          "  - {quantity: joint_limits, weight: 30, length: 0.05}\n"
          "  - {quantity: sliding, link: foot, radius: 0.04, length: 0.02, weight: 3}\n"
          "  - {quantity: clearance, link: foot, radius: 0.04, target: 0.05, weight: 10, " +
          when + "guess: {noise: 0.02}\ncontinuation: {extrapolate: false}\n"));
  Result result = optimize(file.problem, file.guess, file.settings);
  // Half of the starts converge; round-off decides which.
  for (std::uint64_t seed = 1; seed < 5 && result.outcome != Outcome::kConverged; ++seed)
    result = optimize(file.problem, seeded_guess(file, seed), file.settings);
  EXPECT_EQ(result.outcome, Outcome::kConverged);
  const Model& model = *file.problem.model;
  const Frame& foot = model.frames()[static_cast<std::size_t>(model.find_frame("foot"))];
  Workspace workspace(model);
  Inverse inverse;
  for (int t = 20; t < 28; ++t) {
    const auto i = static_cast<std::size_t>(t);
    step_inverse(model, result.options, result.q[i], result.v[i], result.v[i + 1], workspace,
                 inverse);
    // At 5 cm hard contacts have no force but for the smoothing of 1e-13 m.
    EXPECT_LT(contact_force_on(model, inverse, foot.body).norm(), 1e-6 * scene_weight(model)) << t;
  }
}

}  // namespace
}  // namespace counterpoint::optimization::schedule_test
