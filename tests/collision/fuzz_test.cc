// Random and degenerate hulls against one another and all shapes: finite and certified results, no
// crash.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/model/spatial.h"
#include "support/random_poses.h"
#include "support/shape_reference.h"

namespace counterpoint::test::fuzz_test {
namespace {

using collision::pair_contacts;

enum Cloud { kRound, kLattice, kPlate, kNeedle, kClustered, kFarFromOrigin, kNearlyCoplanar };
constexpr int kClouds = 7;

Vector3 lattice_point(std::mt19937& rng) {
  std::uniform_int_distribution<int> at(-1, 1);
  const double x = at(rng);
  const double y = at(rng);
  return 0.3 * Vector3(x, y, at(rng));
}

std::vector<Vector3> cloud(std::mt19937& rng, int kind) {
  const int size = std::uniform_int_distribution<int>(4, 40)(rng);
  std::vector<Vector3> points;
  for (int i = 0; i < size; ++i) {
    const Vector3 p = 0.4 * random_unit(rng);
    switch (kind) {
      case kRound:
        points.push_back(p);
        break;
      case kLattice:
        points.push_back(lattice_point(rng));
        break;
      case kPlate:
        points.push_back(p.cwiseProduct(Vector3(1, 1, 1e-5)));
        break;
      case kNeedle:
        points.push_back(p.cwiseProduct(Vector3(1, 1e-4, 1e-4)));
        break;
      case kClustered:
        points.push_back(lattice_point(rng) + 1e-7 * p);
        break;
      case kFarFromOrigin:
        points.push_back(p + Vector3(100, -200, 50));
        break;
      default:
        points.push_back(lattice_point(rng) + 1e-5 * p);
        break;
    }
  }
  return points;
}

// Half lengths of very different size, including zero.
double awkward_length(std::mt19937& rng) {
  constexpr double kLengths[] = {0.0, 1e-9, 1e-4, 0.05, 0.3, 0.3, 0.5};
  return kLengths[std::uniform_int_distribution<int>(0, 6)(rng)];
}

Shape awkward_shape(std::mt19937& rng) {
  const int kind = std::uniform_int_distribution<int>(0, kClouds + 7)(rng);
  const double x = awkward_length(rng);
  const double y = awkward_length(rng);
  const double z = awkward_length(rng);
  switch (kind - kClouds) {
    case 0:
      return sphere_shape(x);
    case 1:
    case 2:
      return box_shape({x, y, z});
    case 3:
      return capsule_shape(x, y);
    case 4:
    case 5:
    case 6:
      return cylinder_shape(x, y);
    case 7:
      return plane_shape();
    default:
      break;
  }
  while (true) {
    try {
      return hull_shape(cloud(rng, kind));
    } catch (const InputError&) {
      // A point cloud that is flat by chance is rejected.
    }
  }
}

Vector3 center(const Shape& shape) {
  return shape.mesh ? shape.mesh->interior_point : Vector3(Vector3::Zero());
}

Matrix3 awkward_rotation(std::mt19937& rng) {
  const int kind = std::uniform_int_distribution<int>(0, 4)(rng);
  if (kind == 0) return random_rotation(rng);
  if (kind == 1) return Matrix3::Identity();
  const int axis = std::uniform_int_distribution<int>(0, 2)(rng);
  const double quarters = std::uniform_int_distribution<int>(0, 3)(rng);
  const double slip = kind == 2 ? 0.0 : kind == 3 ? 1e-9 : 1e-4;
  return Matrix3(Eigen::AngleAxisd(quarters * std::acos(0.0), Vector3::Unit(axis))) *
         quaternion_exp(slip * random_unit(rng)).toRotationMatrix();
}

// Largest coordinate of the pair [m], scales the tolerances.
double scale(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B) {
  const auto reach = [](const Shape& s) {
    if (s.type == ShapeType::kPlane) return 0.0;
    return s.mesh ? s.mesh->radius + s.mesh->interior_point.norm() : s.size.sum();
  };
  return reach(a) + reach(b) + (X_B.translation - X_A.translation).norm();
}

double core_radius(const Shape& shape) {
  const bool round = shape.type == ShapeType::kSphere || shape.type == ShapeType::kCapsule;
  return round ? shape.size[0] : 0.0;
}

// Largest height of vertices above face planes [m]; hulls with merged faces are convex only to
// this.
double defect(const Shape& shape) {
  double most = 0.0;
  if (!shape.mesh) return most;
  for (std::size_t f = 0; f < shape.mesh->faces.size(); ++f) {
    for (const Vector3& v : shape.mesh->vertices) {
      most = std::max(most, shape.mesh->face_normals[f].dot(v) - shape.mesh->face_offsets[f]);
    }
  }
  return most;
}

void expect_sound(const Manifold& m, const std::string& what) {
  for (int k = 0; k < m.size; ++k) {
    EXPECT_TRUE(m.points[k].position.allFinite()) << what;
    EXPECT_NEAR(m.points[k].normal.norm(), 1.0, 1e-13) << what;
    EXPECT_TRUE(std::isfinite(m.points[k].gap)) << what;
  }
}

TEST(Fuzz, AwkwardShapesOnAwkwardPoses) {
  // Gaps within 1e-10 of the size count as equal; hulls far from the origin of their frame lose
  // digits in proportion (0.4 m at 200 m), which `scale` accounts for. On hulls that are not quite
  // convex the search for the farthest vertex may miss it by a few defects.
  constexpr double kGapError = 1e-9;
  constexpr double kRoundOff = 1e-15;  // round-off of the 0.1 m displacement below
  std::mt19937 rng(2024);
  int separated = 0;
  int overlapping = 0;
  for (int i = 0; i < 10000; ++i) {
    const Shape a = awkward_shape(rng);
    const Shape b = awkward_shape(rng);
    if (a.type == ShapeType::kPlane && b.type == ShapeType::kPlane) continue;
    const std::string what = "sample " + std::to_string(i);
    Pose X_A{awkward_rotation(rng), Vector3::Zero()};
    Pose X_B{awkward_rotation(rng), Vector3::Zero()};
    // Centres coincide, lie on a grid, or lie anywhere.
    const int place = i % 3;
    const Vector3 apart = place == 0   ? Vector3(Vector3::Zero())
                          : place == 1 ? Vector3(lattice_point(rng) * 2.0)
                                       : random_vector(rng, 0.8);
    X_A.translation = -(X_A.rotation * center(a));
    X_B.translation = apart - X_B.rotation * center(b);
    Manifold m;
    pair_contacts(a, X_A, b, X_B, 10.0, m);
    if (a.type != ShapeType::kPlane && b.type != ShapeType::kPlane) {
      ASSERT_GT(m.size, 0) << what;
    }
    expect_sound(m, what);
    if (m.size == 0) continue;
    const ContactPoint least = deepest(m);
    const double size = scale(a, X_A, b, X_B);
    const double error = kGapError * size + 4.0 * (defect(a) + defect(b)) + kRoundOff;
    (least.gap < 0.0 ? overlapping : separated) += 1;
    if (a.type == ShapeType::kPlane || b.type == ShapeType::kPlane) continue;
    // The direction between almost touching points (of the cores, inside the rounding of a capsule)
    // is only as good as round-off over their distance; the size of the shapes acts as lever arm.
    const double core_gap = least.gap + core_radius(a) + core_radius(b);
    const double turned = core_gap > 0.0 ? 1e-15 * size * size / core_gap : 0.0;
    EXPECT_NEAR(distance_along(a, X_A, b, X_B, least.normal), least.gap, error + turned)
        << what << " types " << int(a.type) << " " << int(b.type);
    // Separates the shapes along the normal to a gap of 0.1 m.
    Pose X_free = X_B;
    X_free.translation += (0.1 - least.gap) * least.normal;
    pair_contacts(a, X_A, b, X_free, 10.0, m);
    EXPECT_GE(deepest(m).gap, 0.1 - error - turned) << what;
  }
  EXPECT_GT(separated, 2500);
  EXPECT_GT(overlapping, 2500);
}

// Points of discs and needles thinner than the accuracy of merged face planes, where hill climbing
// over vertices sometimes stops early. Wide hulls are placed side by side or anywhere.
std::vector<Vector3> thin_cloud(std::mt19937& rng) {
  const int size = std::uniform_int_distribution<int>(30, 300)(rng);
  const double thin = std::pow(10.0, std::uniform_real_distribution<double>(-6.5, -3.0)(rng));
  const double width = std::uniform_int_distribution<int>(0, 2)(rng) == 0 ? thin : 1.0;
  const bool disc = std::uniform_int_distribution<int>(0, 1)(rng) == 0;
  std::vector<Vector3> points;
  for (int i = 0; i < size; ++i) {
    Vector3 p = random_unit(rng);
    if (disc) p = Vector3(p.x(), p.y(), 0.0).normalized() + (i % 2 ? 1.0 : -1.0) * Vector3::UnitZ();
    points.push_back(0.4 * p.cwiseProduct(Vector3(1.0, width, thin)));
  }
  return points;
}

// A margin above the gap finds the contact and one below it does not, for hulls of any thickness.
// The gap is known from a search with a large margin.
TEST(Fuzz, TheMarginMissesNoContactOfThinHulls) {
  std::mt19937 rng(31);
  constexpr double kGapError = 1e-9;  // see AwkwardShapesOnAwkwardPoses
  int checked = 0;
  for (int i = 0; i < 400; ++i) {
    Shape shapes[2];
    for (Shape& shape : shapes) {
      while (!shape.mesh) {
        try {
          shape = hull_shape(thin_cloud(rng));
        } catch (const InputError&) {
        }
      }
    }
    const Pose X_A{random_rotation(rng), Vector3::Zero()};
    Pose X_B{random_rotation(rng), random_vector(rng, 0.3)};
    if (i % 2 == 1) {
      const double above = std::pow(10.0, std::uniform_real_distribution<double>(-5.0, -1.0)(rng));
      X_B.rotation = X_A.rotation * quaternion_exp(1e-3 * random_unit(rng)).toRotationMatrix();
      X_B.translation = X_A.rotation * Vector3(0.1, 0.2, above);
    }
    Manifold m;
    pair_contacts(shapes[0], X_A, shapes[1], X_B, 10.0, m);
    ASSERT_GT(m.size, 0);
    const double gap = deepest(m).gap;
    if (gap <= 0.0) continue;
    const double error = kGapError * scale(shapes[0], X_A, shapes[1], X_B) +
                         4.0 * (defect(shapes[0]) + defect(shapes[1]));
    for (const double more : {2.0 * error, 1e-3, 0.1}) {
      pair_contacts(shapes[0], X_A, shapes[1], X_B, gap + more, m);
      EXPECT_GT(m.size, 0) << "sample " << i << ", gap " << gap << ", margin " << more
                           << " above it";
      if (m.size == 0) continue;
      EXPECT_NEAR(deepest(m).gap, gap, error) << "sample " << i;
    }
    if (gap > 2.0 * error) {
      pair_contacts(shapes[0], X_A, shapes[1], X_B, gap - 2.0 * error, m);
      EXPECT_EQ(m.size, 0) << "sample " << i;
    }
    ++checked;
  }
  EXPECT_GT(checked, 100);
}

// Penetration is the smallest separating translation, for hulls that share corners, edges and
// faces.
TEST(Fuzz, OverlapOfDegenerateHullsIsLeastTranslation) {
  std::mt19937 rng(5);
  int overlapping = 0;
  for (int i = 0; i < 400; ++i) {
    Shape shapes[2];
    for (Shape& shape : shapes) {
      while (!shape.mesh) {
        try {
          shape = hull_shape(cloud(rng, i % 2 ? kLattice : kNearlyCoplanar));
        } catch (const InputError&) {
        }
      }
    }
    const Pose X_A{awkward_rotation(rng), Vector3::Zero()};
    const Pose X_B{awkward_rotation(rng), lattice_point(rng)};
    Manifold m;
    pair_contacts(shapes[0], X_A, shapes[1], X_B, 0.0, m);
    if (m.size == 0) continue;
    ++overlapping;
    // If two separating translations differ by less than 1e-6 of the size, the longer may be
    // returned.
    EXPECT_GE(deepest(m).gap, largest_distance_along(shapes[0], X_A, shapes[1], X_B) - 1e-6)
        << "sample " << i;
  }
  EXPECT_GT(overlapping, 100);
}

}  // namespace
}  // namespace counterpoint::test::fuzz_test
