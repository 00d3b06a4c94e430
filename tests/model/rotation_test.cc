#include <gtest/gtest.h>

#include <numbers>

#include "counterpoint/model/spatial.h"
#include "support/random_model.h"

namespace counterpoint::rotation_test {
namespace {

constexpr double kRoundoff = 1e-14;

TEST(Rotation, RpyIsFixedAxisRollPitchYaw) {
  const double quarter = std::numbers::pi / 2;
  EXPECT_LT((rotation_from_rpy(quarter, 0, 0) * Vector3::UnitY() - Vector3::UnitZ()).norm(),
            kRoundoff);
  EXPECT_LT((rotation_from_rpy(0, quarter, 0) * Vector3::UnitZ() - Vector3::UnitX()).norm(),
            kRoundoff);
  EXPECT_LT((rotation_from_rpy(0, 0, quarter) * Vector3::UnitX() - Vector3::UnitY()).norm(),
            kRoundoff);
  // Roll comes first, about fixed axes: roll turns y to z, and yaw leaves it there.
  EXPECT_LT((rotation_from_rpy(quarter, 0, 0.7) * Vector3::UnitY() - Vector3::UnitZ()).norm(),
            kRoundoff);
}

TEST(Rotation, ExpAndLogAreInverse) {
  test::Random random(1);
  for (double size : {1e-12, 1e-9, 9.9e-5, 1.1e-4, 1e-2, 1.0, 3.1}) {
    for (int i = 0; i < 20; ++i) {
      const Vector3 r = size * random.unit_vector();
      const Quaternion q = quaternion_exp(r);
      EXPECT_NEAR(q.norm(), 1.0, kRoundoff);
      // Near a half turn, atan2 with a small cosine loses a few more units.
      EXPECT_LT((quaternion_log(q) - r).norm(), 10 * kRoundoff * size);
      const Quaternion minus(-q.w(), -q.x(), -q.y(), -q.z());
      EXPECT_LT((quaternion_log(minus) - r).norm(), 10 * kRoundoff * size) << "same rotation";
    }
  }
  EXPECT_EQ(quaternion_log(quaternion_exp(Vector3::Zero())), Vector3::Zero());
}

TEST(Rotation, ExpMatchesAxisAngle) {
  test::Random random(2);
  for (int i = 0; i < 20; ++i) {
    const Vector3 axis = random.unit_vector();
    const double angle = random.uniform(0, 6);
    const Matrix3 expected = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    EXPECT_LT((quaternion_exp(angle * axis).toRotationMatrix() - expected).norm(), kRoundoff * 10);
  }
}

void expect_rotation(const Matrix3& r) {
  EXPECT_LT((r * r.transpose() - Matrix3::Identity()).norm(), kRoundoff);
  EXPECT_NEAR(r.determinant(), 1.0, kRoundoff);
}

TEST(Rotation, ZToAxis) {
  test::Random random(3);
  for (int i = 0; i < 200; ++i) {
    Vector3 axis = random.unit_vector();
    if (i % 4 == 0) axis = Vector3(1e-9 * axis.x(), 1e-9 * axis.y(), -1).normalized();
    const Matrix3 r = rotation_z_to(axis);
    expect_rotation(r);
    EXPECT_LT((r.col(2) - axis).norm(), kRoundoff);
  }
  EXPECT_EQ(rotation_z_to(Vector3::UnitZ()), Matrix3::Identity());
  for (int i = 0; i < 3; ++i) {
    for (double sign : {-1.0, 1.0}) {
      const Matrix3 r = rotation_z_to(sign * Vector3::Unit(i));
      EXPECT_EQ(r.col(2), sign * Vector3::Unit(i));
      EXPECT_EQ(r.cwiseAbs().sum(), 3.0) << "a signed permutation, free of round-off";
      expect_rotation(r);
    }
  }
}

TEST(Rotation, FrameFromNormal) {
  test::Random random(4);
  for (int i = 0; i < 200; ++i) {
    const Vector3 n = random.unit_vector();
    const Matrix3 r = frame_from_normal(n);
    expect_rotation(r);
    EXPECT_EQ(r.col(2), n);
  }
  expect_rotation(frame_from_normal(-Vector3::UnitZ()));
  EXPECT_EQ(frame_from_normal(Vector3::UnitZ()), Matrix3::Identity());
}

TEST(Rotation, SkewIsTheCrossProduct) {
  const Vector3 a(1, 2, 3);
  const Vector3 b(-4, 5, 0.5);
  EXPECT_EQ(skew(a) * b, a.cross(b));
}

}  // namespace
}  // namespace counterpoint::rotation_test
