#include "counterpoint/collision/collider.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/collision/broadphase/default_poses.h"
#include "counterpoint/collision/collider_impl.h"

namespace counterpoint::collision {

// Returns the rotation [rad] at which the surface of the smaller body has moved by `margin` [m].
double Collider::Impl::turn(int a, int b, double margin) const {
  double radius = std::numeric_limits<double>::infinity();
  for (const int body : {a, b})
    if (body != 0) radius = std::min(radius, radii[body]);
  return margin / radius;
}

// Finds the contact points of geometries a and b; writes them to `manifold`.
void Collider::Impl::find_contacts(int a, int b, const PairQuery& query) {
  const Shape& shape_a = geometries[a].shape;
  const Shape& shape_b = geometries[b].shape;
  if (shape_a.type == ShapeType::kTerrain) {
    terrain_contacts.find(*shape_a.terrain, X_WG[a], shape_b, enclosures[b], X_WG[b], query.margin,
                          manifold);
  } else if (shape_b.type == ShapeType::kTerrain) {
    terrain_contacts.find(*shape_b.terrain, X_WG[b], shape_a, enclosures[a], X_WG[a], query.margin,
                          manifold);
    for (int i = 0; i < manifold.size; ++i) manifold.points[i].normal *= -1.0;
  } else {
    pair_contacts(shape_a, X_WG[a], shape_b, X_WG[b], query, manifold);
  }
}

// True if the contacts of a pair may depend on its motion (pair_motion.h). Planes and terrain have
// a fixed normal at each point; spheres and capsules have no edges among each other.
bool Collider::Impl::may_pass(int a, int b) const {
  const auto is = [&](int i, ShapeType one, ShapeType other) {
    return placements[i].type == one || placements[i].type == other;
  };
  return !is(a, ShapeType::kPlane, ShapeType::kTerrain) &&
         !is(b, ShapeType::kPlane, ShapeType::kTerrain) &&
         !(is(a, ShapeType::kSphere, ShapeType::kCapsule) &&
           is(b, ShapeType::kSphere, ShapeType::kCapsule));
}

PairMotion Collider::Impl::motion_of(std::span<const Pose> X_WB, int a, int b,
                                     const BodyMotions& motions) const {
  const int body_a = placements[a].body, body_b = placements[b].body;
  const double sum = motions.mobility[body_a] + motions.mobility[body_b];
  const auto moving = [&](int i, int body) {
    return ShapeMotion{X_WG[i], X_WB[body].translation, motions.velocity[body] * motions.time_step,
                       sum > 0.0 ? motions.mobility[body] / sum : 0.5};
  };
  const int smaller = enclosures[a].radius <= enclosures[b].radius ? a : b;
  return {moving(a, body_a), moving(b, body_b), X_WG[smaller] * enclosures[smaller].center,
          enclosures[smaller].radius};
}

// True if the point is at a seam of pieces or inside the body of either geometry.
bool Collider::Impl::is_hidden(int a, int b, const ContactPoint& point) const {
  const auto hidden = [&](int i, double sign) {
    if (!seams.is_piece(i)) return false;
    const Vector3 surface = point.position - (0.5 * sign * point.gap) * point.normal;
    return seams.hides(i, X_WG[i].inverse() * surface,
                       sign * (X_WG[i].rotation.transpose() * point.normal));
  };
  return hidden(a, 1.0) || hidden(b, -1.0);
}

// Finds contact points with regard to the pair's motion; writes them to `manifold`. Returns how
// many of the first ones are known not to be hidden.
int Collider::Impl::find_moving_contacts(int a, int b, PairQuery query, const PairMotion& motion) {
  query.rounding = motion.rounding();
  find_contacts(a, b, query);
  if (seams.is_piece(a) || seams.is_piece(b)) drop_hidden(a, b);
  if (!stops(motion, manifold) || meets_seam(a, b, motion.way)) return manifold.size;
  look_ahead(geometries[a].shape, geometries[b].shape, motion, query, manifold);
  return 0;
}

// True if a contact may come to a seam on a way of this length [m]. Then the body touches the piece
// that it leaves, not the edge that it will have passed.
bool Collider::Impl::meets_seam(int a, int b, double way) const {
  const auto near = [&](int i) {
    return seams.is_piece(i) &&
           std::any_of(manifold.points.begin(), manifold.points.begin() + manifold.size,
                       [&](const ContactPoint& p) {
                         const double reach = way + std::abs(p.gap);
                         return seams.is_near(i, X_WG[i].inverse() * p.position, reach);
                       });
  };
  return near(a) || near(b);
}

void Collider::Impl::drop_hidden(int a, int b) {
  int kept = 0;
  for (int i = 0; i < manifold.size; ++i)
    if (!is_hidden(a, b, manifold.points[i])) manifold.points[kept++] = manifold.points[i];
  manifold.size = kept;
}

// Adds contacts of the core balls that keep the middle of a fast slender body on its side
// (core_ball). On a plane the contacts of all corners in `manifold` imply that of the middle, which
// moves as their mean, unless a corner has turned deep into the plane; a contact more would carry a
// share of the load at some speeds and not at others.
void Collider::Impl::add_core_contacts(int a, int b, double margin, double travel,
                                       std::vector<Candidate>& out) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < manifold.size; ++i) least = std::min(least, manifold.points[i].gap);
  for (const bool of_a : {true, false}) {
    const int mine = of_a ? a : b, other = of_a ? b : a;
    const auto ball = core_ball(geometries[mine].shape, enclosures[mine], X_WG[mine], travel);
    if (!ball) continue;
    const Shape& shape = geometries[other].shape;
    if (shape.type == ShapeType::kPlane && geometries[mine].shape.type != ShapeType::kConvexMesh &&
        least > -ball->shape.size[0])
      continue;
    double sign = of_a ? 1.0 : -1.0;
    if (shape.type == ShapeType::kTerrain) {
      terrain_contacts.find(*shape.terrain, X_WG[other], ball->shape, enclose(ball->shape), ball->X,
                            margin, manifold);
      sign = -sign;
    } else {
      find_core_contact(*ball, shape, X_WG[other], margin, manifold);
    }
    for (int i = 0; i < manifold.size; ++i) {
      const ContactPoint& p = manifold.points[i];
      out.push_back({a, b, p.position, sign * p.normal, p.gap});
    }
  }
}

/// Spreads the contacts in `manifold` over their patches and sets `areas`: 0 if no surface has a
/// stiffness per area.
void Collider::Impl::find_areas(int a, int b, const BodyPlaces& at) {
  areas.fill(0.0);
  const Geometry &ga = geometries[a], &gb = geometries[b];
  if (!has_soft_pairs && !ga.material.per_area.is_soft() && !gb.material.per_area.is_soft()) return;
  const auto moves = [&](int body) {
    if (body == 0 || at.motions.velocity.empty()) return Motion{};
    const Motion& V = at.motions.velocity[body];
    return Motion{V.angular, V.at(-at.X_WB[body].translation)} * at.motions.time_step;
  };
  const PatchPair pair{ga.shape, X_WG[a], gb.shape, X_WG[b], moves(gb.body) - moves(ga.body)};
  spread_patches(pair, patch_faces, manifold, areas);
}

Collider::Collider(const Model& model) : impl_(std::make_unique<Impl>(model)) {
  Impl& impl = *impl_;
  const std::vector<Geometry>& geometries = impl.geometries;
  impl.has_soft_pairs =
      std::any_of(model.pair_materials().begin(), model.pair_materials().end(),
                  [](const PairMaterial& p) { return p.material.per_area.is_soft(); });
  impl.radii.assign(static_cast<std::size_t>(model.num_bodies()), 0.0);
  for (int i = 0; i < static_cast<int>(geometries.size()); ++i) {
    const ShapeType type = geometries[i].shape.type;
    (type == ShapeType::kPlane     ? impl.planes
     : type == ShapeType::kTerrain ? impl.terrains
                                   : impl.solids)
        .push_back(i);
    impl.enclosures.push_back(enclose(geometries[i].shape));
    impl.corners.push_back(corners_of(geometries[i].shape));
    impl.placements.push_back({geometries[i].X_BG, geometries[i].body, type});
    const Enclosure& around = impl.enclosures.back();
    double& radius = impl.radii[geometries[i].body];
    if (type != ShapeType::kPlane)
      radius = std::max(radius, (geometries[i].X_BG * around.center).norm() + around.radius);
  }
  impl.X_WG.resize(geometries.size());
  impl.boxes.assign(impl.solids.size(), kNowhere);
  impl.group_solids(model);
  const std::vector<Pose> X_WB = default_poses(model);
  const std::vector<double> margin(X_WB.size(), 0.0);
  for (const auto& [a, b] : find_close_pairs(X_WB, margin)) {
    const int assembly = geometries[a].assembly;
    if (assembly < 0 || assembly != geometries[b].assembly || impl.filter.included(a, b)) continue;
    impl.find_contacts(a, b, {0.0, 0.0});
    if (impl.manifold.size > 0) impl.overlapping.emplace_back(a, b);
  }
  impl.filter.exclude(impl.overlapping);
  impl.list_group_pairs();
  // Resets the broad phase: capacity for the default pose, where all bodies may coincide, is
  // useless.
  impl.broadphase = Broadphase();
}

Collider::~Collider() = default;
Collider::Collider(Collider&&) noexcept = default;
Collider& Collider::operator=(Collider&&) noexcept = default;

std::span<const std::pair<int, int>> Collider::find_close_pairs(std::span<const Pose> X_WB,
                                                                std::span<const double> margin,
                                                                std::span<const char> idle) {
  impl_->body_poses = X_WB;
  impl_->margins = margin;
  impl_->idle = idle;
  impl_->place();
  impl_->find_pairs();
  return impl_->pairs;
}

void Collider::compute_candidates(std::span<const Pose> X_WB, std::span<const double> margin,
                                  std::vector<Candidate>& out, std::span<const double> travel,
                                  std::span<const char> idle, const BodyMotions& motions) {
  out.clear();
  const BodyPlaces at{X_WB, margin, travel, motions};
  for (const auto& pair : find_close_pairs(X_WB, margin, idle)) add_candidates(at, pair, out);
}

void Collider::add_candidates(const BodyPlaces& at, const std::pair<int, int>& pair,
                              std::vector<Candidate>& out) {
  Impl& impl = *impl_;
  const auto& [X_WB, margin, travel, motions] = at;
  const auto [a, b] = pair;
  const Geometry& ga = impl.geometries[a];
  const Geometry& gb = impl.geometries[b];
  const double reach = margin[ga.body] + margin[gb.body];
  const double way = travel.empty() ? 0.0 : travel[ga.body] + travel[gb.body];
  // Without travel, contacts for any rotation are wanted.
  const double turn =
      travel.empty() ? std::numeric_limits<double>::infinity() : impl.turn(ga.body, gb.body, reach);
  int seen = 0;
  if (motions.velocity.empty() || !impl.may_pass(a, b)) {
    impl.find_contacts(a, b, {reach, turn});
  } else {
    seen = impl.find_moving_contacts(a, b, {reach, turn}, impl.motion_of(X_WB, a, b, motions));
  }
  if (!travel.empty()) {
    add_corner_contacts({ga.shape, impl.corners[a], impl.X_WG[a]},
                        {gb.shape, impl.corners[b], impl.X_WG[b]}, reach, way, impl.manifold);
  }
  const std::size_t begin = out.size();
  impl.find_areas(a, b, at);
  double hidden = 0.0;
  for (int i = 0; i < impl.manifold.size; ++i) {
    const ContactPoint& p = impl.manifold.points[i];
    if (i >= seen && impl.is_hidden(a, b, p)) {
      hidden += impl.areas[i];
      continue;
    }
    Candidate& candidate = out.emplace_back();
    candidate.area = impl.areas[i];
    candidate.geometry_a = a;
    candidate.geometry_b = b;
    candidate.position = p.position;
    candidate.normal = p.normal;
    candidate.gap = p.gap;
  }
  // The others bear the part of the patch at points that another piece of the body hides.
  if (hidden > 0.0)
    for (std::size_t i = begin; i < out.size(); ++i)
      out[i].area += hidden / static_cast<double>(out.size() - begin);
  if (!travel.empty() && impl.manifold.size > 0) impl.add_core_contacts(a, b, reach, way, out);
}

Collider::Whereabouts Collider::whereabouts(int geometry_a, int geometry_b) const {
  const Impl& impl = *impl_;
  const auto type = [&](int i) { return impl.placements[i].type; };
  const auto is_ground = [&](int i) {
    return type(i) == ShapeType::kPlane || type(i) == ShapeType::kTerrain;
  };
  int smaller = geometry_a, other = geometry_b;
  if (is_ground(smaller) ||
      (!is_ground(other) && impl.enclosures[other].radius < impl.enclosures[smaller].radius))
    std::swap(smaller, other);
  const Enclosure& around = impl.enclosures[smaller];
  const Pose& X = impl.X_WG[smaller];
  const double gap = type(other) == ShapeType::kTerrain ? 0.0
                     : type(other) == ShapeType::kPlane
                         ? height_above(impl.X_WG[other], around, X)
                         : separation(around, X, impl.enclosures[other], impl.X_WG[other]);
  return {gap, X * around.center, around.radius};
}

std::optional<PairMotion> Collider::pair_motion(std::span<const Pose> X_WB, int geometry_a,
                                                int geometry_b, const BodyMotions& motions) const {
  if (!impl_->may_pass(geometry_a, geometry_b)) return std::nullopt;
  return impl_->motion_of(X_WB, geometry_a, geometry_b, motions);
}

const std::vector<std::pair<int, int>>& Collider::overlapping_pairs() const {
  return impl_->overlapping;
}

bool Collider::may_touch(int a, int b) const { return impl_->filter.enabled(a, b); }

int Collider::num_enabled_pairs() const { return impl_->filter.num_enabled_pairs(); }

int Collider::num_joined_pairs() const { return impl_->filter.num_joined_pairs(); }

}  // namespace counterpoint::collision
