// Lengths and moment arms of tendons against closed forms and differences.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/forces/tendons.h"
#include "support/random_model.h"

namespace counterpoint::tendon_lengths_test {
namespace {

constexpr double kRoundoff = 1e-12;
/// Error of differences extrapolated from two steps of 1e-4, relative to lengths of about 1 m.
constexpr double kDifference = 1e-9;

double length_at(const Model& model, int tendon, const VectorX& q) {
  return tendon_length(model, model.tendons()[static_cast<size_t>(tendon)], q,
                       body_poses(model, q));
}

/// Lengths and arms at a configuration.
struct At {
  Tendons tendons;
  Data data;
  At(const Model& model, const VectorX& q) : tendons(model), data(model) {
    compute_poses(model, q, data);
    tendons.find(model, q, data, {});
  }
  VectorX arms(const Model& model, int tendon) const {
    VectorX out = VectorX::Zero(model.nv());
    for (const RowTerm& arm : tendons.arms(tendon)) out[arm.v_index] = arm.coefficient;
    return out;
  }
};

VectorX moved(const Model& model, const VectorX& q, int coordinate, double by) {
  VectorX out = q;
  integrate_configuration(model, q, VectorX::Unit(model.nv(), coordinate), by, out);
  return out;
}

/// Derivative of f(step) at 0, extrapolated from central differences of 1e-4 and 2e-4.
template <class F>
auto derivative(F f) -> decltype(f(0.0)) {
  using Value = decltype(f(0.0));
  constexpr double h = 1e-4;
  const auto central = [&](double step) -> Value { return (f(step) - f(-step)) / (2.0 * step); };
  return (4.0 * central(h) - central(2.0 * h)) / 3.0;
}

TEST(TendonLengths, LengthAroundASphereIsTwoTangentsAndAnArc) {
  const double r = 0.3, s = 0.5;
  for (const double angle : {1.9, 2.5, 3.0}) {
    const Vector3 a(s, 0, 0), b(s * std::cos(angle), s * std::sin(angle), 0);
    TendonWrap sphere;
    sphere.radius = r;
    const double tangents = 2.0 * std::sqrt(s * s - r * r), alpha = std::acos(r / s);
    const auto length = [&] {
      return wrapped_length(sphere, Matrix3::Identity(), a, b, false).length;
    };
    EXPECT_NEAR(length(), tangents + r * (angle - 2.0 * alpha), kRoundoff);
    sphere.side = Vector3(std::cos(0.5 * angle), std::sin(0.5 * angle), 0);
    EXPECT_NEAR(length(), tangents + r * (angle - 2.0 * alpha), kRoundoff);
    sphere.side = Vector3(-*sphere.side);
    EXPECT_NEAR(length(), tangents + r * (2.0 * M_PI - angle - 2.0 * alpha), kRoundoff);
  }
}

TEST(TendonLengths, LengthAroundACylinderIsThatOfItsUnrolledPath) {
  const double r = 0.2, s = 0.4, z = 0.7, angle = 2.8;
  const Matrix3 R = Quaternion(0.3, 0.5, -0.2, 0.7).normalized().toRotationMatrix();
  TendonWrap cylinder;
  cylinder.cylinder = true;
  cylinder.radius = r;
  const Vector3 a = R * Vector3(s, 0, 0.1);
  const Vector3 b = R * Vector3(s * std::cos(angle), s * std::sin(angle), 0.1 + z);
  const double flat = 2.0 * std::sqrt(s * s - r * r) + r * (angle - 2.0 * std::acos(r / s));
  EXPECT_NEAR(wrapped_length(cylinder, R, a, b, false).length, std::hypot(flat, z), kRoundoff);
}

/// The path bends continuously: where it begins to touch, length and gradient are those of the
/// straight line, to the first order of the depth.
TEST(TendonLengths, AWrapBeginsWithTheStraightLine) {
  TendonWrap sphere;
  sphere.radius = 0.3;
  const double depth = 1e-9;
  const Vector3 a(-0.5, 0.3 - depth, 0), b(0.7, 0.3 - depth, 0);
  const SegmentLength bent = wrapped_length(sphere, Matrix3::Identity(), a, b, false);
  const SegmentLength straight = straight_length(a, b, false);
  EXPECT_NEAR(bent.length, straight.length, 10.0 * depth);
  EXPECT_LT((bent.by_a - straight.by_a).norm(), 10.0 * depth / 0.3);
}

/// A path along a straight line that touches a cylinder is as long as the line, however rounding
/// places the ends: neither around the far side nor with a full turn.
TEST(TendonLengths, ALineThatTouchesStaysStraight) {
  TendonWrap cylinder;
  cylinder.cylinder = true;
  cylinder.radius = 0.0025;
  cylinder.side = Vector3(-0.002, 0.0025, 0.0);
  const Vector3 a(0.015, 0.0025, 0.0), b(-0.002, 0.0025, 0.0);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    const Quaternion turn(normal(random), normal(random), normal(random), normal(random));
    const Matrix3 R = turn.normalized().toRotationMatrix();
    const double length = wrapped_length(cylinder, R, R * a, R * b, false).length;
    // Ends off the line by rounding make an arc of that size, up to 1e-9 rad here.
    ASSERT_NEAR(length, 0.017, 1e-9 * cylinder.radius) << i;
  }
}

/// Paths over every kind of joint, around spheres and cylinders, over pulleys. Where a path begins
/// to touch within the difference, its second derivative jumps: such rare tendons are left out by
/// comparing both step widths.
TEST(TendonLengths, ArmsAndCurvaturesAreTheDerivativesOfLengthsAndArms) {
  int spatial = 0, compared = 0, wrapped = 0;
  for (int seed = 0; seed < 60; ++seed) {
    test::RandomModelOptions o = test::varied_options(seed);
    o.links = 3 + seed % 5;
    o.fixed_share = 0.0;
    o.tendons = 6;
    const Model model = test::make_random_model(seed, o);
    const VectorX q = test::random_configuration(model, 40 + seed);
    const At at(model, q);
    TendonCurvature curvature;
    for (int t = 0; t < static_cast<int>(model.tendons().size()); ++t) {
      const Tendon& tendon = model.tendons()[static_cast<size_t>(t)];
      EXPECT_NEAR(at.tendons.length(t), length_at(model, t, q), kRoundoff);
      const VectorX arms = at.arms(model, t);
      for (int k = 0; k < model.nv(); ++k) {
        const double by_k =
            derivative([&](double s) { return length_at(model, t, moved(model, q, k, s)); });
        ASSERT_NEAR(arms[k], by_k, kDifference) << seed << " tendon " << t << " coordinate " << k;
      }
      if (!tendon.is_spatial()) continue;
      ++spatial;
      for (const TendonSegment& segment : tendon.path)
        if (segment.wrap >= 0) ++wrapped;
      at.tendons.find_curvature(model, t, at.data, curvature);
      const std::span<const RowTerm> terms = at.tendons.arms(t);
      for (size_t j = 0; j < terms.size(); ++j) {
        const VectorX by_j = derivative([&](double s) -> VectorX {
          return At(model, moved(model, q, terms[j].v_index, s)).arms(model, t);
        });
        for (size_t i = 0; i < terms.size(); ++i) {
          const auto entry = curvature(static_cast<int>(i), static_cast<int>(j));
          ASSERT_NEAR(entry, by_j[terms[i].v_index], 1e-8 * (1.0 + std::abs(entry)))
              << seed << " tendon " << t << " arm " << i << " by " << j;
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(spatial, 100);
  EXPECT_GT(wrapped, 60);
  EXPECT_GT(compared, 2000);
}

/// The public API returns the same.
TEST(TendonLengths, DynamicsReturnsThem) {
  test::RandomModelOptions o;
  o.fixed_share = 0.0;
  o.tendons = 4;
  const Model model = test::make_random_model(2, o);
  const VectorX q = test::random_configuration(model, 5);
  Dynamics dynamics(model);
  dynamics.set_configuration(q);
  const At at(model, q);
  VectorX arms(model.nv());
  for (int t = 0; t < 4; ++t) {
    EXPECT_EQ(dynamics.tendon_length(t), at.tendons.length(t));
    dynamics.tendon_arms(t, arms);
    EXPECT_EQ(arms, at.arms(model, t));
  }
}

}  // namespace
}  // namespace counterpoint::tendon_lengths_test
