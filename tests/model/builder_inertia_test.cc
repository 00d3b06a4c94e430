// Inertias that the builder accepts or rejects, and known mass matrices.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "counterpoint/model/model.h"
#include "counterpoint/model/model_builder.h"
#include "support/arm_spec.h"
#include "support/random_model.h"

namespace counterpoint::builder_inertia_test {
namespace {

using test::build;
using test::expect_refused;
using test::make_arm;

// Sums and products of numbers of order one: a few units of round-off.
constexpr double kRoundoff = 1e-13;

TEST(BuilderInertia, RefusesMotionWithoutInertia) {
  RobotSpec robot = make_arm();
  robot.links[2].inertia = SpatialInertia();
  expect_refused(robot, {"elbow", "lower", "armature"});
  robot.joints[1].armature = 0.01;
  EXPECT_NO_THROW(build(robot));
  // A massless base may be fixed, but may float only if the arm provides the inertia.
  robot = make_arm();
  robot.links[0].inertia = SpatialInertia();
  EXPECT_NO_THROW(build(robot, Base::kFixed));
  RobotSpec plane;
  plane.links = {LinkSpec()};
  plane.links[0].name = "planeLink";
  EXPECT_NO_THROW(build(plane, Base::kFixed));
  expect_refused(plane, {"planeLink", "floating", "fixed base"}, Base::kFloating);
  // A point mass on the joint axis has no inertia about it, for any direction of the axis.
  robot = make_arm();
  robot.links[2].inertia.rotational.setZero();
  robot.joints[1].axis = Vector3(1, 1, 0).normalized();
  robot.links[2].inertia.center = 0.3 * robot.joints[1].axis;
  expect_refused(robot, {"elbow"});
  robot.links[2].inertia.center += Vector3(0, 0, 1e-3);
  EXPECT_NO_THROW(build(robot));
}

TEST(BuilderInertia, MasslessCrossOfAUniversalJointIsFine) {
  RobotSpec robot = make_arm();
  robot.links[1].inertia = SpatialInertia();
  robot.joints[1].axis = Vector3::UnitY();
  EXPECT_NO_THROW(build(robot));
  robot.joints[1].axis = Vector3::UnitX();  // equal axes: one of the two motions has no inertia
  expect_refused(robot, {"shoulder"});
}

TEST(BuilderInertia, NotesWhatNoBodyCanHave) {
  RobotSpec robot = make_arm();
  robot.links[2].inertia.rotational = Vector3(1, 1, 3).asDiagonal();
  const Model model = build(robot);
  ASSERT_EQ(model.notes().size(), 1u);
  EXPECT_NE(model.notes()[0].where.find("lower"), std::string::npos);
  EXPECT_NE(model.notes()[0].message.find("triangle"), std::string::npos);
  robot.links[2].inertia.rotational = Vector3(-1, 1, 1).asDiagonal();
  expect_refused(robot, {"elbow", "lower", "repair_inertias"});
}

TEST(Inertia, NearestPhysicalIsPhysicalAndLeavesGoodOnesAlone) {
  test::Random random(5);
  for (int i = 0; i < 100; ++i) {
    SpatialInertia inertia = test::random_inertia(random);
    EXPECT_EQ(inertia_defect(inertia), "");
    EXPECT_LT((nearest_physical(inertia).rotational - inertia.rotational).norm(), kRoundoff);
    const Matrix3 r = random.quaternion().toRotationMatrix();
    inertia.rotational = r * random.vector(1.0).asDiagonal() * r.transpose();
    const Vector3 m =
        nearest_physical(inertia).rotational.selfadjointView<Eigen::Lower>().eigenvalues();
    EXPECT_GE(m[0], -kRoundoff);
    EXPECT_GE(m[0] + m[1] - m[2], -kRoundoff);
  }
}

TEST(Inertia, ReferenceMassMatrixOfADoublePendulum) {
  // Two bars, relative q: the textbook mass matrix with c = cos(q2).
  RobotSpec robot = make_arm();
  for (int i : {1, 2}) {
    robot.links[i].inertia.center = {0, 0, -0.5};
    robot.joints[i - 1].axis = Vector3::UnitY();
  }
  robot.joints[1].X_PJ.translation = {0, 0, -1};
  robot.joints[0].armature = 0.5;
  const Model model = build(robot);
  VectorX q(2);
  q << 0.3, 0.7;
  const double c = std::cos(0.7);
  const double m22 = 0.25 + 0.1;
  const double m12 = m22 + 0.5 * c;
  const double m11 = 0.35 + 1.0 + 0.25 + c + 0.1 + 0.5;
  const MatrixX mass = reference_mass_matrix(model, 0, q);
  EXPECT_NEAR(mass(0, 0), m11, kRoundoff);
  EXPECT_NEAR(mass(0, 1), m12, kRoundoff);
  EXPECT_NEAR(mass(1, 0), m12, kRoundoff);
  EXPECT_NEAR(mass(1, 1), m22, kRoundoff);
}

TEST(Inertia, RandomModelsHaveDefiniteMassMatrices) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Model model = test::make_random_model(seed);
    const MatrixX mass = reference_mass_matrix(model, 0, test::random_configuration(model, seed));
    EXPECT_LT((mass - mass.transpose()).norm(), kRoundoff * mass.norm());
    EXPECT_EQ(Eigen::LLT<MatrixX>(mass).info(), Eigen::Success);
  }
}

}  // namespace
}  // namespace counterpoint::builder_inertia_test
