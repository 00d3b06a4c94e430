#include "counterpoint/collision/pairs/pair_contacts.h"

#include <algorithm>

#include "counterpoint/collision/pairs/pair_functions.h"
#include "counterpoint/collision/pairs/terrain_contacts.h"

namespace counterpoint::collision {
namespace {

constexpr int kNumTypes = 6;

// Rows and columns in the order of ShapeType; for the lower triangle the shapes are exchanged.
constexpr PairFunction kPairFunctions[kNumTypes][kNumTypes] = {
    {nullptr, plane_sphere, plane_box, plane_capsule, plane_cylinder, plane_convex_mesh},
    {nullptr, sphere_sphere, sphere_box, sphere_capsule, sphere_cylinder, convex_convex},
    {nullptr, nullptr, box_box, box_capsule, convex_convex, convex_convex},
    {nullptr, nullptr, nullptr, capsule_capsule, convex_convex, convex_convex},
    {nullptr, nullptr, nullptr, nullptr, convex_convex, convex_convex},
    {nullptr, nullptr, nullptr, nullptr, nullptr, convex_convex},
};

[[gnu::noinline]] bool is_ordered_by_rest(const Shape& a, const Pose& X_WA, const Shape& b,
                                          const Pose& X_WB) {
  for (int i = 1; i < 3; ++i) {
    if (X_WA.translation[i] != X_WB.translation[i]) {
      return X_WA.translation[i] < X_WB.translation[i];
    }
  }
  for (int i = 0; i < 3; ++i) {
    if (a.size[i] != b.size[i]) return a.size[i] < b.size[i];
  }
  const double* ra = X_WA.rotation.data();
  const double* rb = X_WB.rotation.data();
  return !std::lexicographical_compare(rb, rb + 9, ra, ra + 9);
}

// Orders shapes by type, then by pose and size, so that the result does not depend on the order of
// the arguments. Identical shapes may come in either order.
bool comes_first(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB) {
  if (a.type != b.type) return a.type < b.type;
  const double x_a = X_WA.translation.x();
  const double x_b = X_WB.translation.x();
  return x_a != x_b ? x_a < x_b : is_ordered_by_rest(a, X_WA, b, X_WB);
}

// Pairs of round shapes may have any poses (pair_functions.h).
bool is_round(const Shape& shape) {
  return shape.type == ShapeType::kSphere || shape.type == ShapeType::kCapsule;
}

[[gnu::noinline]] void at_origin_of_first(PairFunction function, const Shape& first,
                                          const Pose& X_first, const Shape& second,
                                          const Pose& X_second, const PairQuery& query,
                                          Manifold& out) {
  const Vector3 origin = X_first.translation;
  const Pose X_1{X_first.rotation, Vector3::Zero()};
  const Pose X_2{X_second.rotation, X_second.translation - origin};
  function(first, X_1, second, X_2, query, out);
  for (int i = 0; i < out.size; ++i) out.points[i].position += origin;
}

// Allocates scratch memory; the collider, which must not, keeps its own.
[[gnu::noinline]] void with_terrain(const Shape& a, const Pose& X_WA, const Shape& b,
                                    const Pose& X_WB, double margin, Manifold& out) {
  const bool turned = b.type == ShapeType::kTerrain;
  const Shape& ground = turned ? b : a;
  const Shape& shape = turned ? a : b;
  if (shape.type == ShapeType::kTerrain || shape.type == ShapeType::kPlane) return;
  TerrainContacts contacts;
  contacts.find(*ground.terrain, turned ? X_WB : X_WA, shape, enclose(shape), turned ? X_WA : X_WB,
                margin, out);
  for (int i = 0; turned && i < out.size; ++i) out.points[i].normal *= -1.0;
}

}  // namespace

void pair_contacts(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                   const PairQuery& query, Manifold& out) {
  out.size = 0;
  if (a.type == ShapeType::kTerrain || b.type == ShapeType::kTerrain) {
    with_terrain(a, X_WA, b, X_WB, query.margin, out);
    return;
  }
  const bool in_order = comes_first(a, X_WA, b, X_WB);
  const Shape& first = in_order ? a : b;
  const Shape& second = in_order ? b : a;
  const Pose& X_first = in_order ? X_WA : X_WB;
  const Pose& X_second = in_order ? X_WB : X_WA;
  const PairFunction function =
      kPairFunctions[static_cast<int>(first.type)][static_cast<int>(second.type)];
  if (is_round(first) && is_round(second)) {
    function(first, X_first, second, X_second, query, out);
  } else if (function != nullptr) {
    at_origin_of_first(function, first, X_first, second, X_second, query, out);
  }
  if (in_order) return;
  for (int i = 0; i < out.size; ++i) out.points[i].normal = -out.points[i].normal;
}

}  // namespace counterpoint::collision
