// Derivatives of the inverse step of two touching shapes, for every pair and every law, against
// differences.
#include <gtest/gtest.h>

#include "support/two_shapes.h"

namespace counterpoint::contact_derivatives_test {
namespace {

using test::expect_exact;
using test::Moment;
using test::random_moment;
using test::surface;
using test::two_shapes;

struct Law {
  const char* name;
  FrictionModel model;
  Material material;
};
/// With restitution the direction of the friction impulse depends on the motion (contact_law.cc);
/// its derivatives are differences.
bool may_differ(const Material& m) { return m.restitution > 0.0; }
const Law kLaws[] = {
    {"frictionless", FrictionModel::kCoulomb, surface(0.0, 0.0, 0.0, 0.0)},
    {"coulomb", FrictionModel::kCoulomb, surface(0.6, 0.0, 0.0, 0.0)},
    {"coulomb, restitution", FrictionModel::kCoulomb, surface(0.6, 0.5, 0.0, 0.0)},
    {"coulomb, torsion", FrictionModel::kCoulomb, surface(0.6, 0.0, 0.02, 0.0)},
    {"coulomb, rolling", FrictionModel::kCoulomb, surface(0.6, 0.2, 0.02, 0.01)},
    {"convex", FrictionModel::kConvex, surface(0.6, 0.3, 0.0, 0.0)},
    {"convex, rolling", FrictionModel::kConvex, surface(0.6, 0.0, 0.02, 0.01)},
    {"lagged", FrictionModel::kLagged, surface(0.6, 0.0, 0.0, 0.0)},
    {"lagged, rolling", FrictionModel::kLagged, surface(0.6, 0.5, 0.02, 0.01)},
};

using enum ShapeType;

class ShapePair : public ::testing::TestWithParam<std::pair<ShapeType, ShapeType>> {};

TEST_P(ShapePair, OfEveryLaw) {
  const auto [a, b] = GetParam();
  int contacts = 0, doubtful = 0;
  for (const Law& law : kLaws) {
    for (int seed = 0; seed < 6; ++seed) {
      test::Random random(900 + seed);
      Scene scene = two_shapes(a, b, law.material, random, seed % 2 == 0);
      scene.options.contact.friction_model = law.model;
      Moment at = random_moment(scene, random, 0.05);
      Workspace ws(scene.model);
      Inverse out;
      step_inverse(scene.model, scene.options, at.q, at.v, at.v_next, ws, out);
      contacts += static_cast<int>(out.contacts.size());
      // About a thousandth of the speed sqrt(4 r k) over which laws bend, times the time step.
      // Positions in the terrain's frame round more, and there may be no accurate difference step.
      const double step = a == kTerrain ? 1e-7 : 2e-8;
      if (a == kTerrain && !test::is_smooth(scene, at, step)) {
        ++doubtful;
        continue;
      }
      expect_exact(scene, at, std::string(law.name) + " " + std::to_string(seed),
                   may_differ(law.material), step);
    }
  }
  EXPECT_GT(contacts, 9);
  EXPECT_LT(doubtful, 10);  // out of 54
}

/// Default laws, wherever no kink lies within the difference.
TEST_P(ShapePair, OfHardContacts) {
  const auto [a, b] = GetParam();
  int checked = 0;
  for (const Law& law : kLaws) {
    for (int seed = 0; seed < 3; ++seed) {
      test::Random random(950 + seed);
      Scene scene = two_shapes(a, b, law.material, random, seed % 2 == 0);
      scene.options.contact.smoothing = ContactOptions().smoothing;
      scene.options.contact.compliance = ContactOptions().compliance;
      scene.options.contact.friction_model = law.model;
      const Moment at = random_moment(scene, random, 0.05);
      constexpr double kStep = 1e-7;
      if (!test::is_smooth(scene, at, kStep)) continue;
      ++checked;
      expect_exact(scene, at, std::string(law.name) + " " + std::to_string(seed),
                   may_differ(law.material), kStep);
    }
  }
  EXPECT_GT(checked, 15);  // out of 27
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, ShapePair,
    ::testing::Values(
        std::pair(kPlane, kSphere), std::pair(kPlane, kBox), std::pair(kPlane, kCapsule),
        std::pair(kPlane, kCylinder), std::pair(kPlane, kConvexMesh), std::pair(kSphere, kPlane),
        std::pair(kCapsule, kPlane), std::pair(kSphere, kSphere), std::pair(kSphere, kBox),
        std::pair(kSphere, kCapsule), std::pair(kSphere, kCylinder),
        std::pair(kSphere, kConvexMesh), std::pair(kCapsule, kCapsule), std::pair(kBox, kCapsule),
        std::pair(kBox, kBox), std::pair(kBox, kConvexMesh), std::pair(kCapsule, kConvexMesh),
        std::pair(kConvexMesh, kConvexMesh), std::pair(kTerrain, kSphere),
        std::pair(kTerrain, kBox), std::pair(kTerrain, kCapsule), std::pair(kTerrain, kCylinder),
        std::pair(kTerrain, kConvexMesh)));

/// Contacts of bodies so fast that contacts are found at the predicted poses.
class FastPair : public ShapePair {};

TEST_P(FastPair, AtThePosesThatTheMotionLeadsTo) {
  const auto [a, b] = GetParam();
  int ahead = 0, kinks = 0;
  for (const double restitution : {0.0, 0.5}) {
    for (int seed = 0; seed < 30; ++seed) {
      test::Random random(1700 + seed);
      Scene scene = two_shapes(a, b, surface(0.6, restitution, 0.02, 0.01), random, false);
      scene.options.time_step = 5e-3;
      scene.v *= 3.0;
      const Moment at = random_moment(scene, random, 0.05);
      Workspace ws(scene.model);
      Inverse out;
      step_inverse(scene.model, scene.options, at.q, at.v, at.v_next, ws, out);
      const std::vector<Pose> X_WB = body_poses(scene.model, at.q);
      const auto pose_of = [&](int geometry) {
        const Geometry& g = scene.model.geometries()[static_cast<size_t>(geometry)];
        return X_WB[static_cast<size_t>(g.body)] * g.X_BG;
      };
      for (const ContactForce& contact : out.contacts) {
        collision::Manifold here;
        collision::pair_contacts(test::make_shape(a), pose_of(0), test::make_shape(b), pose_of(1),
                                 1.0, here);
        bool known = false;
        for (int i = 0; i < here.size; ++i)
          known = known || (here.points[i].normal - contact.contact.normal).norm() < 1e-6;
        ahead += !known;
      }
      // The choice of contacts at predicted poses jumps.
      if (!test::is_smooth(scene, at, 2e-8)) {
        ++kinks;
        continue;
      }
      expect_exact(scene, at, std::to_string(seed), restitution > 0.0, 2e-8);
    }
  }
  EXPECT_GT(ahead, 9);
  // At most 13 of 60. The two shapes form one free group, whose momentum differences at this step
  // are near rounding; the direction of a bounce jumps with the set of contacts.
  EXPECT_LT(kinks, 14);
}

INSTANTIATE_TEST_SUITE_P(Shapes, FastPair,
                         ::testing::Values(std::pair(kBox, kBox), std::pair(kBox, kCapsule),
                                           std::pair(kSphere, kBox), std::pair(kSphere, kCylinder),
                                           std::pair(kBox, kConvexMesh),
                                           std::pair(kConvexMesh, kConvexMesh)));

}  // namespace
}  // namespace counterpoint::contact_derivatives_test
