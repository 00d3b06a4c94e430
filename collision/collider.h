// Contact candidates of a model from the poses of its bodies; queries: distances, rays, overlaps,
// contacts of a pose.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::collision {

struct PairMotion;  // pairs/pair_motion.h

/// A point where two geometries touch, overlap or come close, in the world frame W. Geometry A has
/// the lower index.
struct Candidate {
  int geometry_a = 0, geometry_b = 0;
  Vector3 position = Vector3::Zero();  ///< halfway between the two surface points [m]
  Vector3 normal = Vector3::UnitZ();   ///< unit, from A to B
  double gap = 0.0;                    ///< signed distance along the normal [m]; negative: overlap
  /// Part of the contact patch that the point stands for [m^2] (pairs/patch_area.h), for geometries
  /// with a stiffness per area; else 0.
  double area = 0.0;
};

/// Radius of the smallest ball about the shape's origin that contains it [m]; 0 for planes and
/// terrain.
double bounding_radius(const Shape& shape);

/// For each body, the world first, the radius of a ball about the body's origin that contains its
/// shapes [m]; 0 without shapes.
std::vector<double> body_radii(const Model& model);

/// Motion of the bodies within the step: one entry per body, the world first. Empty: no motion is
/// considered.
struct BodyMotions {
  std::span<const Motion> velocity;  ///< in W, linear part at the body's origin [rad/s; m/s]
  std::span<const double> mobility;  ///< inverse effective masses [1/kg], see ShapeMotion::share
  double time_step = 0.0;            ///< [s]
};

/// Poses, margins and travel of all bodies: the arguments of Collider::compute_candidates.
struct BodyPlaces {
  std::span<const Pose> X_WB;
  std::span<const double> margin;       ///< [m]
  std::span<const double> travel = {};  ///< [m]
  BodyMotions motions = {};
};

/// Finds the contact candidates of a model. It owns scratch memory, so use one per thread. The
/// result is a pure function of the arguments of each call, ordered by geometry pair, then by the
/// manifold's own fixed order.
class Collider {
 public:
  /// Some pairs are never tested: geometries of one body, two static geometries, pairs excluded by
  /// the model, and, unless the model includes them, links of one assembly (Geometry::assembly)
  /// that are joined by a joint or overlap in the default pose (see overlapping_pairs).
  explicit Collider(const Model& model);
  ~Collider();
  Collider(Collider&&) noexcept;
  Collider& operator=(Collider&&) noexcept;

  /// Finds all candidates with gap < margin_A + margin_B. X_WB: pose of every body, the world first
  /// (num_bodies); a body whose pose is not finite touches nothing. margin: for each body, the
  /// world first [m]. `out` is cleared first; nothing is allocated once it has enough capacity.
  ///
  /// travel: for each body, how far its surface may move before the next call [m]; empty: no
  /// motion. If the travel is a good part of a shape's size, corners that face away now become
  /// candidates too, and so does the middle of a slender or flat shape.
  ///
  /// idle: for each body, the world too, true if its pose and margin equal those of the last
  /// call; pairs of idle bodies are left out. Empty: no body is idle.
  ///
  /// motions: contacts that would stop this motion are tested again at its end (pair_motion.h).
  void compute_candidates(std::span<const Pose> X_WB, std::span<const double> margin,
                          std::vector<Candidate>& out, std::span<const double> travel = {},
                          std::span<const char> idle = {}, const BodyMotions& motions = {});

  /// Returns the enabled pairs of geometries that may have candidates, ascending: at least one is
  /// not idle, and their bounding boxes (for a plane: the plane and the other geometry's bounding
  /// volumes) come within the margins. Arguments as in compute_candidates. Valid until the next
  /// call.
  std::span<const std::pair<int, int>> find_close_pairs(std::span<const Pose> X_WB,
                                                        std::span<const double> margin,
                                                        std::span<const char> idle = {});

  /// Adds to `out` the candidates that compute_candidates would find for one of the pairs of the
  /// last find_close_pairs, which was called with the same poses and margins.
  void add_candidates(const BodyPlaces& at, const std::pair<int, int>& pair,
                      std::vector<Candidate>& out);

  /// Position of a pair of the last find_close_pairs, estimated from bounding volumes.
  struct Whereabouts {
    double gap;      ///< lower bound of the signed distance [m]; 0 or less if no bound is known
    Vector3 middle;  ///< centre of the smaller geometry (not the plane or terrain), in W [m]
    double radius;   ///< radius of that geometry's ball about `middle` [m]
  };
  Whereabouts whereabouts(int geometry_a, int geometry_b) const;

  /// Returns the motion of two geometries that the last compute_candidates used for the same poses
  /// and motions; nothing for pairs whose contacts do not depend on the motion.
  std::optional<PairMotion> pair_motion(std::span<const Pose> X_WB, int geometry_a, int geometry_b,
                                        const BodyMotions& motions) const;

  /// Geometry pairs of one assembly that are left out because they overlap in the default pose,
  /// ascending.
  const std::vector<std::pair<int, int>>& overlapping_pairs() const;
  /// True if geometries a and b may ever touch.
  bool may_touch(int a, int b) const;
  /// Number of geometry pairs that may touch.
  int num_enabled_pairs() const;
  /// Number of geometry pairs left out because a joint joins their bodies.
  int num_joined_pairs() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the model's notes, then notes on its default pose: which pairs of one assembly overlap
/// and are left out, and which pairs that may touch start deep inside each other (depth over a
/// tenth of the distance from the surface to the middle of the thinner shape).
std::vector<Note> all_notes(const Model& model);

// ---- Queries of shapes and scenes: distance, rays, overlaps, contacts of a pose.
//
// Distance of two shapes at any poses:
//
//     const auto d = collision::distance(box, X_WA, sphere, X_WB);
//     if (d) std::cout << d->gap << " m apart, nearest at " << d->point_a.transpose() << '\n';
//
// Ray against a model at configuration q (body_poses: model/model.h):
//
//     collision::SceneQuery query(model);
//     query.set_poses(body_poses(model, q));
//     const auto hit = query.cast_ray({0, 0, 2}, {0, 0, -1});  // straight down from 2 m
//     if (hit)
//       std::cout << model.geometries()[hit->geometry].name << ", " << hit->distance << " m\n";

/// Signed distance of shapes A and B, in the common frame of their poses.
struct Distance {
  double gap = 0.0;  ///< [m]; if negative, minus the least translation that separates them
  Vector3 normal = Vector3::UnitZ();  ///< unit, from A to B
  Vector3 point_a = Vector3::Zero();  ///< on the surface of A, nearest to B (deepest in B) [m]
  Vector3 point_b = Vector3::Zero();  ///< on the surface of B: point_a + gap normal [m]
};

/// Returns the signed distance of two shapes, however far apart; nothing for two planes or if a
/// pose is not finite. Accurate to 1e-9 of the shapes' size.
std::optional<Distance> distance(const Shape& a, const Pose& X_WA, const Shape& b,
                                 const Pose& X_WB);

/// True if the interiors of the shapes intersect.
bool overlap(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB);

/// The first point at which a ray meets a surface.
struct RayHit {
  double distance = 0.0;               ///< from the ray's origin [m]
  Vector3 position = Vector3::Zero();  ///< [m]
  Vector3 normal = Vector3::UnitZ();   ///< unit, out of the surface
};

/// Returns the first point of the shape on the ray from `origin` [m] along `direction` (any length
/// but zero), no farther than `max_distance` [m]; nothing if there is none. A ray that starts
/// inside hits at its origin, at distance 0, with its reversed direction as the normal. Closed form
/// for every shape.
/// @throws InputError if the origin is not finite, or the direction is zero or not finite.
std::optional<RayHit> cast_ray(const Shape& shape, const Pose& X_WS, const Vector3& origin,
                               const Vector3& direction,
                               double max_distance = std::numeric_limits<double>::infinity());

/// A ray's hit and the geometry it hit.
struct SceneRayHit : RayHit {
  int geometry = -1;  ///< index into model.geometries()
};

/// Queries about all geometries of a model. It copies the parts of the model it needs; use one per
/// thread.
class SceneQuery {
 public:
  /// Places the bodies at the model's default configuration.
  explicit SceneQuery(const Model& model);

  /// Places the bodies: X_WB of every body, the world first (num_bodies).
  /// @throws InputError if the number of poses differs.
  void set_poses(std::span<const Pose> X_WB);
  const Pose& pose(int geometry) const { return X_WG_[geometry]; }

  /// Returns the nearest hit over all geometries, the lowest index if several are equally near;
  /// otherwise like cast_ray of a shape.
  std::optional<SceneRayHit> cast_ray(
      const Vector3& origin, const Vector3& direction,
      double max_distance = std::numeric_limits<double>::infinity()) const;

  /// Signed distance of two geometries given by index; see distance() of two shapes.
  std::optional<Distance> distance(int geometry_a, int geometry_b) const;

  /// Returns the geometries that a shape at this pose would overlap, ascending.
  std::vector<int> overlaps(const Shape& shape, const Pose& X_WS) const;

  /// Returns the pairs of geometries that overlap, ascending, among those that may touch (see
  /// Collider).
  std::vector<std::pair<int, int>> overlaps();

  /// Returns the contact points with gap < margin [m] of all pairs that may touch: those that a
  /// step of the engine would use with this margin.
  std::vector<Candidate> contacts(double margin = 0.0);

 private:
  std::vector<Geometry> geometries_;
  std::vector<Pose> X_WB_, X_WG_;
  Collider collider_;
};

}  // namespace counterpoint::collision
