// A motion estimated row by row as the rows arrive, against the estimate of the whole recording.
#include "counterpoint/engine/estimate/motion_follower.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "estimate/column_maps.h"
#include "support/paths.h"

namespace counterpoint::estimation::motion_follower_test {
namespace {

constexpr double kNoise = 1e-3;  ///< standard deviation of positions [m, rad]

Scene quadruped() {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/quadruped_drop.yaml");
  scene.options.effects.set(Effect::kSleeping, false);
  return scene;
}

/// Records a quadruped dropped under random torques, 100 noisy rows per second.
Recording noisy_drop(const Scene& scene, int rows) {
  Simulator simulator(scene);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Recording out;
  out.file = "simulated";
  out.q.resize(scene.model.nq(), rows);
  out.v = MatrixX::Zero(scene.model.nv(), rows);
  out.applied_force = out.v;
  VectorX& force = simulator.input().applied_force;
  force = VectorX::Zero(scene.model.nv());
  VectorX by(scene.model.nv()), q(scene.model.nq());
  for (int row = 0; row < rows; ++row) {
    out.time.push_back(simulator.state().time);
    for (double& x : by) x = kNoise * normal(random);
    integrate_configuration(scene.model, simulator.state().q, by, 1.0, q);
    out.q.col(row) = q;
    for (int k = 0; k < 5; ++k) {
      for (int i = 6; i < scene.model.nv(); ++i) force[i] = 0.3 * normal(random);
      EXPECT_TRUE(simulator.step().succeeded());
    }
  }
  return out;
}

FollowOptions follow_options(const Model& model) {
  FollowOptions options;
  options.errors = RecordingErrors::kWhite;
  ContactSum& all = options.sums.emplace_back();
  all.name = "all";
  for (int b = 1; b < model.num_bodies(); ++b) all.bodies.push_back(b);
  return options;
}

/// All rows that a follower returns.
struct Followed {
  std::vector<double> time, support;
  MatrixX q;
  std::vector<std::size_t> told_by_push;
};

void take(const MotionEstimate& rows, Followed& out) {
  for (std::size_t i = 0; i < rows.time.size(); ++i) {
    out.time.push_back(rows.time[i]);
    out.support.push_back(rows.sum_force(2, static_cast<Eigen::Index>(i)));
    out.q.conservativeResize(rows.q.rows(), out.q.cols() + 1);
    out.q.rightCols(1) = rows.q.col(static_cast<Eigen::Index>(i));
  }
}

Followed follow(const Scene& scene, const Recording& recording, const FollowOptions& options) {
  MotionFollower follower(scene, test::all_positions(scene.model), options);
  Followed out;
  for (int row = 0; row < recording.num_rows(); ++row) {
    const MotionEstimate rows =
        follower.push(recording.time[static_cast<std::size_t>(row)], recording.q.col(row));
    out.told_by_push.push_back(rows.time.size());
    take(rows, out);
  }
  take(follower.finish(), out);
  return out;
}

// The follower takes two Gauss-Newton steps per row, with a law ten times softer than the last
// stage of the whole recording. Difference of the vertical force from the whole recording's: median
// 0.05 weights (measured 0.017), rms 1 weight (measured 0.66) including an impact of 13 weights.
TEST(MotionFollower, ForcesAreNearThoseOfTheWholeRecording) {
  const Scene scene = quadruped();
  const Recording recording = noisy_drop(scene, 100);
  const FollowOptions options = follow_options(scene.model);
  const Followed rows = follow(scene, recording, options);
  MotionEstimateOptions whole_options;
  whole_options.sums = options.sums;
  whole_options.errors = RecordingErrors::kWhite;
  const MotionEstimate whole =
      estimate_motion(scene, test::all_positions(scene.model), recording, whole_options);
  double weight = 0.0, square = 0.0;
  for (const Body& body : scene.model.bodies()) weight += 9.80665 * body.inertia.mass;
  ASSERT_EQ(rows.time, recording.time);  // every row once and in order
  std::vector<double> off;
  for (std::size_t t = 10; t + 1 < rows.time.size(); ++t) {
    off.push_back(std::abs(rows.support[t] - whole.sum_force(2, static_cast<Eigen::Index>(t))) /
                  weight);
    square += off.back() * off.back();
  }
  EXPECT_LT(std::sqrt(square / static_cast<double>(off.size())), 1.0);
  EXPECT_LT(median(off), 0.05);
}

// After the first rows, each push returns one row, `lag` (ten) rows after it arrived.
TEST(MotionFollower, EachRowIsToldOnceItIsOldEnough) {
  const Scene scene = quadruped();
  const Recording recording = noisy_drop(scene, 60);
  const FollowOptions options = follow_options(scene.model);
  const Followed rows = follow(scene, recording, options);
  for (int row = 0; row < 60; ++row) {
    const std::size_t expected = row + 1 < kFollowedRows    ? 0
                                 : row + 1 == kFollowedRows ? kFollowedRows - options.lag
                                                            : 1;
    EXPECT_EQ(rows.told_by_push[static_cast<std::size_t>(row)], expected) << "row " << row;
  }
}

TEST(MotionFollower, ThreadsDoNotChangeABit) {
  const Scene scene = quadruped();
  const Recording recording = noisy_drop(scene, 60);
  FollowOptions options = follow_options(scene.model);
  const Followed one = follow(scene, recording, options);
  options.threads = 3;
  EXPECT_EQ((follow(scene, recording, options).q - one.q).cwiseAbs().maxCoeff(), 0.0);
}

// A missing row and a row with an unmeasured joint are filled in, within 10 standard deviations of
// the noise. The joint is in the air, determined only by torques near zero and by the neighbouring
// rows.
TEST(MotionFollower, GapsAreFilled) {
  const Scene scene = quadruped();
  const Recording recording = noisy_drop(scene, 70);
  MotionFollower follower(scene, test::all_positions(scene.model), follow_options(scene.model));
  Followed out;
  for (int row = 0; row < 70; ++row) {
    if (row == 55) continue;
    VectorX q = recording.q.col(row);
    if (row == 60) q[10] = std::numeric_limits<double>::quiet_NaN();
    take(follower.push(recording.time[static_cast<std::size_t>(row)], q), out);
  }
  take(follower.finish(), out);
  ASSERT_EQ(out.time.size(), 70u);
  EXPECT_NEAR(out.time[55], recording.time[55], 1e-9);
  ASSERT_TRUE(out.q.allFinite());
  for (const int row : {55, 60})
    EXPECT_LT((out.q.col(row) - recording.q.col(row)).cwiseAbs().maxCoeff(), 10.0 * kNoise)
        << "row " << row;
}

// A gap longer than the window ends the motion, and a new one begins.
TEST(MotionFollower, LongGapsBeginAnew) {
  const Scene scene = quadruped();
  const Recording recording = noisy_drop(scene, 60);
  MotionFollower follower(scene, test::all_positions(scene.model), follow_options(scene.model));
  Followed out;
  for (const double later : {0.0, 100.0})
    for (int row = 0; row < 60; ++row)
      take(follower.push(later + recording.time[static_cast<std::size_t>(row)],
                         recording.q.col(row)),
           out);
  take(follower.finish(), out);
  ASSERT_EQ(out.time.size(), 120u);
  EXPECT_NEAR(out.time[60], 100.0, 1e-9);
}

TEST(MotionFollower, WrongRowsAreRefused) {
  const Scene scene = quadruped();
  const ColumnMap map = test::all_positions(scene.model);
  FollowOptions options;
  options.lag = options.window = 10;
  EXPECT_THROW(MotionFollower(scene, map, options), InputError);
  EXPECT_THROW(MotionFollower(scene, ColumnMap(), {}), InputError);
  MotionFollower follower(scene, map);
  follower.push(0.0, scene.q);
  EXPECT_THROW(follower.push(0.0, scene.q), InputError);
  EXPECT_THROW(follower.push(1.0, VectorX::Zero(3)), InputError);
  EXPECT_TRUE(follower.finish().time.empty());
}

}  // namespace
}  // namespace counterpoint::estimation::motion_follower_test
