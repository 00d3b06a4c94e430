// Queries of shapes and scenes: distance, rays, overlaps, contacts of a pose.
//
// Of two shapes anywhere:
//
//     const auto d = collision::distance(box, X_WA, sphere, X_WB);
//     if (d) std::cout << d->gap << " m apart, nearest at " << d->point_a.transpose() << '\n';
//
// Of a model in a configuration q (body_poses: model/model.h):
//
//     collision::SceneQuery query(model);
//     query.set_poses(body_poses(model, q));
//     const auto hit = query.cast_ray({0, 0, 2}, {0, 0, -1});  // straight down from 2 m
//     if (hit) std::cout << model.geometries()[hit->geometry].name << " at " << hit->distance << " m\n";
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/model/model.h"

namespace counterpoint::collision {

/// Signed distance of shapes A and B, in the frame their poses are given in.
struct Distance {
  double gap = 0.0;  ///< [m]; negative: minus the length of the least translation that parts them
  Vector3 normal = Vector3::UnitZ();    ///< unit, from A to B
  Vector3 point_a = Vector3::Zero();    ///< on the surface of A, nearest to B (deepest in B) [m]
  Vector3 point_b = Vector3::Zero();    ///< on the surface of B: point_a + gap normal [m]
};

/// Signed distance of two shapes at any distance; nothing for two planes, or if a pose is not finite.
/// Right to 1e-9 of the shapes' size.
std::optional<Distance> distance(const Shape& a, const Pose& X_WA, const Shape& b,
                                 const Pose& X_WB);

/// True if the shapes share more than their surfaces.
bool overlap(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB);

/// Where a ray first meets a surface.
struct RayHit {
  double distance = 0.0;               ///< from the ray's origin [m]
  Vector3 position = Vector3::Zero();  ///< [m]
  Vector3 normal = Vector3::UnitZ();   ///< unit, out of the surface
};

/// First point of the shape on the ray from `origin` [m] along `direction` (any length but zero), no
/// farther than `max_distance` [m]; nothing if there is none. A ray that starts inside hits where it
/// starts, at distance 0, with its own direction reversed as the normal. In closed form for every shape.
/// @throws InputError if the origin is not finite, or the direction is zero or not finite.
std::optional<RayHit> cast_ray(const Shape& shape, const Pose& X_WS, const Vector3& origin,
                               const Vector3& direction,
                               double max_distance = std::numeric_limits<double>::infinity());

/// A ray's hit and what it hit.
struct SceneRayHit : RayHit {
  int geometry = -1;  ///< index into model.geometries()
};

/// Questions about all geometries of a model. Copies what it needs of the model; one per thread.
class SceneQuery {
 public:
  /// Bodies start where they are at the model's default configuration.
  explicit SceneQuery(const Model& model);

  /// Places the bodies: X_WB of every body, the world first (num_bodies).
  /// @throws InputError if their number is another.
  void set_poses(std::span<const Pose> X_WB);
  const Pose& pose(int geometry) const { return X_WG_[geometry]; }

  /// The nearest hit over all geometries (of equals the one of lowest index); as cast_ray of a shape.
  std::optional<SceneRayHit> cast_ray(
      const Vector3& origin, const Vector3& direction,
      double max_distance = std::numeric_limits<double>::infinity()) const;

  /// Signed distance of two geometries, by index; as distance of two shapes.
  std::optional<Distance> distance(int geometry_a, int geometry_b) const;

  /// Geometries that a shape at this pose would overlap, ascending: is there room?
  std::vector<int> overlaps(const Shape& shape, const Pose& X_WS) const;

  /// Pairs of geometries that overlap, ascending, of those that may touch at all (see Collider).
  std::vector<std::pair<int, int>> overlaps();

  /// Contacts of the pose: points with gap < margin [m] of all pairs that may touch; what a step of the
  /// engine would see at that margin.
  std::vector<Candidate> contacts(double margin = 0.0);

 private:
  std::vector<Geometry> geometries_;
  std::vector<Pose> X_WB_, X_WG_;
  Collider collider_;
};

}  // namespace counterpoint::collision
