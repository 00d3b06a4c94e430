#include "counterpoint/collision/collider.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/collision/broadphase.h"
#include "counterpoint/collision/corner_contacts.h"
#include "counterpoint/collision/default_poses.h"
#include "counterpoint/collision/pair_contacts.h"
#include "counterpoint/collision/pair_filter.h"

namespace counterpoint::collision {
namespace {

// What encloses a shape, in its geometry frame.
struct Enclosure {
  Vector3 center;
  Vector3 half;   // of the box around it
  double radius;  // of the ball around it
};

Enclosure enclose(const Shape& shape) {
  const Vector3& s = shape.size;
  switch (shape.type) {
    case ShapeType::kPlane: break;
    case ShapeType::kSphere: return {Vector3::Zero(), Vector3::Constant(s[0]), s[0]};
    case ShapeType::kBox: return {Vector3::Zero(), s, s.norm()};
    case ShapeType::kCapsule:
      return {Vector3::Zero(), Vector3(s[0], s[0], s[0] + s[1]), s[0] + s[1]};
    case ShapeType::kCylinder:
      return {Vector3::Zero(), Vector3(s[0], s[0], s[1]), std::hypot(s[0], s[1])};
    case ShapeType::kConvexMesh: {
      Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
      Vector3 high = -low;
      for (const Vector3& v : shape.mesh->vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
      }
      const Vector3 center = 0.5 * (low + high);
      double radius = 0.0;
      for (const Vector3& v : shape.mesh->vertices) radius = std::max(radius, (v - center).norm());
      return {center, 0.5 * (high - low), radius};
    }
  }
  return {Vector3::Zero(), Vector3::Zero(), 0.0};
}

// The world-aligned box around a placed shape: tight for round shapes, else around its own box or ball,
// whichever is smaller.
Bounds bounds(const Shape& shape, const Enclosure& enclosure, const Pose& X, double margin) {
  const Vector3 center = X * enclosure.center;
  Vector3 half;
  if (shape.type == ShapeType::kSphere) {
    half = enclosure.half;
  } else if (shape.type == ShapeType::kCapsule) {
    half = (shape.size[1] * X.rotation.col(2)).cwiseAbs().array() + shape.size[0];
  } else {
    half = (X.rotation.cwiseAbs() * enclosure.half).cwiseMin(enclosure.radius);
  }
  half.array() += margin;
  return {center - half, center + half};
}

}  // namespace

struct Collider::Impl {
  explicit Impl(const Model& model) : geometries(model.geometries()), filter(model) {}

  void place(std::span<const Pose> X_WB, std::span<const double> margin);
  void find_pairs(std::span<const double> margin);
  void add_plane_pairs(int plane, std::span<const double> margin);

  // A copy: nothing then depends on where the model lives.
  std::vector<Geometry> geometries;
  PairFilter filter;
  Broadphase broadphase;
  std::vector<Enclosure> enclosures;
  std::vector<int> planes, solids;             // geometry indices
  std::vector<std::pair<int, int>> overlapping;
  // Scratch.
  std::vector<Pose> X_WG;
  std::vector<Bounds> boxes;                   // of solids
  std::vector<std::pair<int, int>> pairs;
  Manifold manifold;
};

void Collider::Impl::place(std::span<const Pose> X_WB, std::span<const double> margin) {
  X_WG.resize(geometries.size());
  for (std::size_t i = 0; i < geometries.size(); ++i) {
    X_WG[i] = X_WB[geometries[i].body] * geometries[i].X_BG;
  }
  boxes.resize(solids.size());
  for (std::size_t k = 0; k < solids.size(); ++k) {
    const Geometry& g = geometries[solids[k]];
    boxes[k] = bounds(g.shape, enclosures[solids[k]], X_WG[solids[k]], margin[g.body]);
  }
}

void Collider::Impl::add_plane_pairs(int plane, std::span<const double> margin) {
  const Vector3 normal = X_WG[plane].rotation.col(2);
  const double offset = normal.dot(X_WG[plane].translation);
  const double plane_margin = margin[geometries[plane].body];
  if (!std::isfinite(offset)) return;
  for (std::size_t k = 0; k < solids.size(); ++k) {
    const int i = solids[k];
    const double height = normal.dot(X_WG[i] * enclosures[i].center) - offset;
    if (height - enclosures[i].radius >= plane_margin + margin[geometries[i].body]) continue;
    if (is_sound(boxes[k]) && filter.enabled(plane, i)) pairs.emplace_back(std::min(plane, i), std::max(plane, i));
  }
}

// Enabled pairs whose enclosures come close, in ascending order.
void Collider::Impl::find_pairs(std::span<const double> margin) {
  broadphase.find_pairs(boxes, pairs);
  std::size_t kept = 0;
  for (const auto& [k, l] : pairs) {
    const std::pair<int, int> pair(solids[k], solids[l]);
    if (filter.enabled(pair.first, pair.second)) pairs[kept++] = pair;
  }
  pairs.resize(kept);
  for (const int plane : planes) add_plane_pairs(plane, margin);
  std::sort(pairs.begin(), pairs.end());
}

Collider::Collider(const Model& model) : impl_(std::make_unique<Impl>(model)) {
  Impl& impl = *impl_;
  const std::vector<Geometry>& geometries = impl.geometries;
  for (int i = 0; i < static_cast<int>(geometries.size()); ++i) {
    const bool plane = geometries[i].shape.type == ShapeType::kPlane;
    (plane ? impl.planes : impl.solids).push_back(i);
    impl.enclosures.push_back(enclose(geometries[i].shape));
  }
  const std::vector<Pose> X_WB = default_poses(model);
  const std::vector<double> margin(X_WB.size(), 0.0);
  impl.place(X_WB, margin);
  impl.find_pairs(margin);
  for (const auto& [a, b] : impl.pairs) {
    const Geometry& ga = geometries[a];
    const Geometry& gb = geometries[b];
    if (ga.instance < 0 || ga.instance != gb.instance) continue;
    pair_contacts(ga.shape, impl.X_WG[a], gb.shape, impl.X_WG[b], 0.0, impl.manifold);
    if (impl.manifold.size > 0) impl.overlapping.emplace_back(a, b);
  }
  impl.filter.exclude(impl.overlapping);
  // Memory of the default pose, where everything may be in one place, is a poor start.
  impl.broadphase = Broadphase();
}

Collider::~Collider() = default;
Collider::Collider(Collider&&) noexcept = default;
Collider& Collider::operator=(Collider&&) noexcept = default;

void Collider::compute_candidates(std::span<const Pose> X_WB, std::span<const double> margin,
                                  std::vector<Candidate>& out,
                                  std::span<const double> travel) {
  out.clear();
  Impl& impl = *impl_;
  impl.place(X_WB, margin);
  impl.find_pairs(margin);
  const std::vector<Geometry>& geometries = impl.geometries;
  for (const auto& [a, b] : impl.pairs) {
    const Geometry& ga = geometries[a];
    const Geometry& gb = geometries[b];
    pair_contacts(ga.shape, impl.X_WG[a], gb.shape, impl.X_WG[b],
                  margin[ga.body] + margin[gb.body], impl.manifold);
    if (!travel.empty()) {
      add_corner_contacts(ga.shape, impl.X_WG[a], gb.shape, impl.X_WG[b],
                          margin[ga.body] + margin[gb.body], travel[ga.body] + travel[gb.body],
                          impl.manifold);
    }
    for (int i = 0; i < impl.manifold.size; ++i) {
      const ContactPoint& p = impl.manifold.points[i];
      out.push_back({a, b, p.position, p.normal, p.gap});
    }
  }
}

const std::vector<std::pair<int, int>>& Collider::overlapping_pairs() const {
  return impl_->overlapping;
}

int Collider::num_enabled_pairs() const { return impl_->filter.num_enabled_pairs(); }

}  // namespace counterpoint::collision
