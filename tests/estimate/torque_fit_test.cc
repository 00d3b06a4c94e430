// Fits of recorded joint forces: known answers of arms, intervals, and directions that are not
// told.
#include "counterpoint/engine/estimate/torque_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "counterpoint/engine/estimate/excitation.h"
#include "counterpoint/engine/estimate/identifiability.h"
#include "estimate/torque_recordings.h"

namespace counterpoint::estimation::torque_fit_test {
namespace {

using namespace torque_recordings;

/// Inertial figures of a designer who was a quarter off.
constexpr const char* kDesign =
    "mass:shoulder_pitch_link=4.4,mass:arm_roll_link=2.2,mass:elbow_link=3.2,"
    "mass:wrist_pitch_link=1.5,com_x:elbow_link=0.01,com_z:arm_roll_link=0.12,"
    "spread_x:forearm_roll_link=1.15,spread_z:shoulder_pitch_link=0.9";

/// Base parameters of a fit of all links, and their standard deviations.
struct Base {
  VectorX value, deviation;
};
Base base_of(const BaseParameters& base, const TorqueFit& fit) {
  return {base.combinations * fit.inertial,
          (base.combinations * fit.inertial_covariance * base.combinations.transpose())
              .diagonal()
              .cwiseSqrt()};
}

TEST(BaseParameters, OfAPlanarArmAreThoseOfTheTextbook) {
  // Khalil and Dombre, "Modeling, Identification and Control of Robots" (2002), section 9.4: six
  // for two revolute joints with parallel axes across gravity, 43 for seven axes that alternate.
  const BaseParameters two = base_parameters(scene_of("double_pendulum.yaml").model);
  EXPECT_EQ(two.combinations.rows(), 6);
  EXPECT_EQ(base_parameters(scene_of("arm7.yaml").model).combinations.rows(), 43);
}

TEST(TorqueFit, ExactForcesGiveTheBaseParameters) {
  const Scene truth = scene_of("arm7.yaml");
  const Recording recording = moved(truth, 8.0, 0.002, 1.5, 1);
  TorqueFitOptions options;
  options.cutoff = kUnfiltered;
  const TorqueFit found =
      fitted(with_settings(truth, kDesign), map_of(truth.model), recording, "inertial:*", options);
  const BaseParameters base = base_parameters(truth.model);
  const VectorX expected = base.combinations * inertial_parameters(truth.model);
  // The links together weigh 16 kg, and reach 1 m: 1e-4 of that.
  EXPECT_LT((base.combinations * found.inertial - expected).cwiseAbs().maxCoeff(), 2e-3);
}

TEST(TorqueFit, IntervalsCoverTheTruth) {
  const Scene truth = scene_of("arm7.yaml"), design = with_settings(truth, kDesign);
  const Recording exact = moved(truth, 15.0, 0.002, 1.5, 2);
  const BaseParameters base = base_parameters(truth.model);
  const VectorX expected = base.combinations * inertial_parameters(truth.model);
  const ColumnMap map = map_of(truth.model);
  int covered = 0, all = 0;
  constexpr int kDraws = 20;
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    Recording noisy = exact;
    add_noise(1e-5, 0.3, draw, noisy);
    const Base found = base_of(base, fitted(design, map, noisy, "inertial:*", {}));
    for (Eigen::Index i = 0; i < expected.size(); ++i, ++all)
      covered += std::abs(found.value[i] - expected[i]) <= 1.96 * found.deviation[i];
  }
  // 95 %, with 860 values that are not independent.
  EXPECT_GE(covered, 0.92 * all);
  EXPECT_LE(covered, 0.98 * all);
}

TEST(TorqueFit, APayloadIsFound) {
  const Scene empty = scene_of("arm7.yaml");
  const Scene loaded = with_settings(
      empty, "mass:flange_roll_link=1.7,com_x:flange_roll_link=0.03,com_z:flange_roll_link=0.08");
  Recording recording = moved(loaded, 15.0, 0.002, 1.5, 3);
  add_noise(1e-5, 0.3, 4, recording);
  const TorqueFit found =
      fitted(empty, map_of(empty.model), recording, "inertial:flange_roll_link", {});
  const VectorX values = found.parameters.values();
  EXPECT_NEAR(values[0], 1.7, 0.017);
  EXPECT_NEAR(values[1], 0.03, 0.002);
  EXPECT_NEAR(values[2], 0.0, 0.002);
  EXPECT_NEAR(values[3], 0.08, 0.002);
}

TEST(TorqueFit, ADelayAGainAndAnOffsetAreFound) {
  constexpr double kDelay = 0.0073, kStep = 0.001;
  const Scene scene = scene_of("arm7.yaml");
  Recording recording = moved(scene, 12.0, kStep, 1.5, 5);
  const MatrixX exact = recording.applied_force;
  for (Eigen::Index row = exact.cols() - 1; row >= 8; --row) {
    const double at = static_cast<double>(row) - kDelay / kStep;
    const auto before = static_cast<Eigen::Index>(std::floor(at));
    recording.applied_force.col(row) =
        exact.col(before) + (at - std::floor(at)) * (exact.col(before + 1) - exact.col(before));
    recording.applied_force.col(row).array() = 1.1 * recording.applied_force.col(row).array() + 0.5;
  }
  add_noise(1e-5, 0.3, 6, recording);
  const TorqueFit found = fitted(scene, map_of(scene.model), recording,
                                 "force_delay:elbow,force_gain:elbow,force_offset:elbow,"
                                 "force_delay:shoulder_pitch,force_gain:shoulder_pitch,"
                                 "force_offset:shoulder_pitch",
                                 {});
  const VectorX values = found.parameters.values();
  for (int i = 0; i < 6; i += 3) {
    EXPECT_NEAR(values[i], kDelay, 0.0002);
    EXPECT_NEAR(values[i + 1], 1.1, 0.005);
    EXPECT_NEAR(values[i + 2], 0.5, 0.1);
  }
}

TEST(TorqueFit, FrictionAtRestIsNotFitted) {
  const Scene truth =
      with_settings(scene_of("double_pendulum.yaml"), "dry_friction:elbow=1.5,damping:elbow=0.3");
  Recording recording = moved(truth, 20.0, 0.002, 1.0, 7);
  // While the elbow rests, its friction balances whatever the motor does.
  for (int row = 0; row < recording.num_rows(); ++row)
    if (std::abs(recording.v(1, row)) < 0.05)
      recording.applied_force(1, row) += std::sin(0.01 * row);
  const Scene scene = scene_of("double_pendulum.yaml");
  const ColumnMap map = map_of(scene.model);
  TorqueFitOptions options;
  options.rest_speed = 0.08;
  const std::vector<Parameter> parameters =
      parse_parameters("dry_friction:elbow,damping:elbow", scene);
  const TorqueFit found = fit_torques(scene, map, {&recording}, parameters, options);
  const VectorX values = found.parameters.values();
  EXPECT_NEAR(values[0], 1.5, 0.02);
  EXPECT_NEAR(values[1], 0.3, 0.02);
  const TorqueScore score = score_torques(with_parameters(scene, parameters, values), map,
                                          {&recording}, parameters, values, options);
  EXPECT_GT(score.coordinates[1].r2, 0.99);
  EXPECT_GT(score.held[1], 1.5);  // the friction, and at most the amplitude of 1 more
  EXPECT_LT(score.held[1], 2.5);
}

/// An elbow whose friction falls from 2.5 to 1 N m over some 0.2 rad/s.
constexpr const char* kCurve =
    "dry_friction:elbow=1,breakaway_friction:elbow=2.5,stribeck_speed:elbow=0.2,damping:elbow=0.3";
constexpr const char* kOfCurve =
    "dry_friction:elbow,breakaway_friction:elbow,stribeck_speed:elbow,damping:elbow";

TEST(TorqueFit, AFrictionCurveIsFound) {
  const Scene scene = scene_of("double_pendulum.yaml"), truth = with_settings(scene, kCurve);
  Recording recording = moved(truth, 20.0, 0.002, 1.0, 7);
  TorqueFitOptions options;
  options.cutoff = kUnfiltered;
  const ColumnMap map = map_of(scene.model);
  // Not exact for few rows with a change of sign, where smoothing rounds the step of friction.
  const VectorX exact = fitted(scene, map, recording, kOfCurve, options).parameters.values();
  EXPECT_LT((exact - (VectorX(4) << 1.0, 2.5, 0.2, 0.3).finished()).cwiseAbs().maxCoeff(), 1e-3);
  add_noise(0.0, 0.1, 8, recording);
  const TorqueFit found = fitted(scene, map, recording, kOfCurve, options);
  const double expected[] = {1.0, 2.5, 0.2, 0.3};
  for (std::size_t i = 0; i < 4; ++i) {
    const FittedParameter& p = found.parameters.parameters[i];
    ASSERT_TRUE(p.interval);
    // 1e4 rows with a noise of 0.1 N m, a tenth of them within the curve: 2 %, thrice of it.
    EXPECT_NEAR(p.value, expected[i], 0.06 * expected[i]);
    EXPECT_LT(p.interval->lower, p.interval->upper);
  }
}

TEST(TorqueFit, FrictionWithoutExcessIsLeftWithoutIt) {
  const Scene scene = scene_of("double_pendulum.yaml");
  const Scene truth = with_settings(scene, "dry_friction:elbow=1.5,damping:elbow=0.3");
  const Recording recording = moved(truth, 20.0, 0.002, 1.0, 7);
  TorqueFitOptions options;
  options.cutoff = kUnfiltered;
  const VectorX found =
      fitted(scene, map_of(scene.model), recording, kOfCurve, options).parameters.values();
  EXPECT_NEAR(found[0], 1.5, 1e-3);
  EXPECT_NEAR(found[1], found[0], 0.01);  // the least excess of a search is 0.001 N m
  EXPECT_NEAR(found[3], 0.3, 1e-3);
}

TEST(TorqueFit, FrictionAtRestBalancesUpToItsBound) {
  const Scene scene = scene_of("double_pendulum.yaml"), truth = with_settings(scene, kCurve);
  Recording recording = moved(truth, 20.0, 0.002, 1.0, 7);
  // While the elbow rests, its friction is anything up to 2.5 N m.
  const Scene smooth = with_settings(truth, "dry_friction:elbow=0,breakaway_friction:elbow=0");
  const Recording bare = moved(smooth, 20.0, 0.002, 1.0, 7);
  for (int row = 0; row < recording.num_rows(); ++row)
    if (std::abs(recording.v(1, row)) < 0.07)  // the filter mixes rows beside rest
      recording.applied_force(1, row) = bare.applied_force(1, row) + 2.5 * std::sin(0.01 * row);
  const ColumnMap map = map_of(scene.model);
  TorqueFitOptions options;
  options.cutoff = kUnfiltered;
  options.rest_speed = 0.1;
  const std::vector<Parameter> parameters = parse_parameters(kOfCurve, scene);
  const VectorX values =
      fit_torques(scene, map, {&recording}, parameters, options).parameters.values();
  EXPECT_NEAR(values[1], 2.5, 0.03);  // rows at the bound are few
  const auto r2 = [&](const VectorX& at, const VectorX& held) {
    return score_torques(with_parameters(scene, parameters, at), map, {&recording}, parameters, at,
                         options, held)
        .coordinates[1]
        .r2;
  };
  const VectorX nothing = VectorX::Zero(2);
  EXPECT_GT(r2(values, nothing), 0.9999);
  VectorX without = values;
  without[1] = without[0];  // dry friction alone does not hold so much
  EXPECT_LT(r2(without, nothing), 0.99);
}

TEST(TorqueFit, PredictsOtherMotions) {
  const Scene truth = scene_of("arm7.yaml"), design = with_settings(truth, kDesign);
  const ColumnMap map = map_of(truth.model);
  Recording fitted_one = moved(truth, 15.0, 0.002, 1.5, 10),
            other = moved(truth, 15.0, 0.002, 1.5, 11);
  add_noise(1e-5, 0.3, 12, fitted_one);
  add_noise(1e-5, 0.3, 13, other);
  const std::vector<Parameter> parameters = parse_parameters("inertial:*", design);
  const TorqueFit found = fit_torques(design, map, {&fitted_one}, parameters, {});
  const auto rms = [&](const Scene& scene) {
    double sum = 0.0;
    for (const CoordinateMetrics& one : score_torques(scene, map, {&other}, {}, {}, {}).coordinates)
      sum += one.rms * one.rms;
    return std::sqrt(sum);
  };
  const double noise = rms(truth);
  EXPECT_LE(rms(with_parameters(design, parameters, found.parameters.values())), 1.05 * noise);
  EXPECT_GT(rms(design), 5.0 * noise);
}

TEST(TorqueFit, NamesTheSumThatAloneIsTold) {
  // Straight and slow, both masses pull at the shoulder only: m_1 c_1 + m_2 (l + c_2).
  const Scene scene = scene_of("double_pendulum.yaml");
  constexpr double kStep = 0.01, kSpeed = 0.1;  // [s], [rad/s]
  MatrixX q = MatrixX::Zero(2, 1002);
  for (Eigen::Index i = 0; i < q.cols(); ++i) q(0, i) = kSpeed * kStep * static_cast<double>(i);
  Recording recording = recorded(scene, q, kStep);
  add_noise(0.0, 0.01, 9, recording);
  ColumnMap map = map_of(scene.model);
  map.entries.pop_back();  // the elbow's force
  const TorqueFit found = fitted(scene, map, recording, "mass:upper,mass:lower", {});
  const std::vector<UntoldDirection> untold =
      identifiability(parse_parameters("mass:upper,mass:lower", scene), found.parameters).untold;
  ASSERT_EQ(untold.size(), 1U);
  // m_1 0.5 m + m_2 (1 m + 0.5 m), with masses of 1 kg.
  const std::string& words = untold[0].words;
  EXPECT_TRUE(words.find("only mass:upper + 3 mass:lower is told: 4 kg") != std::string::npos ||
              words.find("only mass:lower + 0.333 mass:upper is told: 1.333 kg") !=
                  std::string::npos)
      << words;
}

TEST(Excitation, TellsMoreThanRandomMotionsWithinTheLimits) {
  const Scene scene = load_scene(test::source_dir() + "/data/scenes/arm7.yaml");
  const Model& model = scene.model;
  ExcitationOptions options;
  options.harmonics = 3;
  options.random_starts = 10;
  options.iterations = 6;
  const Excitation motion = excite(scene, parse_parameters("inertial:*", scene), 100.0, options);
  EXPECT_EQ(motion.told, 43);  // the base parameters
  EXPECT_LT(motion.condition, 0.8 * motion.random_condition);
  ASSERT_EQ(motion.time.size(), 1001U);
  EXPECT_TRUE(motion.q.col(0).isApprox(motion.q.col(1000), 1e-12));
  for (int j = 0; j < model.nv(); ++j) {
    EXPECT_GE(motion.q.row(j).minCoeff(), model.joint(j).lower);
    EXPECT_LE(motion.q.row(j).maxCoeff(), model.joint(j).upper);
    EXPECT_LE(motion.v.row(j).cwiseAbs().maxCoeff(), 1.02 * options.speed);  // between instants
  }
  EXPECT_THROW(excite(scene, parse_parameters("friction", scene), 100.0, options), InputError);
}

TEST(TorqueFit, RefusesBadInput) {
  const Scene scene = scene_of("double_pendulum.yaml");
  const ColumnMap map = map_of(scene.model);
  const Recording recording = moved(scene, 5.0, 0.01, 1.0, 1);
  const auto refused = [&](const Scene& s, const ColumnMap& m, const Recording& r,
                           const std::string& parameters, const char* word) {
    try {
      fitted(s, m, r, parameters, {});
      ADD_FAILURE() << word;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  refused(scene, map, recording, "smoothing", "smoothing");
  refused(scene, map, recording, "dry_friction:elbow,breakaway_friction",
          "breakaway_friction:JOINT");
  ColumnMap silent = map;
  std::erase_if(silent.entries, [](const ColumnMap::Entry& entry) {
    return entry.kind == ColumnMap::Entry::Kind::kForce;
  });
  refused(scene, silent, recording, "damping:elbow", "no forces");
  Recording uneven = recording;
  uneven.time[50] += 0.004;
  refused(scene, map, uneven, "damping:elbow", "not even");
  refused(scene, map, rows_of(recording, 0, 8), "damping:elbow", "longer recording");
  const Scene cube = scene_of("cube_drop.yaml");
  refused(cube, map_of(cube.model), recording, "mass", "explain");
}

}  // namespace
}  // namespace counterpoint::estimation::torque_fit_test
