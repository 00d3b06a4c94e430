// Poses in, contact candidates out; and queries: distance, rays, overlaps, contacts of a pose.
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

/// Where two geometries touch, overlap, or come close. All in the world frame W. Geometry A has the
/// lower index.
struct Candidate {
  int geometry_a = 0, geometry_b = 0;
  Vector3 position = Vector3::Zero();  ///< halfway between the two surface points [m]
  Vector3 normal = Vector3::UnitZ();   ///< unit, from A to B
  double gap = 0.0;                    ///< signed distance along the normal [m]; negative: overlap
};

/// Of the smallest ball about the shape's origin that holds it [m]; 0 of planes and terrain.
double bounding_radius(const Shape& shape);

/// By body, the world first: of a ball about the body's origin that holds all its shapes [m]; 0
/// without shapes.
std::vector<double> body_radii(const Model& model);

/// How the bodies move within the step; one entry a body, the world first. Empty: not at all.
struct BodyMotions {
  std::span<const Motion> velocity;  ///< in W, linear of the body's origin [rad/s; m/s]
  std::span<const double> mobility;  ///< of one pair the larger moves more: inverse weights [1/kg]
  double time_step = 0.0;            ///< [s]
};

/// Where the bodies are, and how far they may go: see Collider::compute_candidates.
struct BodyPlaces {
  std::span<const Pose> X_WB;
  std::span<const double> margin;       ///< [m]
  std::span<const double> travel = {};  ///< [m]
  BodyMotions motions = {};
};

/// Finds the contact candidates of a model. Scratch memory inside: one per thread. The result is a
/// pure function of (model, poses, margins): nothing is remembered from call to call, and the order
/// is by geometry pair, then by the manifold's own fixed order.
class Collider {
 public:
  /// Pairs never tested: same body, both static, excluded by the model, and, unless it includes
  /// them, links of one assembly (Geometry::assembly) that are joined by a joint or overlap in the
  /// default pose (see overlapping_pairs).
  explicit Collider(const Model& model);
  ~Collider();
  Collider(Collider&&) noexcept;
  Collider& operator=(Collider&&) noexcept;

  /// All candidates with gap < margin_A + margin_B. X_WB: pose of every body, the world first
  /// (num_bodies); a body whose pose is not finite touches nothing. margin: one a body [m], the
  /// world first. `out` is cleared first; no allocation once its capacity has been reached.
  ///
  /// travel: how far the surface of each body may go before the next call [m]; where that is a good
  /// part of a shape's size, corners that face away now are candidates too, and the middle of what
  /// is slender or flat. Empty: nowhere.
  ///
  /// idle: by body, true where pose and margin are those of the last call, the world too; pairs of
  /// idle bodies are left out. Empty: none.
  ///
  /// motions: contacts that would stop these are looked at again where they lead (pair_motion.h).
  void compute_candidates(std::span<const Pose> X_WB, std::span<const double> margin,
                          std::vector<Candidate>& out, std::span<const double> travel = {},
                          std::span<const char> idle = {}, const BodyMotions& motions = {});

  /// The enabled pairs of geometries that are not both idle and whose bounding boxes (of a plane:
  /// the ball about the other one) come within the margins, ascending: those that may have
  /// candidates. Arguments as above. Valid until the next call.
  std::span<const std::pair<int, int>> find_close_pairs(std::span<const Pose> X_WB,
                                                        std::span<const double> margin,
                                                        std::span<const char> idle = {});

  /// What compute_candidates finds of one of the pairs that find_close_pairs has just found, with
  /// the poses and margins given there, added to `out`.
  void add_candidates(const BodyPlaces& at, const std::pair<int, int>& pair,
                      std::vector<Candidate>& out);

  /// Where a pair is that find_close_pairs has just found, from what encloses its geometries.
  struct Whereabouts {
    double gap;      ///< a lower bound of the signed distance, 0 or less if it is not known [m]
    Vector3 middle;  ///< of the smaller one (of a plane's or terrain's partner), in W [m]
    double radius;   ///< of that about its middle [m]
  };
  Whereabouts whereabouts(int geometry_a, int geometry_b) const;

  /// The motion of two geometries as the last compute_candidates, with these poses and motions,
  /// looked at it; none of pairs whose contacts are those of their poses whatever the motion.
  std::optional<PairMotion> pair_motion(std::span<const Pose> X_WB, int geometry_a, int geometry_b,
                                        const BodyMotions& motions) const;

  /// Geometry pairs of one assembly left out because they overlap in the default pose, ascending.
  const std::vector<std::pair<int, int>>& overlapping_pairs() const;
  /// May geometries a and b ever touch?
  bool may_touch(int a, int b) const;
  /// Number of geometry pairs that may.
  int num_enabled_pairs() const;
  /// Number of geometry pairs left out because a joint joins their bodies.
  int num_joined_pairs() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// All that a reader must know: the model's notes, then which pairs of one assembly overlap in the
/// default pose and are left out, and which pairs that may touch start deep inside each other (by
/// more than a tenth of what is between the surface and the middle of the thinner one).
std::vector<Note> all_notes(const Model& model);

// ---- Queries of shapes and scenes: distance, rays, overlaps, contacts of a pose.
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
//     if (hit) std::cout << model.geometries()[hit->geometry].name << " at " << hit->distance << "
//     m\n";

/// Signed distance of shapes A and B, in the frame their poses are given in.
struct Distance {
  double gap = 0.0;  ///< [m]; negative: minus the length of the least translation that parts them
  Vector3 normal = Vector3::UnitZ();  ///< unit, from A to B
  Vector3 point_a = Vector3::Zero();  ///< on the surface of A, nearest to B (deepest in B) [m]
  Vector3 point_b = Vector3::Zero();  ///< on the surface of B: point_a + gap normal [m]
};

/// Signed distance of two shapes at any distance; nothing for two planes, or if a pose is not
/// finite. Right to 1e-9 of the shapes' size.
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

/// First point of the shape on the ray from `origin` [m] along `direction` (any length but zero),
/// no farther than `max_distance` [m]; nothing if there is none. A ray that starts inside hits
/// where it starts, at distance 0, with its own direction reversed as the normal. In closed form
/// for every shape.
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

  /// The nearest hit over all geometries (of equals the one of lowest index); as cast_ray of a
  /// shape.
  std::optional<SceneRayHit> cast_ray(
      const Vector3& origin, const Vector3& direction,
      double max_distance = std::numeric_limits<double>::infinity()) const;

  /// Signed distance of two geometries, by index; as distance of two shapes.
  std::optional<Distance> distance(int geometry_a, int geometry_b) const;

  /// Geometries that a shape at this pose would overlap, ascending: is there room?
  std::vector<int> overlaps(const Shape& shape, const Pose& X_WS) const;

  /// Pairs of geometries that overlap, ascending, of those that may touch at all (see Collider).
  std::vector<std::pair<int, int>> overlaps();

  /// Contacts of the pose: points with gap < margin [m] of all pairs that may touch; what a step of
  /// the engine would see at that margin.
  std::vector<Candidate> contacts(double margin = 0.0);

 private:
  std::vector<Geometry> geometries_;
  std::vector<Pose> X_WB_, X_WG_;
  Collider collider_;
};

}  // namespace counterpoint::collision
