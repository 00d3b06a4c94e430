// Joint torques of an arm without contact, estimated from noisy encoders alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/motion_estimate.h"
#include "counterpoint/engine/estimate/sensors/motion_filter.h"
#include "support/paths.h"

namespace counterpoint::estimation::learned_deviations_test {
namespace {

constexpr double kInterval = 0.002;  ///< [s]
constexpr int kRows = 1200;
/// Rows at both ends that are not compared, since a low-pass filter lacks the data beyond them.
constexpr int kEnds = 60;

Scene arm() { return load_scene(test::source_dir() + "/data/scenes/recordings/ur10.yaml"); }

/// Smooth motions of all joints up to 0.8 Hz.
std::vector<VectorX> smooth_motion(const Scene& scene) {
  const int n = scene.model.nq();
  std::vector<VectorX> out;
  for (int t = 0; t < kRows; ++t) {
    VectorX& q = out.emplace_back(scene.q);
    for (int i = 0; i < n; ++i)
      for (const double hertz : {0.3, 0.8}) {
        const double angle = 2.0 * std::numbers::pi * hertz * kInterval * t + 1.7 * i + 3.0 * hertz;
        q[i] += 0.12 / hertz * std::sin(angle);
      }
  }
  return out;
}

/// Inverse dynamics of the frames, row by row; zero at both ends [N m].
MatrixX torques(const Scene& scene, const std::vector<VectorX>& frames) {
  const Model& model = scene.model;
  SimulationOptions options = scene.options;
  options.time_step = kInterval;
  options.mean_velocity_forces = false;
  Workspace workspace(model);
  Inverse inverse;
  MatrixX out = MatrixX::Zero(model.nv(), kRows);
  const MatrixX v = steps_of(model, frames) / kInterval;
  for (int t = 1; t + 1 < kRows; ++t) {
    const auto i = static_cast<std::size_t>(t);
    step_inverse(model, options, frames[i], v.col(t - 1), frames[i + 1], v.col(t), Input(),
                 workspace, inverse);
    out.col(t) = inverse.applied_force;
  }
  return out;
}

VectorX rms(const MatrixX& difference) {
  const MatrixX inner = difference.middleCols(kEnds, kRows - 2 * kEnds);
  return (inner.rowwise().squaredNorm() / static_cast<double>(inner.cols())).cwiseSqrt();
}

struct Recorded {
  Recording recording;
  ColumnMap map;
  std::vector<VectorX> frames;
};

/// `motion` with white noise of this standard deviation [rad], equal for all joints.
Recorded recorded(const Scene& scene, const std::vector<VectorX>& motion, double noise) {
  Recorded out;
  const int n = scene.model.nq();
  out.recording.file = "arm";
  out.recording.q.resize(n, kRows);
  out.recording.v = out.recording.applied_force = MatrixX::Zero(n, kRows);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int t = 0; t < kRows; ++t) {
    out.recording.time.push_back(kInterval * t);
    for (int i = 0; i < n; ++i)
      out.recording.q(i, t) = motion[static_cast<std::size_t>(t)][i] + noise * normal(random);
    out.frames.push_back(out.recording.q.col(t));
  }
  for (int i = 0; i < n; ++i)
    out.map.entries.push_back({ColumnMap::Entry::Kind::kPosition, i, "q", {"q", 1.0, 0.0}});
  return out;
}

// Compares with the best of seven low-pass filters, chosen per joint with the true torques at hand,
// from a shoulder torque of 100 N m to a wrist torque of 1e-4 N m and for noise levels that differ
// by a factor of 30. Two sines are smoother than torques with random changes, more so at low noise:
// factors of 3.6 and 2.4 were measured.
TEST(LearnedDeviations, TorquesAreAboutThoseOfTheBestLowPass) {
  const Scene scene = arm();
  const std::vector<VectorX> motion = smooth_motion(scene);
  const MatrixX truth = torques(scene, motion);
  for (const auto& [noise, bound] : {std::pair(1e-5, 4.0), std::pair(3e-4, 2.6)}) {
    const Recorded data = recorded(scene, motion, noise);
    VectorX best = VectorX::Constant(scene.model.nv(), std::numeric_limits<double>::infinity());
    for (const double hertz : {2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0})
      best = best.cwiseMin(
          rms(torques(scene, low_pass(scene.model, data.frames, kInterval, hertz)) - truth));
    const MotionEstimate estimate = estimate_motion(scene, data.map, data.recording);
    EXPECT_EQ(estimate.errors, RecordingErrors::kWhite);
    const VectorX found = rms(estimate.force - truth);
    for (int i = 0; i < scene.model.nv(); ++i) {
      EXPECT_LE(found[i], bound * best[i]) << "joint " << i << ", noise " << noise;
      // A quantile of 1200 differences determines the deviation to 3 %.
      EXPECT_NEAR(estimate.position_deviation[i], noise, 0.1 * noise) << "joint " << i;
    }
    const MatrixX off = (estimate.force - truth).cwiseAbs() - 1.96 * estimate.force_deviation;
    const double inside =
        (off.middleCols(kEnds, kRows - 2 * kEnds).array() <= 0.0).cast<double>().mean();
    EXPECT_GE(inside, 0.92);
  }
}

// Noise is separated from motion by differences of an order as high as the motion is smooth.
TEST(LearnedDeviations, NoiseIsToldFromAMotionThatBendsBetweenRows) {
  const Scene scene = arm();
  std::vector<VectorX> sparse;
  const Recorded data = recorded(scene, smooth_motion(scene), 1e-4);
  for (std::size_t t = 0; t < data.frames.size(); t += 40) sparse.push_back(data.frames[t]);
  // With rows 80 ms apart, third differences are dominated by the motion, sixth differences by
  // noise.
  const VectorX third = white_noise(scene.model, sparse);
  const VectorX least = white_noise(scene.model, sparse, 6);
  EXPECT_GE(third.minCoeff(), 5e-4);
  EXPECT_LE(least.maxCoeff(), 4e-4);
  EXPECT_TRUE((least.array() <= third.array()).all());
}

}  // namespace
}  // namespace counterpoint::estimation::learned_deviations_test
