// Forces at a distance, due to smoothing, fade out continuously where constraints appear and
// vanish.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/derivatives.h"
#include "support/small_scenes.h"

namespace counterpoint::faded_smoothing_test {
namespace {

constexpr double kSmooth = 0.05;  ///< [m]; the weight is carried from this distance

/// Normal and friction force [N] on a ball of 1 kg at a height above the ground with this velocity.
Vector3 force_at(const Scene& scene, double gap, const Vector3& velocity) {
  VectorX q = scene.q, v = VectorX::Zero(scene.model.nv());
  q[2] += gap;
  v.head<3>() = velocity;
  Workspace workspace(scene.model);
  Inverse inverse;
  step_inverse(scene.model, scene.options, q, v, v, workspace, inverse);
  return inverse.contact_force.head<3>();
}

Scene soft_ball() {
  test::BallOnPlane ball;
  ball.material.friction = 0.8;
  Scene scene = test::ball_on_plane(ball);
  scene.options.time_step = 0.02;
  scene.options.contact.smoothing = kSmooth;
  scene.options.contact.compliance = 0.5;
  scene.options.contact.margin = 0.1;
  scene.options.contact.reach_acceleration = 1e9;
  return scene;
}

// The friction law changes at the margin, and contacts end beyond it; neither may cause a jump.
// Without fading, smoothing of 0.05 m g at 0.1 m would give 5 N.
TEST(FadedSmoothing, NothingJumpsAtTheMargin) {
  const Scene scene = soft_ball();
  const double margin = scene.options.contact.margin;
  // The force is 10 N k / gap (1 - s^2)^2: a relative 4e-8 at 1 um inside the margin.
  for (const Vector3& velocity : {Vector3(0, 0, 0), Vector3(0.5, 0, 0), Vector3(0.5, 0.2, -0.3)}) {
    const Vector3 inside = force_at(scene, margin - 1e-6, velocity);
    const Vector3 outside = force_at(scene, margin + 1e-6, velocity);
    EXPECT_LT(inside.norm(), 1e-6) << velocity.transpose();
    EXPECT_LT(outside.norm(), 1e-6) << velocity.transpose();
  }
  EXPECT_GT(force_at(scene, 0.5 * margin, Vector3::Zero()).z(), 1.0);
}

TEST(FadedSmoothing, NothingJumpsWhereLimitsBegin) {
  test::Pendulum parameters;
  parameters.lower = -1.0;
  Scene scene = test::pendulum(parameters);
  scene.options.contact.smoothing = kSmooth;
  scene.options.contact.compliance = 0.5;
  Workspace workspace(scene.model);
  Inverse inverse;
  const VectorX rest = VectorX::Zero(1);
  const auto force = [&](double from_limit) {
    step_inverse(scene.model, scene.options, VectorX::Constant(1, from_limit - 1.0), rest, rest,
                 workspace, inverse);
    return inverse.contact_force[0];
  };
  EXPECT_LT(std::abs(force(kLimitReach - 1e-6)), 1e-6);
  EXPECT_EQ(force(kLimitReach + 1e-6), 0.0);
  EXPECT_GT(force(0.3 * kLimitReach), 1.0);
}

TEST(FadedSmoothing, SlopeIsTheDerivative) {
  constexpr double kStep = 1e-6;  // error: kStep^2 times the third derivative, 24 / reach^3
  for (const double gap : {-0.01, 0.01, 0.05, 0.099, 0.12}) {
    const Fading fading{0.1};
    const double difference = (faded_smoothing(kSmooth, gap + kStep, fading) -
                               faded_smoothing(kSmooth, gap - kStep, fading)) /
                              (2.0 * kStep);
    EXPECT_NEAR(faded_smoothing_slope(kSmooth, gap, fading), difference, 1e-7) << gap;
  }
}

// The last part of the smoothing of open contacts fades within a micrometre.
TEST(FadedSmoothing, OfOpenContactsIsTheLeast) {
  const Fading fading{0.1, kOpenSmoothing};
  EXPECT_EQ(faded_smoothing(kHardSmoothing, 0.0, fading), kHardSmoothing);
  EXPECT_EQ(faded_smoothing(kHardSmoothing, kOpenGap, fading), kOpenSmoothing);
  EXPECT_EQ(faded_smoothing(0.0, kOpenGap, fading), 0.0);
  constexpr double kStep = 1e-10;  // error: (kStep / kOpenGap)^2 of a slope of 1e-7
  for (const double gap : {-1e-7, 2e-7, 8e-7, 2e-6}) {
    const auto at = [&](double g) { return faded_smoothing(kHardSmoothing, g, fading); };
    const double difference = (at(gap + kStep) - at(gap - kStep)) / (2.0 * kStep);
    EXPECT_NEAR(faded_smoothing_slope(kHardSmoothing, gap, fading), difference, 1e-13) << gap;
    constexpr double kLonger = 1.01 * kHardSmoothing, kShorter = 0.99 * kHardSmoothing;
    const double by_length =
        (faded_smoothing(kHardSmoothing, gap, fading) - faded_smoothing(kShorter, gap, fading)) /
        (kHardSmoothing - kShorter);
    EXPECT_NEAR(faded_smoothing_share(kShorter, gap, fading), by_length, 1e-9) << gap;
    EXPECT_GE(faded_smoothing(kLonger, gap, fading), faded_smoothing(kHardSmoothing, gap, fading));
  }
}

// Fading up to a reach does not affect hard smoothing.
TEST(FadedSmoothing, HardContactsAreAsTheyWere) {
  for (const double gap : {-1e-3, 0.0, 1e-9, 5e-3, 0.02})
    EXPECT_EQ(faded_smoothing(kHardSmoothing, gap, {0.01}), kHardSmoothing) << gap;
}

TEST(FadedSmoothing, DerivativesOfForcesAtADistance) {
  const Scene scene = soft_ball();
  const int nv = scene.model.nv();
  Workspace workspace(scene.model);
  Inverse inverse;
  InverseDerivatives exact, reference;
  for (const double gap : {0.01, 0.05, 0.09}) {
    VectorX q = scene.q, v = VectorX::Zero(nv), w = VectorX::Zero(nv);
    q[2] += gap;
    v << 0.3, 0.1, -0.2, 0.1, 0.2, 0.3;
    w << 0.2, 0.2, 0.1, 0.3, 0.1, 0.2;
    step_inverse_derivatives(scene.model, scene.options, q, v, w, Input(), workspace, inverse,
                             exact);
    step_inverse_derivatives(scene.model, scene.options, q, v, w, Input(), workspace, inverse,
                             reference, DerivativeMethod::kExtrapolated);
    EXPECT_FALSE(exact.by_differences);
    const double scale = reference.dq.cwiseAbs().maxCoeff();
    // Extrapolated differences are accurate to 1e-9 of the largest entry.
    EXPECT_LT((exact.dq - reference.dq).cwiseAbs().maxCoeff(), 1e-7 * scale) << gap;
    EXPECT_GT(scale, 1.0) << gap;
  }
}

}  // namespace
}  // namespace counterpoint::faded_smoothing_test
