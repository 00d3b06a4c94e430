#include "counterpoint/engine/constraints/contact_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/constraints/parked_contacts.h"

namespace counterpoint {
namespace {

/// A body whose travel within a step exceeds kFastTravel times resting_reach passes it on to the
/// bodies that it may strike in that step, over at most kMaxRounds rounds of collision search.
constexpr double kFastTravel = 4.0;
constexpr int kMaxRounds = 4;

/// Contacts of balls, capsules and planes have formulas that are cheaper than the bounds of
/// FarPair.
bool is_cheap(const Geometry& a, const Geometry& b) {
  const auto is = [](const Geometry& g, ShapeType type) { return g.shape.type == type; };
  const auto round = [&](const Geometry& g) {
    return is(g, ShapeType::kSphere) || is(g, ShapeType::kCapsule);
  };
  return (round(a) || is(a, ShapeType::kPlane)) && (round(b) || is(b, ShapeType::kPlane));
}

/// Upper bounds of the sliding coefficient [-] and of the torsional and rolling ones [m] of a pair.
struct FrictionBound {
  double sliding, turning;
};

/// The coefficients of a pair are at most the larger ones of its surfaces (combine_materials),
/// unless it has its own.
FrictionBound bound_friction(const Model& model, const std::pair<int, int>& pair) {
  const auto of = [](const Material& m) {
    return FrictionBound{m.most_friction(), std::max(m.torsional_friction, m.rolling_friction)};
  };
  if (const PairMaterial* own = model.pair_materials().empty()
                                    ? nullptr
                                    : model.find_pair_material(pair.first, pair.second))
    return of(own->material);
  const FrictionBound a = of(model.geometries()[pair.first].material),
                      b = of(model.geometries()[pair.second].material);
  return {std::max(a.sliding, b.sliding), std::max(a.turning, b.turning)};
}

}  // namespace

bool parks_contacts(const SimulationOptions& options) {
  return options.integrator == Integrator::kSemiImplicitEuler;
}

bool may_deactivate_contacts(const SimulationOptions& options) {
  return parks_contacts(options) && options.contact.smoothing <= kHardSmoothing;
}

Material active_material(Material pair, EffectSet effects) {
  if (!effects.has(Effect::kStiffness)) {
    pair.stiffness = std::numeric_limits<double>::infinity();
    pair.per_area = Spring();
  }
  if (!effects.has(Effect::kFriction)) pair.friction = 0.0;
  if (!effects.has(Effect::kFrictionDirections) && pair.is_directional())
    pair = pair.without_direction();
  if (!effects.has(Effect::kStaticFriction)) pair.static_friction = 0.0;
  if (!effects.has(Effect::kTorsionalFriction)) pair.torsional_friction = 0.0;
  if (!effects.has(Effect::kRollingFriction)) pair.rolling_friction = 0.0;
  if (!effects.has(Effect::kRestitution)) pair.restitution = 0.0;
  return pair;
}

ContactSearch::ContactSearch(const Model& model, std::vector<double> inverse_mass)
    : inverse_mass_(std::move(inverse_mass)),
      collider_(model),
      radius_(collision::body_radii(model)),
      travel_(model.num_bodies(), 0.0),
      slack_(model.num_bodies(), 0.0),
      margin_(model.num_bodies(), 0.0),
      in_reach_(model.num_trees(), 0),
      turn_share_(Eigen::ArrayXd::Zero(model.num_bodies())),
      fastest_point_(turn_share_) {}

void ContactSearch::forget() { std::fill(in_reach_.begin(), in_reach_.end(), 0); }

/// Sets the margins within which bodies may touch in a step, and the bounds on their motion.
void ContactSearch::set_margins(const StepContext& at, const Kinematics& data, SleepMask idle) {
  const Model& model = at.model;
  const ContactOptions& contact = at.options.contact;
  const double h = at.h();
  const double fall = at.effects.has(Effect::kGravity) ? h * h * model.gravity().norm() : 0.0;
  const double reach = resting_reach(contact, h);
  slack_[0] = 0.5 * reach;
  for (int b = 1; b < model.num_bodies(); ++b) {
    fastest_point_[b] = data.V[b].linear.squaredNorm();
    turn_share_[b] = data.V[b].angular.squaredNorm();
  }
  fastest_point_ = fastest_point_.sqrt() +  // one vectorized square root
                   turn_share_.sqrt() * Eigen::ArrayXd::Map(radius_.data(), model.num_bodies());
  turn_share_ *= 0.5 * h * h;
  for (const Tree& tree : model.trees()) {
    double fastest = 0.0;
    for (int b = tree.body_begin; b < tree.body_end; ++b)
      fastest = std::max(fastest, fastest_point_[b]);
    for (int b = tree.body_begin; b < tree.body_end; ++b) {
      travel_[b] = kImpactSpeedUp * h * fastest_point_[b];
      // An impact elsewhere in its tree may set a resting body in motion.
      const double kick = std::max(0.0, h * fastest - travel_[b]);
      slack_[b] = 0.5 * std::min(contact.margin, reach + 2.0 * kick);
      travel_[b] += fall;
    }
  }
  const auto add_up = [&] {
    for (int b = 0; b < model.num_bodies(); ++b) margin_[b] = slack_[b] + travel_[b];
  };
  const double fast = kFastTravel * reach, own_fast = kFastTravel * contact.margin;
  const double least = model.num_trees() == 1 ? own_fast : fast;
  const bool any_fast =
      std::any_of(travel_.begin(), travel_.end(), [&](double travel) { return !(travel < least); });
  add_up();
  for (int round = 0; any_fast && round < kMaxRounds; ++round) {
    const auto close = collider_.find_close_pairs(data.X_WB, margin_, idle.bodies);
    if (!spread_travel(model, close, fast, own_fast)) break;
    add_up();
  }
}

/// Gives the travel of a fast body to the bodies that it may strike within the step, and to their
/// whole trees, which may become as fast. close: pairs of geometries. A body is fast from
/// `threshold` [m] on, within its own tree from own_threshold, since slack_ already covers impacts
/// elsewhere in the tree. Returns false if nothing changed.
bool ContactSearch::spread_travel(const Model& model, std::span<const std::pair<int, int>> close,
                                  double threshold, double own_threshold) {
  bool changed = false;
  for (bool again = true; again;) {
    again = false;
    std::pair last(-1, -1);  // solids of the same two bodies follow each other
    for (const auto& [a, b] : close) {
      const int bodies[2] = {model.geometries()[a].body, model.geometries()[b].body};
      if (last == std::pair(bodies[0], bodies[1])) continue;
      last = {bodies[0], bodies[1]};
      const double travel = std::max(travel_[bodies[0]], travel_[bodies[1]]);
      if (travel < threshold) continue;
      const int fast = travel_[bodies[0]] >= travel_[bodies[1]] ? bodies[0] : bodies[1];
      const int fast_tree = model.body(fast).tree;
      for (const int body : bodies) {
        if (body == 0) continue;
        const int index = model.body(body).tree;
        if (index == fast_tree && travel < own_threshold) continue;
        const Tree& tree = model.trees()[index];
        for (int k = tree.body_begin; k < tree.body_end; ++k) {
          if (travel_[k] >= travel) continue;
          travel_[k] = travel;
          in_reach_[index] = 1;
          again = changed = true;
        }
      }
    }
  }
  return changed;
}

/// Bounds a pair of geometries from their bounding volumes.
FarPair ContactSearch::locate(const Model& model, const std::pair<int, int>& pair,
                              const collision::Collider::Whereabouts& where, EffectSet effects,
                              const Kinematics& data) const {
  FarPair far;
  far.geometries = pair;
  far.body_a = model.geometries()[pair.first].body;
  far.body_b = model.geometries()[pair.second].body;
  far.gap = where.gap;
  far.middle = where.middle;
  far.radius = where.radius;
  const FrictionBound friction = bound_friction(model, pair);
  far.slip = std::sqrt(1.0 + friction.sliding * friction.sliding);
  far.spin = friction.turning;
  if (effects.has(Effect::kSurfaceMotion))
    for (const int geometry : {pair.first, pair.second})
      far.surface += model.geometries()[geometry].material.surface_velocity.norm();
  // Contact points are within radius + gap of the centre.
  for (const int body : {far.body_a, far.body_b}) {
    if (body == 0) continue;
    const double share = turn_share_[body];
    far.turn += share * ((far.middle - data.X_WB[body].translation).norm() + far.radius);
    far.turn_slope += share;
  }
  return far;
}

std::vector<collision::Candidate>& ContactSearch::find(const StepContext& at,
                                                       const Kinematics& data, SleepMask idle,
                                                       std::vector<FarPair>& far) {
  const Model& model = at.model;
  const double h = at.h();
  forget();
  set_margins(at, data, idle);
  const bool parks = parks_contacts(at.options);
  const double near = parking_gap(at.options.contact, h);
  candidates_.clear();
  const collision::BodyPlaces places{data.X_WB, margin_, travel_, {data.V, inverse_mass_, h}};
  for (const auto& pair : collider_.find_close_pairs(data.X_WB, margin_, idle.bodies)) {
    const Geometry& a = model.geometries()[pair.first];
    const Geometry& b = model.geometries()[pair.second];
    // Skips pairs that cannot move at all.
    if (!(inverse_mass_[a.body] + inverse_mass_[b.body] > 0.0)) continue;
    if (!is_cheap(a, b)) {
      const auto where = collider_.whereabouts(pair.first, pair.second);
      if (where.gap >= margin_[a.body] + margin_[b.body]) continue;
      if (parks && !idle.sleeps(a.body) && !idle.sleeps(b.body)) {
        const FarPair apart = locate(model, pair, where, at.effects, data);
        if (is_far(apart, near, h, data)) {
          far.push_back(apart);
          continue;
        }
      }
    }
    collider_.add_candidates(places, pair, candidates_);
  }
  return candidates_;
}

std::vector<collision::Candidate>& ContactSearch::find_pair(const StepContext& at,
                                                            const Kinematics& data,
                                                            const std::pair<int, int>& geometries) {
  candidates_.clear();
  collider_.add_candidates({data.X_WB, margin_, travel_, {data.V, inverse_mass_, at.h()}},
                           geometries, candidates_);
  return candidates_;
}

}  // namespace counterpoint
