#include <algorithm>
#include <cmath>
#include <string>

#include "counterpoint/collision/broadphase/default_poses.h"
#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/collision/rays/ray.h"

namespace counterpoint::collision {
namespace {

Vector3 unit_direction(const Vector3& origin, const Vector3& direction) {
  if (!origin.allFinite())
    throw InputError("ray: the origin is not finite; give three numbers [m]");
  const double length = direction.stableNorm();
  if (!(length > 0.0) || !std::isfinite(length)) {
    throw InputError("ray: the direction is zero or not finite; give a vector of any other length");
  }
  return direction / length;
}

}  // namespace

std::optional<Distance> distance(const Shape& a, const Pose& X_WA, const Shape& b,
                                 const Pose& X_WB) {
  if (!(X_WA.rotation.allFinite() && X_WA.translation.allFinite() && X_WB.rotation.allFinite() &&
        X_WB.translation.allFinite())) {
    return std::nullopt;
  }
  Manifold m;
  pair_contacts(a, X_WA, b, X_WB, std::numeric_limits<double>::infinity(), m);
  if (m.size == 0) return std::nullopt;
  const ContactPoint& least =
      *std::min_element(m.points.begin(), m.points.begin() + m.size,
                        [](const ContactPoint& p, const ContactPoint& q) { return p.gap < q.gap; });
  const Vector3 half = 0.5 * least.gap * least.normal;
  return Distance{least.gap, least.normal, least.position - half, least.position + half};
}

bool overlap(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB) {
  Manifold m;
  pair_contacts(a, X_WA, b, X_WB, 0.0, m);
  return m.size > 0;
}

std::optional<RayHit> cast_ray(const Shape& shape, const Pose& X_WS, const Vector3& origin,
                               const Vector3& direction, double max_distance) {
  return cast_unit_ray(shape, X_WS, origin, unit_direction(origin, direction), max_distance);
}

SceneQuery::SceneQuery(const Model& model)
    : geometries_(model.geometries()), X_WB_(default_poses(model)), collider_(model) {
  set_poses(std::vector<Pose>(X_WB_));
}

void SceneQuery::set_poses(std::span<const Pose> X_WB) {
  if (X_WB.size() != X_WB_.size()) {
    throw InputError("set_poses: " + std::to_string(X_WB.size()) + " poses for " +
                     std::to_string(X_WB_.size()) + " bodies; give one each, the world first");
  }
  std::copy(X_WB.begin(), X_WB.end(), X_WB_.begin());
  X_WG_.clear();
  for (const Geometry& g : geometries_) X_WG_.push_back(X_WB_[g.body] * g.X_BG);
}

std::optional<SceneRayHit> SceneQuery::cast_ray(const Vector3& origin, const Vector3& direction,
                                                double max_distance) const {
  const Vector3 unit = unit_direction(origin, direction);
  std::optional<SceneRayHit> best;
  for (int i = 0; i < static_cast<int>(geometries_.size()); ++i) {
    const auto hit = cast_unit_ray(geometries_[i].shape, X_WG_[i], origin, unit, max_distance);
    if (!hit || (best && hit->distance >= best->distance)) continue;
    best = SceneRayHit{*hit, i};
    max_distance = hit->distance;
  }
  return best;
}

std::optional<Distance> SceneQuery::distance(int geometry_a, int geometry_b) const {
  return collision::distance(geometries_[geometry_a].shape, X_WG_[geometry_a],
                             geometries_[geometry_b].shape, X_WG_[geometry_b]);
}

std::vector<int> SceneQuery::overlaps(const Shape& shape, const Pose& X_WS) const {
  std::vector<int> out;
  for (int i = 0; i < static_cast<int>(geometries_.size()); ++i) {
    if (overlap(geometries_[i].shape, X_WG_[i], shape, X_WS)) out.push_back(i);
  }
  return out;
}

std::vector<std::pair<int, int>> SceneQuery::overlaps() {
  std::vector<std::pair<int, int>> out;
  for (const Candidate& c : contacts()) out.emplace_back(c.geometry_a, c.geometry_b);
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

std::vector<Candidate> SceneQuery::contacts(double margin) {
  std::vector<Candidate> out;
  // The collider adds the margins of both bodies: give half to each.
  const std::vector<double> margins(X_WB_.size(), 0.5 * margin);
  collider_.compute_candidates(X_WB_, margins, out);
  return out;
}

}  // namespace counterpoint::collision
