// Selects the pairs of geometries that a step examines, and makes each of their contacts a
// constraint with rows, a parked contact, or part of a far pair (parked_contacts.h).
#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/constraints/parked_contacts.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

/// A body whose travel within a step exceeds kFastTravel times resting_reach passes it on to the
/// bodies that it may strike in that step, over at most kMaxRounds rounds of collision search.
constexpr double kFastTravel = 4.0;
constexpr int kMaxRounds = 4;

/// Only semi-implicit Euler parks contacts: the midpoint rule solves for a velocity at other poses
/// than q.
bool parks_contacts(const SimulationOptions& options) {
  return options.integrator == Integrator::kSemiImplicitEuler;
}

/// Returns the material of a pair with the coefficients of inactive effects set to zero.
Material surfaces(Material pair, EffectSet effects) {
  if (!effects.has(Effect::kFriction)) pair.friction = 0.0;
  if (!effects.has(Effect::kTorsionalFriction)) pair.torsional_friction = 0.0;
  if (!effects.has(Effect::kRollingFriction)) pair.rolling_friction = 0.0;
  if (!effects.has(Effect::kRestitution)) pair.restitution = 0.0;
  return pair;
}

void count_contact(const Material& pair, EffectCounts& counts) {
  if (pair.restitution > 0.0) counts.add(Effect::kRestitution);
  if (!(pair.friction > 0.0)) return;
  counts.add(Effect::kFriction);
  if (pair.torsional_friction > 0.0) counts.add(Effect::kTorsionalFriction);
  if (pair.rolling_friction > 0.0) counts.add(Effect::kRollingFriction);
}

/// Contacts of balls, capsules and planes have formulas that are cheaper than the bounds of
/// FarPair.
bool is_cheap(const Geometry& a, const Geometry& b) {
  const auto is = [](const Geometry& g, ShapeType type) { return g.shape.type == type; };
  const auto round = [&](const Geometry& g) {
    return is(g, ShapeType::kSphere) || is(g, ShapeType::kCapsule);
  };
  return (round(a) || is(a, ShapeType::kPlane)) && (round(b) || is(b, ShapeType::kPlane));
}

}  // namespace

/// Sets the margins within which bodies may touch in a step, and the bounds on their motion.
void ConstraintFinder::set_margins(const StepContext& at, const Kinematics& data, SleepMask idle) {
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
bool ConstraintFinder::spread_travel(const Model& model, std::span<const std::pair<int, int>> close,
                                     double threshold, double own_threshold) {
  bool changed = false;
  for (bool again = true; again;) {
    again = false;
    for (const auto& [a, b] : close) {
      const int bodies[2] = {model.geometries()[a].body, model.geometries()[b].body};
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

FarPair ConstraintFinder::locate(const Model& model, const std::pair<int, int>& pair,
                                 EffectSet effects, const Kinematics& data) const {
  const collision::Collider::Whereabouts where = collider_.whereabouts(pair.first, pair.second);
  FarPair far;
  far.geometries = pair;
  far.body_a = model.geometries()[pair.first].body;
  far.body_b = model.geometries()[pair.second].body;
  far.gap = where.gap;
  far.middle = where.middle;
  far.radius = where.radius;
  const Material material = surfaces(model.pair_material(pair.first, pair.second), effects);
  far.slip = std::sqrt(1.0 + material.friction * material.friction);
  far.spin = std::max(material.torsional_friction, material.rolling_friction);
  // Contact points are within radius + gap of the centre.
  for (const int body : {far.body_a, far.body_b}) {
    if (body == 0) continue;
    const double share = turn_share_[body];
    far.turn += share * ((far.middle - data.X_WB[body].translation).norm() + far.radius);
    far.turn_slope += share;
  }
  return far;
}

void ConstraintFinder::find_candidates(const StepContext& at, const Kinematics& data,
                                       ConstraintSet& out, SleepMask idle) {
  const Model& model = at.model;
  const double h = at.h();
  set_margins(at, data, idle);
  const bool parks = parks_contacts(at.options);
  const double near = parking_gap(at.options.contact, h);
  candidates_.clear();
  const collision::BodyPlaces places{data.X_WB, margin_, travel_, {data.V, weights_.contact, h}};
  for (const auto& pair : collider_.find_close_pairs(data.X_WB, margin_, idle.bodies)) {
    const Geometry& a = model.geometries()[pair.first];
    const Geometry& b = model.geometries()[pair.second];
    // Skips pairs that cannot move at all.
    if (!(weights_.contact[a.body] + weights_.contact[b.body] > 0.0)) continue;
    if (!is_cheap(a, b)) {
      const FarPair far = locate(model, pair, at.effects, data);
      if (far.gap >= margin_[a.body] + margin_[b.body]) continue;
      if (parks && !idle.sleeps(a.body) && !idle.sleeps(b.body) && is_far(far, near, h, data)) {
        out.far.push_back(far);
        continue;
      }
    }
    collider_.add_candidates(places, pair, candidates_);
  }
}

bool ConstraintFinder::find_reached_contacts(const StepContext& at, const Reached& w,
                                             const Kinematics& data, ConstraintSet& out) {
  if (out.parked.empty() && out.far.empty()) return false;
  const ContactOptions& options = at.options.contact;
  const double h = at.h();
  if (w.of_bodies == nullptr) compute_body_velocities(at.model, w.velocity, data, V_);
  const std::vector<Motion>& V = w.of_bodies != nullptr ? *w.of_bodies : V_;
  std::erase_if(out.far, [&](const FarPair& far) {
    if (stays_far(far, options, h, V, data)) return false;
    park_contacts_of(at, far, data, out);
    return true;
  });
  return std::erase_if(out.parked, [&](const ParkedContact& parked) {
           if (!is_reached(parked, options, h, V, data)) return false;
           PairConstraint contact;
           make_contact(at, data, parked, contact);
           if (!is_reached(by_law(parked, contact, h), options, h, V, data)) return false;
           give_rows(at, parked, contact, out);
           return true;
         }) > 0;
}

void ConstraintFinder::unpark_all(const StepContext& at, const Kinematics& data,
                                  ConstraintSet& out) {
  for (const FarPair& far : out.far) park_contacts_of(at, far, data, out);
  out.far.clear();
  for (const ParkedContact& parked : out.parked) {
    PairConstraint contact;
    make_contact(at, data, parked, contact);
    give_rows(at, parked, contact, out);
  }
  out.parked.clear();
}

/// Inserts the contacts of a far pair into the parked ones, in the order they would have had from
/// the start.
void ConstraintFinder::park_contacts_of(const StepContext& at, const FarPair& far,
                                        const Kinematics& data, ConstraintSet& out) {
  candidates_.clear();
  collider_.add_candidates({data.X_WB, margin_, travel_, {data.V, weights_.contact, at.h()}},
                           far.geometries, candidates_);
  const auto behind = [&](const ParkedContact& parked) {
    const collision::Candidate& c = parked.candidate;
    return std::pair(c.geometry_a, c.geometry_b) > far.geometries;
  };
  auto place = std::find_if(out.parked.begin(), out.parked.end(), behind) - out.parked.begin();
  for (collision::Candidate& candidate : candidates_) {
    move_to_meeting(at.model, candidate);
    out.parked.insert(out.parked.begin() + place++, describe(at, data, candidate));
  }
}

/// Adds a parked contact as a constraint, after the other contacts and before the closures.
void ConstraintFinder::give_rows(const StepContext& at, const ParkedContact& parked,
                                 PairConstraint& contact, ConstraintSet& out) {
  friction_slip_.apply(at.options, speed_, contact);
  out.pairs.insert(out.pairs.begin() + static_cast<std::ptrdiff_t>(out.contacts.size()), contact);
  out.contacts.push_back(parked.candidate);
}

/// Returns by how much farther along n [m] the point at `arm` from a body's origin moves within the
/// step than h times its velocity, if the body keeps its angular velocity.
double ConstraintFinder::turning_advance(const Vector3& n, const Vector3& arm, double h, int body,
                                         const Kinematics& data) {
  if (body == 0) return 0.0;
  const Vector3 angle = h * data.V[body].angular;
  if (!turn_known_[body]) {
    turn_known_[body] = 1;
    turn_[body] = quaternion_exp(angle);
  }
  return n.dot(turn_[body] * arm - arm - angle.cross(arm));
}

/// Returns the gap that a contact may close by velocity times h: the given gap less the distance by
/// which rotation brings the surfaces closer than that product, as for the descending end of a rod.
double ConstraintFinder::gap_less_turning(const PairConstraint& contact, double gap, double h,
                                          const Kinematics& data) {
  if (!(gap > 0.0)) return gap;
  const auto advance = [&](int body) {
    return turning_advance(contact.frame.col(0), contact.position - data.X_WB[body].translation, h,
                           body, data);
  };
  const double closer = advance(contact.body_a) - advance(contact.body_b);
  return std::max(gap - std::max(closer, 0.0), 0.0);
}

const Material& ConstraintFinder::material_of(const Model& model, EffectSet effects,
                                              const collision::Candidate& candidate) {
  // Candidates are sorted by pair.
  if (const std::pair pair(candidate.geometry_a, candidate.geometry_b); pair != material_of_) {
    material_ = surfaces(model.pair_material(pair.first, pair.second), effects);
    material_of_ = pair;
  }
  return material_;
}

/// Moves the contact point to the present surface of the lighter body, or near it, where the bodies
/// will meet: halfway across a gap of decimetres, friction would turn a small body with a lever arm
/// it does not have.
void ConstraintFinder::move_to_meeting(const Model& model, collision::Candidate& candidate) const {
  const double a = weights_.contact[model.geometries()[candidate.geometry_a].body];
  const double b = weights_.contact[model.geometries()[candidate.geometry_b].body];
  const double towards_b = b / (a + b) - 0.5;
  candidate.position += towards_b * std::max(candidate.gap, 0.0) * candidate.normal;
}

/// Returns a candidate, already moved to the meeting point, as a contact that may be parked.
ParkedContact ConstraintFinder::describe(const StepContext& at, const Kinematics& data,
                                         const collision::Candidate& candidate) {
  const Model& model = at.model;
  const double h = at.h();
  const int a = model.geometries()[candidate.geometry_a].body;
  const int b = model.geometries()[candidate.geometry_b].body;
  ParkedContact out{candidate, a, b};
  out.velocity = relative_velocity_at(candidate.position, a, b, data, data.V);
  // Both surfaces are within the gap of the contact point.
  out.gap = candidate.gap;
  for (const int body : {a, b})
    if (body != 0) out.gap -= turn_share_[body] * (radius_[body] + std::max(candidate.gap, 0.0));
  const bool meets = out.gap + h * candidate.normal.dot(out.velocity) <= 0.0;
  if (!has_friction(at.options.contact, out.gap, meets)) return out;
  const Material& material = material_of(model, at.effects, candidate);
  out.slip = material.friction;
  out.spin = std::max(material.torsional_friction, material.rolling_friction);
  return out;
}

/// Fills `contact`, default-constructed, from a candidate; returns its present velocity in its
/// rows.
Vector3 ConstraintFinder::make_contact(const StepContext& at, const Kinematics& data,
                                       const ParkedContact& open, PairConstraint& contact) {
  const Model& model = at.model;
  const SimulationOptions& options = at.options;
  const double h = at.h();
  const collision::Candidate& candidate = open.candidate;
  const Geometry& a = model.geometries()[candidate.geometry_a];
  const Geometry& b = model.geometries()[candidate.geometry_b];
  const double alpha = weights_.contact[a.body] + weights_.contact[b.body];
  const Material& material = material_of(model, at.effects, candidate);
  contact.body_a = a.body;
  contact.body_b = b.body;
  contact.position = candidate.position;
  const Matrix3 t1_t2_n = frame_from_normal(candidate.normal);
  contact.frame << t1_t2_n.col(2), t1_t2_n.col(0), t1_t2_n.col(1);
  const Vector3 v = contact.frame.transpose() * open.velocity;
  const double gap = gap_less_turning(contact, candidate.gap, h, data);
  contact.gap_bias = gap_bias(options.contact, h, gap);
  const Bounce bounce =
      find_contact_bounce(model, options, at.effects, data, {material, contact, gap, v});
  if (bounce.happens && gap > 0.0) contact.impact_time = bounce.time;
  set_contact_law(law_options(options, is_wedged(contact)), h,
                  {material, alpha, gap, v, bounce, is_round(model, a, b)}, contact.law);
  return v;
}

void ConstraintFinder::find_contacts(const StepContext& at, const Kinematics& data,
                                     ConstraintSet& out, EffectCounts& counts, SleepMask idle) {
  const Model& model = at.model;
  const double h = at.h();
  find_candidates(at, data, out, idle);
  find_crowds(at);
  const bool parks = parks_contacts(at.options);
  std::fill(turn_known_.begin(), turn_known_.end(), 0);
  material_of_ = {-1, -1};
  const double near = parking_gap(at.options.contact, h);
  for (collision::Candidate& candidate : candidates_) {
    move_to_meeting(model, candidate);
    count_contact(material_of(model, at.effects, candidate), counts);
    const ParkedContact open = describe(at, data, candidate);
    // A contact with rows wakes sleeping bodies.
    const bool may_park =
        parks && candidate.gap >= near && !idle.sleeps(open.body_a) && !idle.sleeps(open.body_b);
    if (may_park && !is_near(open, near, h)) {
      out.parked.push_back(open);
      continue;
    }
    PairConstraint& contact = out.pairs.emplace_back();
    const Vector3 v = make_contact(at, data, open, contact);
    if (may_park && !is_near(by_law(open, contact, h), near, h)) {
      out.parked.push_back(open);
      out.pairs.pop_back();
      continue;
    }
    out.max_penetration = std::max(out.max_penetration, -candidate.gap);
    out.contacts.push_back(candidate);
    speed_.push_back(std::sqrt(v[1] * v[1] + v[2] * v[2]));
  }
  // Reserves room for the contacts that may get rows later: memory then depends on the number of
  // candidates only.
  const size_t later = out.parked.size() + out.far.size();
  out.parked.reserve(later);
  out.contacts.reserve(out.contacts.size() + later);
  speed_.reserve(candidates_.size());
  out.pairs.reserve(out.pairs.size() + later + model.closures().size());
}

}  // namespace counterpoint
