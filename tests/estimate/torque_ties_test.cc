// Fits of recorded joint forces with parameters that elements share, and with stated priors.
#include <gtest/gtest.h>

#include "counterpoint/engine/estimate/fit/fit_spread.h"
#include "estimate/torque_recordings.h"

namespace counterpoint::estimation::torque_ties_test {
namespace {

using namespace torque_recordings;

TEST(TorqueTies, TiedMassesAreThoseFoundOneByOne) {
  const Scene scene = scene_of("double_pendulum.yaml");
  const Scene truth = with_settings(scene, "mass:upper+lower=1.3");
  const Recording recording = moved(truth, 8.0, 0.002, 1.5, 21);
  const ColumnMap map = map_of(scene.model);
  TorqueFitOptions options;
  options.cutoff = kUnfiltered;
  const auto found = [&](const std::string& text) {
    return fitted(scene, map, recording, text, options).parameters.values();
  };
  // The forces are exact; the search settles to 1e-7 of the ranges, 0.2 to 5 kg.
  constexpr double kFound = 1e-6;
  EXPECT_NEAR(found("mass:upper+lower")[0], 1.3, kFound);
  for (const double one : found("mass:upper,mass:lower")) EXPECT_NEAR(one, 1.3, kFound);
  // Predictions of rows find it, too.
  Experiment e{scene, map, {recording}, 1, {}};
  e.prediction.substeps = 1;
  e.prediction.scene_step = 0.002;
  e.prediction.horizon = 20;
  const std::vector<int> all{0};
  FitOptions few;
  few.samples = 4;
  few.refined = 1;
  for (const char* text : {"mass:upper+lower", "mass:upper,mass:lower"}) {
    const std::vector<Parameter> parameters = parse_parameters(text, scene);
    for (const double one : fit(fit_problem(e, parameters, all, false), few).values())
      EXPECT_NEAR(one, 1.3, kFound) << text;
  }
}

TEST(TorqueTies, MirroredTiesAreFound) {
  const Scene scene = scene_of("double_pendulum.yaml");
  const Scene truth = with_settings(scene, "com_x:upper+~lower=0.03");
  Recording recording = moved(truth, 8.0, 0.002, 1.5, 22);
  recording.applied_force.row(0).array() += 0.4;
  recording.applied_force.row(1).array() -= 0.4;
  TorqueFitOptions options;
  options.cutoff = kUnfiltered;
  const VectorX found = fitted(scene, map_of(scene.model), recording,
                               "com_x:upper+~lower,force_offset:shoulder+~elbow,"
                               "force_gain:shoulder+elbow",
                               options)
                            .parameters.values();
  // The forces are exact; a fit takes their deviation for 1e-6 of the largest force at least, which
  // these parameters trade among each other: ten times that, of 1 m, of 30 N m and of 1.
  EXPECT_NEAR(found[0], 0.03, 1e-5);
  EXPECT_NEAR(found[1], 0.4, 3e-4);
  EXPECT_NEAR(found[2], 1.0, 1e-5);
}

TEST(TorqueTies, ATieOfAllJointsIsTheirOnlyDamping) {
  const Scene scene = scene_of("double_pendulum.yaml");
  Recording recording = moved(with_settings(scene, "damping=0.4"), 8.0, 0.002, 1.0, 23);
  add_noise(0.0, 0.1, 24, recording);
  const ColumnMap map = map_of(scene.model);
  EXPECT_EQ(fitted(scene, map, recording, "damping", {}).parameters.values(),
            fitted(scene, map, recording, "damping:shoulder+elbow", {}).parameters.values());
}

// Forces are linear in damping, so that the estimate x with a prior of deviation d about the
// scene's x0 is the mean of x0 and the least-squares estimate, weighted by 1 / d^2 and by the
// information G / (s^2 c) of the rows; s and c are the channel's deviation and correlation, and G
// the sum of squared sensitivities.
TEST(TorquePriors, APriorPullsByItsWeight) {
  const Scene scene = with_settings(scene_of("double_pendulum.yaml"), "damping:elbow=0.5");
  Recording recording = moved(with_settings(scene, "damping:elbow=0.9"), 8.0, 0.002, 1.0, 25);
  add_noise(0.0, 0.2, 26, recording);
  ColumnMap map = map_of(scene.model);
  std::erase_if(map.entries, [](const ColumnMap::Entry& entry) {
    return entry.kind == ColumnMap::Entry::Kind::kForce && entry.index == 0;
  });
  constexpr double kScene = 0.5, kRange = 2.0;
  const auto fit_with = [&](const std::string& prior) {
    return fitted(scene, map, recording, "damping:elbow=0..2" + prior, {});
  };
  const auto variance = [](const TorqueChannel& c) {
    return c.deviation * c.deviation * c.correlation;
  };
  const TorqueFit wide = fit_with("");
  const FittedParameter& free = wide.parameters.parameters[0];
  ASSERT_TRUE(free.interval);
  const TorqueChannel& channel = wide.channels[0];
  const double half = 0.5 * (free.interval->upper - free.interval->lower);
  const double sd = half / fitting::student_95(channel.rows / channel.correlation - 1.0);
  // The range is the prior where none is stated.
  const double information = 1.0 / (sd * sd) - 1.0 / (kRange * kRange);
  const double least = free.value + (free.value - kScene) / (kRange * kRange) / information;
  const double G = information * variance(channel);
  for (const double d : {3.0 * sd, sd, 0.3 * sd}) {
    const TorqueFit pulled = fit_with("~" + std::to_string(d));
    const double stated = std::stod(std::to_string(d));
    const double rows = G / variance(pulled.channels[0]), prior = 1.0 / (stated * stated);
    // The search settles to 1e-7 of the range, in each round anew.
    EXPECT_NEAR(pulled.parameters.parameters[0].value,
                (rows * least + prior * kScene) / (rows + prior), 1e-6 * kRange);
    EXPECT_EQ(pulled.parameters.parameters[0].interval.has_value(), rows > prior);
  }
}

TEST(TorquePriors, APriorTellsOfItsPartnerAndNotOfItself) {
  // Only the sum of both masses' moments is told (TorqueFit.NamesTheSumThatAloneIsTold).
  const Scene scene = scene_of("double_pendulum.yaml");
  MatrixX q = MatrixX::Zero(2, 1002);
  for (Eigen::Index i = 0; i < q.cols(); ++i) q(0, i) = 1e-3 * static_cast<double>(i);
  Recording recording = recorded(scene, q, 0.01);
  add_noise(0.0, 0.01, 9, recording);
  ColumnMap map = map_of(scene.model);
  map.entries.pop_back();  // the elbow's force
  const auto told = [&](const std::string& text) {
    std::vector<bool> out;
    for (const FittedParameter& one : fitted(scene, map, recording, text, {}).parameters.parameters)
      out.push_back(one.interval.has_value());
    return out;
  };
  EXPECT_EQ(told("mass:upper,mass:lower"), (std::vector<bool>{false, false}));
  EXPECT_EQ(told("mass:upper~0.01,mass:lower"), (std::vector<bool>{false, true}));
  EXPECT_EQ(told("mass:upper~0.01,mass:lower~0.001"), (std::vector<bool>{true, false}));
}

}  // namespace
}  // namespace counterpoint::estimation::torque_ties_test
