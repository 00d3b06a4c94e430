#include "counterpoint/collision/collider.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/collision/broadphase/broadphase.h"
#include "counterpoint/collision/broadphase/default_poses.h"
#include "counterpoint/collision/broadphase/pair_filter.h"
#include "counterpoint/collision/pairs/corner_contacts.h"
#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/collision/pairs/pair_motion.h"
#include "counterpoint/collision/pairs/terrain_contacts.h"
#include "counterpoint/collision/shapes/enclosure.h"

namespace counterpoint::collision {
namespace {

bool meet(const Bounds& a, const Bounds& b) {
  return (a.low.array() <= b.high.array()).all() && (b.low.array() <= a.high.array()).all();
}

}  // namespace
struct Collider::Impl {
  explicit Impl(const Model& model) : geometries(model.geometries()), filter(model) {}

  void place(std::span<const Pose> X_WB, std::span<const double> margin);
  void find_pairs(std::span<const double> margin);
  void add_plane_pairs(int plane, std::span<const double> margin);
  void add_terrain_pairs(int terrain, std::span<const double> margin);
  void merge_ground_pairs();
  double turn(int a, int b, double margin) const;
  void group_by_body(const Model& model);
  void find_pairs_by_body();
  bool list_awake();
  void find_awake_pairs();
  bool is_idle(int i) const { return !idle.empty() && idle[placements[i].body]; }
  bool both_idle(int a, int b) const { return is_idle(a) && is_idle(b); }
  void find_contacts(int a, int b, const PairQuery& query);
  bool may_pass(int a, int b) const;
  PairMotion motion_of(std::span<const Pose> X_WB, int a, int b, const BodyMotions& motions) const;
  void find_moving_contacts(int a, int b, PairQuery query, const PairMotion& motion);
  void add_core_contacts(int a, int b, double margin, double travel, std::vector<Candidate>& out);

  // What every step reads of each geometry; all that a Geometry holds is several cache lines more.
  struct Placement {
    Pose X_BG;
    int body;
    ShapeType type;
  };

  // A copy: nothing then depends on where the model lives.
  std::vector<Geometry> geometries;
  std::vector<Placement> placements;
  PairFilter filter;
  Broadphase broadphase;
  std::vector<Enclosure> enclosures;
  std::vector<Corners> corners;
  std::vector<double> radii;  // by body, of its shapes about its origin; of planes 0
  std::vector<int> planes, terrains, solids;  // geometry indices
  std::vector<std::pair<int, int>> overlapping;
  // Of few bodies with several solids each: the indices of the solids body by body, where each
  // body's begin (and the end), and the pairs of bodies that hold enabled pairs.
  std::vector<int> by_body, begin_of_body;
  std::vector<std::pair<int, int>> body_pairs;
  // Scratch.
  std::span<const char> idle;  // by body; empty: none
  std::vector<Pose> X_WG;
  std::vector<Bounds> boxes;  // of solids
  std::vector<Bounds> body_boxes;
  std::vector<std::pair<int, int>> pairs;
  std::vector<int> awake;                                      // indices of solids
  std::vector<std::pair<int, int>> solid_pairs, ground_pairs;  // before they join the others
  TerrainContacts terrain_contacts;
  Manifold manifold;
};

void Collider::Impl::place(std::span<const Pose> X_WB, std::span<const double> margin) {
  X_WG.resize(geometries.size());
  for (std::size_t i = 0; i < geometries.size(); ++i) {
    if (is_idle(static_cast<int>(i))) continue;
    X_WG[i] = X_WB[placements[i].body] * placements[i].X_BG;
  }
  boxes.resize(solids.size());
  for (std::size_t k = 0; k < solids.size(); ++k) {
    const int i = solids[k];
    if (is_idle(i)) continue;
    boxes[k] = bounds(placements[i].type, enclosures[i], X_WG[i], margin[placements[i].body]);
  }
}

void Collider::Impl::add_plane_pairs(int plane, std::span<const double> margin) {
  const Vector3 normal = X_WG[plane].rotation.col(2);
  const double offset = normal.dot(X_WG[plane].translation);
  const double plane_margin = margin[geometries[plane].body];
  if (!std::isfinite(offset)) return;
  const Vector3 up = normal.cwiseMax(0.0), down = normal.cwiseMin(0.0);
  for (std::size_t k = 0; k < solids.size(); ++k) {
    // The lowest corner of the box, which has the solid's margin, first: most are high above.
    if (up.dot(boxes[k].low) + down.dot(boxes[k].high) >= offset + plane_margin) continue;
    const int i = solids[k];
    if (both_idle(plane, i)) continue;
    const double height = normal.dot(X_WG[i] * enclosures[i].center) - offset;
    const double reach =
        std::min(enclosures[i].radius,
                 (X_WG[i].rotation.transpose() * normal).cwiseAbs().dot(enclosures[i].half));
    if (height - reach >= plane_margin + margin[placements[i].body]) continue;
    if (is_sound(boxes[k]) && filter.enabled(plane, i)) {
      ground_pairs.emplace_back(std::min(plane, i), std::max(plane, i));
    }
  }
}

// A terrain would be a neighbour of all in the broad phase.
void Collider::Impl::add_terrain_pairs(int terrain, std::span<const double> margin) {
  const Geometry& g = geometries[terrain];
  const Bounds all = bounds(g.shape.type, enclosures[terrain], X_WG[terrain], margin[g.body]);
  if (!is_sound(all)) return;
  for (std::size_t k = 0; k < solids.size(); ++k) {
    const int i = solids[k];
    if (both_idle(terrain, i)) continue;
    if ((boxes[k].low.array() > all.high.array()).any() ||
        (boxes[k].high.array() < all.low.array()).any()) {
      continue;
    }
    if (is_sound(boxes[k]) && filter.enabled(terrain, i)) {
      ground_pairs.emplace_back(std::min(terrain, i), std::max(terrain, i));
    }
  }
}

// How far a body may turn while its surface goes as far as the margin [rad].
double Collider::Impl::turn(int a, int b, double margin) const {
  double radius = std::numeric_limits<double>::infinity();
  for (const int body : {a, b})
    if (body != 0) radius = std::min(radius, radii[body]);
  return margin / radius;
}

// Into `manifold`.
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

// Planes and terrains have one normal a place, whoever moves; two balls or capsules have no edges.
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

// Into `manifold`.
void Collider::Impl::find_moving_contacts(int a, int b, PairQuery query, const PairMotion& motion) {
  query.rounding = motion.rounding();
  find_contacts(a, b, query);
  if (manifold.size > 0)
    look_ahead(geometries[a].shape, geometries[b].shape, motion, query, manifold);
}

// Where bodies are few and have many solids, as those of a robot, whole bodies are looked at first.
void Collider::Impl::group_by_body(const Model& model) {
  constexpr std::size_t kMostBodies = 32, kMostSolids = 128;
  if (solids.size() > kMostSolids) return;
  std::vector<std::vector<int>> of_body(static_cast<std::size_t>(model.num_bodies()));
  for (int k = 0; k < static_cast<int>(solids.size()); ++k)
    of_body[static_cast<std::size_t>(placements[solids[k]].body)].push_back(k);
  std::erase_if(of_body, [](const std::vector<int>& list) { return list.empty(); });
  if (of_body.size() > kMostBodies) return;
  begin_of_body = {0};
  for (const std::vector<int>& list : of_body) {
    by_body.insert(by_body.end(), list.begin(), list.end());
    begin_of_body.push_back(static_cast<int>(by_body.size()));
  }
  const auto enabled = [&](int k, int l) { return filter.enabled(solids[k], solids[l]); };
  for (std::size_t i = 0; i < of_body.size(); ++i) {
    for (std::size_t j = i + 1; j < of_body.size(); ++j) {
      const bool any = std::any_of(of_body[i].begin(), of_body[i].end(), [&](int k) {
        return std::any_of(of_body[j].begin(), of_body[j].end(),
                           [&](int l) { return enabled(k, l); });
      });
      if (any) body_pairs.emplace_back(i, j);
    }
  }
  body_boxes.resize(of_body.size());
}

void Collider::Impl::find_pairs_by_body() {
  for (std::size_t i = 0; i < body_boxes.size(); ++i) {
    Bounds all{Vector3::Constant(kFarthest), Vector3::Constant(-kFarthest)};
    for (int at = begin_of_body[i]; at < begin_of_body[i + 1]; ++at) {
      const Bounds& box = boxes[by_body[at]];
      if (!is_sound(box)) continue;
      all.low = all.low.cwiseMin(box.low);
      all.high = all.high.cwiseMax(box.high);
    }
    body_boxes[i] = all;
  }
  solid_pairs.clear();
  for (const auto& [i, j] : body_pairs) {
    if (!meet(body_boxes[i], body_boxes[j])) continue;
    for (int at = begin_of_body[i]; at < begin_of_body[i + 1]; ++at) {
      const int k = by_body[at];
      if (!is_sound(boxes[k]) || !meet(boxes[k], body_boxes[j])) continue;
      for (int to = begin_of_body[j]; to < begin_of_body[j + 1]; ++to) {
        const int l = by_body[to];
        if (is_sound(boxes[l]) && meet(boxes[k], boxes[l]))
          solid_pairs.emplace_back(std::min(k, l), std::max(k, l));
      }
    }
  }
  std::sort(solid_pairs.begin(), solid_pairs.end());
}

// Solids that are not idle. True if they are so few that each may look at all others.
bool Collider::Impl::list_awake() {
  constexpr std::size_t kFew = 32;
  if (idle.empty()) return false;
  awake.clear();
  for (std::size_t k = 0; k < solids.size(); ++k) {
    if (is_idle(solids[k])) continue;
    if (awake.size() == kFew) return false;
    awake.push_back(static_cast<int>(k));
  }
  return true;
}

// What the broad phase would find, but for pairs of idle solids.
void Collider::Impl::find_awake_pairs() {
  solid_pairs.clear();
  for (const int k : awake) {
    const Bounds& box = boxes[k];
    if (!is_sound(box)) continue;
    for (int l = 0; l < static_cast<int>(solids.size()); ++l) {
      if (!meet(box, boxes[l]) || !is_sound(boxes[l])) continue;
      // Of two that are awake the one of the lower index has found the other.
      if (l != k && (l > k || is_idle(solids[l])))
        solid_pairs.emplace_back(std::min(k, l), std::max(k, l));
    }
  }
  std::sort(solid_pairs.begin(), solid_pairs.end());
}

// What keeps the middles of fast slender bodies on their side.
void Collider::Impl::add_core_contacts(int a, int b, double margin, double travel,
                                       std::vector<Candidate>& out) {
  for (const bool of_a : {true, false}) {
    const int mine = of_a ? a : b, other = of_a ? b : a;
    const auto ball = core_ball(geometries[mine].shape, enclosures[mine], X_WG[mine], travel);
    if (!ball) continue;
    const Shape& shape = geometries[other].shape;
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

// Enabled pairs whose enclosures come close, in ascending order.
void Collider::Impl::find_pairs(std::span<const double> margin) {
  if (list_awake()) {
    find_awake_pairs();
  } else if (!body_boxes.empty()) {
    find_pairs_by_body();
  } else {
    broadphase.find_pairs(boxes, solid_pairs);
  }
  pairs.clear();
  for (const auto& [k, l] : solid_pairs) {
    if (both_idle(solids[k], solids[l])) continue;
    if (filter.enabled(solids[k], solids[l])) pairs.emplace_back(solids[k], solids[l]);
  }
  for (const int plane : planes) {
    add_plane_pairs(plane, margin);
    merge_ground_pairs();
  }
  for (const int terrain : terrains) {
    add_terrain_pairs(terrain, margin);
    merge_ground_pairs();
  }
}

// Both lists are ascending. From behind, so that no pair is overwritten before it is moved.
void Collider::Impl::merge_ground_pairs() {
  auto from = static_cast<std::ptrdiff_t>(pairs.size());
  pairs.resize(pairs.size() + ground_pairs.size());
  auto to = pairs.rbegin();
  for (auto next = ground_pairs.rbegin(); next != ground_pairs.rend(); ++to) {
    *to = from > 0 && pairs[from - 1] > *next ? pairs[--from] : *next++;
  }
  ground_pairs.clear();
}

Collider::Collider(const Model& model) : impl_(std::make_unique<Impl>(model)) {
  Impl& impl = *impl_;
  const std::vector<Geometry>& geometries = impl.geometries;
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
  const std::vector<Pose> X_WB = default_poses(model);
  const std::vector<double> margin(X_WB.size(), 0.0);
  impl.place(X_WB, margin);
  impl.find_pairs(margin);
  for (const auto& [a, b] : impl.pairs) {
    const Geometry& ga = geometries[a];
    const Geometry& gb = geometries[b];
    if (ga.instance < 0 || ga.instance != gb.instance) continue;
    impl.find_contacts(a, b, {0.0, 0.0});
    if (impl.manifold.size > 0) impl.overlapping.emplace_back(a, b);
  }
  impl.filter.exclude(impl.overlapping);
  impl.group_by_body(model);
  // Memory of the default pose, where everything may be in one place, is a poor start.
  impl.broadphase = Broadphase();
}

Collider::~Collider() = default;
Collider::Collider(Collider&&) noexcept = default;
Collider& Collider::operator=(Collider&&) noexcept = default;

std::span<const std::pair<int, int>> Collider::find_close_pairs(std::span<const Pose> X_WB,
                                                                std::span<const double> margin,
                                                                std::span<const char> idle) {
  impl_->idle = idle;
  impl_->place(X_WB, margin);
  impl_->find_pairs(margin);
  return impl_->pairs;
}

void Collider::compute_candidates(std::span<const Pose> X_WB, std::span<const double> margin,
                                  std::vector<Candidate>& out, std::span<const double> travel,
                                  std::span<const char> idle, const BodyMotions& motions) {
  out.clear();
  for (const auto& pair : find_close_pairs(X_WB, margin, idle))
    add_candidates(X_WB, margin, pair, travel, motions, out);
}

void Collider::add_candidates(std::span<const Pose> X_WB, std::span<const double> margin,
                              const std::pair<int, int>& pair, std::span<const double> travel,
                              const BodyMotions& motions, std::vector<Candidate>& out) {
  Impl& impl = *impl_;
  const auto [a, b] = pair;
  const Geometry& ga = impl.geometries[a];
  const Geometry& gb = impl.geometries[b];
  const double reach = margin[ga.body] + margin[gb.body];
  const double way = travel.empty() ? 0.0 : travel[ga.body] + travel[gb.body];
  // Who gives no travel asks for all there is.
  const double turn =
      travel.empty() ? std::numeric_limits<double>::infinity() : impl.turn(ga.body, gb.body, reach);
  if (motions.velocity.empty() || !impl.may_pass(a, b)) {
    impl.find_contacts(a, b, {reach, turn});
  } else {
    impl.find_moving_contacts(a, b, {reach, turn}, impl.motion_of(X_WB, a, b, motions));
  }
  if (!travel.empty()) {
    add_corner_contacts({ga.shape, impl.corners[a], impl.X_WG[a]},
                        {gb.shape, impl.corners[b], impl.X_WG[b]}, reach, way, impl.manifold);
  }
  for (int i = 0; i < impl.manifold.size; ++i) {
    const ContactPoint& p = impl.manifold.points[i];
    Candidate& candidate = out.emplace_back();
    candidate.geometry_a = a;
    candidate.geometry_b = b;
    candidate.position = p.position;
    candidate.normal = p.normal;
    candidate.gap = p.gap;
  }
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

int Collider::num_enabled_pairs() const { return impl_->filter.num_enabled_pairs(); }

int Collider::num_joined_pairs() const { return impl_->filter.num_joined_pairs(); }

}  // namespace counterpoint::collision
