#include "counterpoint/engine/constraints/contact_finder.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/constraints/contact_memory.h"
#include "counterpoint/engine/constraints/contact_patch.h"
#include "counterpoint/engine/constraints/parked_contacts.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

void count_contact(const Material& pair, EffectCounts& counts) {
  if (pair.is_soft()) counts.add(Effect::kStiffness);
  if (pair.restitution > 0.0) counts.add(Effect::kRestitution);
  if (!(pair.friction > 0.0)) return;
  counts.add(Effect::kFriction);
  if (pair.friction_at_rest() > pair.friction) counts.add(Effect::kStaticFriction);
  if (pair.is_directional()) counts.add(Effect::kFrictionDirections);
  if (pair.torsional_friction > 0.0) counts.add(Effect::kTorsionalFriction);
  if (pair.rolling_friction > 0.0) counts.add(Effect::kRollingFriction);
}

/// Returns the velocity of the surface of B relative to that of A, from their motion on the bodies,
/// across the normal, in W [m/s].
Vector3 surface_motion(const Geometry& a, const Geometry& b, const Kinematics& data,
                       const Vector3& normal) {
  const auto in_world = [&](const Geometry& g) -> Vector3 {
    return data.X_WB[g.body].rotation * (g.X_BG.rotation * g.material.surface_velocity);
  };
  const Vector3 v = in_world(b) - in_world(a);
  return v - normal.dot(v) * normal;
}

/// Sine of the least angle between a friction axis and the normal.
constexpr double kAlongNormal = 1e-3;

/// Turns the frame of a contact about its normal, so that t1 is the direction of the larger
/// coefficient: the projection of the surface's axis onto the tangent plane, or the direction
/// across that. Sets friction_axis and axis_of_b. Returns false, and changes nothing, where the
/// axis is along the normal: it has no direction in the surface there.
///
/// The friction cone is then an ellipse, and the law gives the force of maximal dissipation,
/// f_i = -mu_i^2 v_i f_N / |(mu_1 v_1, mu_2 v_2)| (Goyal, Ruina and Papadopoulos 1991, "Planar
/// sliding with dry friction").
bool turn_to_friction_axis(const Model& model, const Material& pair,
                           const collision::Candidate& candidate, const Kinematics& data,
                           PairConstraint& contact) {
  const auto [lower, higher] = std::minmax(candidate.geometry_a, candidate.geometry_b);
  const int index = pair.axis_of_second ? higher : lower;
  const Geometry& g = model.geometries()[static_cast<size_t>(index)];
  const Vector3 axis =
      data.X_WB[g.body].rotation * (g.X_BG.rotation * pair.friction_axis.normalized());
  const Vector3 n = contact.frame.col(0), in_plane = axis - n.dot(axis) * n;
  const double length = in_plane.norm();
  if (!(length > kAlongNormal)) return false;
  contact.friction_axis = axis;
  contact.axis_of_b = index == candidate.geometry_b;
  const Vector3 along = in_plane / length;
  contact.frame.col(1) = pair.across_share() > 1.0 ? Vector3(n.cross(along)) : along;
  contact.frame.col(2) = n.cross(Vector3(contact.frame.col(1)));
  return true;
}

/// Adds a contact as a constraint, after the other contacts and before the closures.
void insert_contact(const collision::Candidate& candidate, const PairConstraint& contact,
                    ConstraintSet& out) {
  out.pairs.insert(out.pairs.begin() + static_cast<std::ptrdiff_t>(out.contacts.size()), contact);
  out.contacts.push_back(candidate);
}

/// Share of its design weight, g / alpha, from which on a contact had a force.
constexpr double kNoForce = 1e-6;
/// Share of the weight of the heavier tree that an inactive contact may carry.
constexpr double kOpenWeight = 1e-10;

}  // namespace

ContactFinder::ContactFinder(const Model& model, std::vector<double> inverse_mass)
    : search_(model, std::move(inverse_mass)),
      wedged_(model.num_bodies(), 0),
      crowd_(model.num_bodies(), 0),
      fall_(free_fall(model)),
      friction_slip_(model),
      V_(model.num_bodies()),
      turn_(model.num_bodies()),
      turn_known_(model.num_bodies(), 0),
      tree_mass_(model.num_bodies(), 0.0) {
  for (const Tree& tree : model.trees()) {
    double mass = 0.0;
    for (int b = tree.body_begin; b < tree.body_end; ++b) mass += model.body(b).inertia.mass;
    for (int b = tree.body_begin; b < tree.body_end; ++b) tree_mass_[b] = mass;
  }
}

void ContactFinder::forget() {
  search_.forget();
  speed_.clear();
}

bool ContactFinder::find_reached(const StepContext& at, const Reached& w, const Kinematics& data,
                                 ConstraintSet& out, double ahead) {
  if (out.parked.empty() && out.far.empty() && out.inactive.empty()) return false;
  const ContactOptions& options = at.options.contact;
  const double h = at.h(), time = ahead * h;
  if (w.of_bodies == nullptr) compute_body_velocities(at.model, w.velocity, data, V_);
  const std::vector<Motion>& V = w.of_bodies != nullptr ? *w.of_bodies : V_;
  std::erase_if(out.far, [&](const FarPair& far) {
    if (stays_far(far, options, time, V, data)) return false;
    park_contacts_of(at, far, data);
    return true;
  });
  merge_parked(out);
  const auto reached = std::erase_if(out.parked, [&](const ParkedContact& parked) {
    if (!is_reached(parked, options, time, V, data)) return false;
    PairConstraint contact;
    make_contact(at, data, parked, contact);
    if (!is_reached(by_law(parked, contact, h), options, time, V, data)) return false;
    give_rows(at, parked, contact, out);
    return true;
  });
  const auto closed = std::erase_if(out.inactive, [&](const InactiveContact& open) {
    if (stays_open(open.pair, h, V, data)) return false;
    insert_contact(open.candidate, open.pair, out);
    return true;
  });
  return reached + closed > 0;
}

/// Whether the law of a contact, not softened, gives an impulse of at most kOpenWeight at the body
/// velocities V: at a speed y beyond its onset it gives k / y.
bool ContactFinder::stays_open(const PairConstraint& contact, double h,
                               const std::vector<Motion>& V, const Kinematics& data) const {
  const double mass = std::max(tree_mass_[contact.body_a], tree_mass_[contact.body_b]);
  const double negligible = kOpenWeight * mass * kStandardGravity * h;
  return negligible * speed_beyond_onset(contact, V, data) > contact.law.smoothing;
}

void ContactFinder::set_inactive(const StepContext& at, const Kinematics& data,
                                 const std::vector<RememberedForce>& memory,
                                 ConstraintSet& out) const {
  const size_t count = out.contacts.size();
  if (count == 0 || !may_deactivate_contacts(at.options)) return;
  out.inactive.reserve(count);
  size_t kept = 0;
  for (size_t i = 0; i < count; ++i) {
    const PairConstraint& pair = out.pairs[i];
    const double alpha = search_.inverse_mass(pair.body_a) + search_.inverse_mass(pair.body_b);
    if (stays_open(pair, at.h(), data.V, data) &&
        !(alpha * recall_load(out, i, data, memory) > kNoForce * kStandardGravity)) {
      InactiveContact& open = out.inactive.emplace_back();
      open.candidate = out.contacts[i];
      open.pair = pair;
      continue;
    }
    if (kept < i) {
      out.contacts[kept] = out.contacts[i];
      out.pairs[kept] = pair;
    }
    ++kept;
  }
  out.contacts.resize(kept);
  out.pairs.erase(out.pairs.begin() + static_cast<std::ptrdiff_t>(kept),
                  out.pairs.begin() + static_cast<std::ptrdiff_t>(count));
}

bool ContactFinder::activate_all(ConstraintSet& out) {
  for (const InactiveContact& open : out.inactive) insert_contact(open.candidate, open.pair, out);
  const bool any = !out.inactive.empty();
  out.inactive.clear();
  return any;
}

void ContactFinder::unpark_all(const StepContext& at, const Kinematics& data, ConstraintSet& out) {
  for (const FarPair& far : out.far) park_contacts_of(at, far, data);
  merge_parked(out);
  out.far.clear();
  for (const ParkedContact& parked : out.parked) {
    PairConstraint contact;
    make_contact(at, data, parked, contact);
    give_rows(at, parked, contact, out);
  }
  out.parked.clear();
  activate_all(out);
}

/// Appends the contacts of a far pair to newly_parked_.
void ContactFinder::park_contacts_of(const StepContext& at, const FarPair& far,
                                     const Kinematics& data) {
  for (collision::Candidate& candidate : search_.find_pair(at, data, far.geometries)) {
    move_to_meeting(at.model, candidate);
    newly_parked_.push_back(describe(at, data, candidate));
  }
}

/// Moves newly_parked_ to the parked contacts, in the order they would have had from the start:
/// that of their pairs. Both lists are sorted, and have no pair in common. Merges from the end.
void ContactFinder::merge_parked(ConstraintSet& out) {
  const auto pair_of = [](const ParkedContact& parked) {
    return std::pair(parked.candidate.geometry_a, parked.candidate.geometry_b);
  };
  size_t old = out.parked.size();
  out.parked.resize(old + newly_parked_.size());
  for (auto to = out.parked.rbegin(); !newly_parked_.empty(); ++to) {
    if (old > 0 && pair_of(out.parked[old - 1]) > pair_of(newly_parked_.back())) {
      *to = out.parked[--old];
    } else {
      *to = newly_parked_.back();
      newly_parked_.pop_back();
    }
  }
}

void ContactFinder::give_rows(const StepContext& at, const ParkedContact& parked,
                              PairConstraint& contact, ConstraintSet& out) {
  friction_slip_.apply(at.options, speed_, contact);
  insert_contact(parked.candidate, contact, out);
}

/// Returns by how much farther along n [m] the point at `arm` from a body's origin moves within the
/// step than h times its velocity, if the body keeps its angular velocity.
double ContactFinder::turning_advance(const Vector3& n, const Vector3& arm, double h, int body,
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
double ContactFinder::gap_less_turning(const PairConstraint& contact, double gap, double h,
                                       const Kinematics& data) {
  if (!(gap > 0.0)) return gap;
  const auto advance = [&](int body) {
    return turning_advance(contact.frame.col(0), contact.position - data.X_WB[body].translation, h,
                           body, data);
  };
  const double closer = advance(contact.body_a) - advance(contact.body_b);
  return std::max(gap - std::max(closer, 0.0), 0.0);
}

const Material& ContactFinder::material_of(const Model& model, EffectSet effects,
                                           const collision::Candidate& candidate) {
  // Candidates are sorted by pair.
  if (const std::pair pair(candidate.geometry_a, candidate.geometry_b); pair != material_of_) {
    material_ = active_material(model.pair_material(pair.first, pair.second), effects);
    material_of_ = pair;
  }
  return material_;
}

/// Moves the contact point to the present surface of the lighter body, or near it, where the bodies
/// will meet: halfway across a gap of decimetres, friction would turn a small body with a lever arm
/// it does not have.
void ContactFinder::move_to_meeting(const Model& model, collision::Candidate& candidate) const {
  const double a = search_.inverse_mass(model.geometries()[candidate.geometry_a].body);
  const double b = search_.inverse_mass(model.geometries()[candidate.geometry_b].body);
  const double towards_b = b / (a + b) - 0.5;
  candidate.position += towards_b * std::max(candidate.gap, 0.0) * candidate.normal;
}

/// Returns a candidate, already moved to the meeting point, as a contact that may be parked.
ParkedContact ContactFinder::describe(const StepContext& at, const Kinematics& data,
                                      const collision::Candidate& candidate) {
  const Model& model = at.model;
  const double h = at.h();
  const Geometry& of_a = model.geometries()[candidate.geometry_a];
  const Geometry& of_b = model.geometries()[candidate.geometry_b];
  const int a = of_a.body, b = of_b.body;
  ParkedContact out;
  out.candidate = candidate;
  out.body_a = a;
  out.body_b = b;
  out.velocity = relative_velocity_at(candidate.position, a, b, data, data.V);
  if (at.effects.has(Effect::kSurfaceMotion)) {
    out.surface = surface_motion(of_a, of_b, data, candidate.normal);
    out.velocity += out.surface;
  }
  // Both surfaces are within the gap of the contact point.
  out.gap = candidate.gap;
  for (const int body : {a, b})
    if (body != 0)
      out.gap -= search_.turn_share(body) * (search_.radii()[body] + std::max(candidate.gap, 0.0));
  const bool meets = out.gap + h * candidate.normal.dot(out.velocity) <= 0.0;
  if (!has_friction(at.options.contact, out.gap, meets)) return out;
  const Material& material = material_of(model, at.effects, candidate);
  out.slip = material.most_friction();
  out.spin = std::max(material.torsional_friction, material.rolling_friction);
  return out;
}

/// Fills `contact`, default-constructed, from a candidate; returns its present velocity in its
/// rows.
Vector3 ContactFinder::make_contact(const StepContext& at, const Kinematics& data,
                                    const ParkedContact& open, PairConstraint& contact) {
  const Model& model = at.model;
  const SimulationOptions& options = at.options;
  const double h = at.h();
  const collision::Candidate& candidate = open.candidate;
  const Geometry& a = model.geometries()[candidate.geometry_a];
  const Geometry& b = model.geometries()[candidate.geometry_b];
  const double alpha = search_.inverse_mass(a.body) + search_.inverse_mass(b.body);
  const Material& given = material_of(model, at.effects, candidate);
  contact.body_a = a.body;
  contact.body_b = b.body;
  contact.position = candidate.position;
  const Matrix3 t1_t2_n = frame_from_normal(candidate.normal);
  contact.frame << t1_t2_n.col(2), t1_t2_n.col(0), t1_t2_n.col(1);
  const bool turned =
      given.is_directional() && turn_to_friction_axis(model, given, candidate, data, contact);
  const Material& material = turned || !given.is_directional() ? given : given.without_direction();
  const Vector3 v = contact.frame.transpose() * open.velocity;
  const double gap = gap_less_turning(contact, candidate.gap, h, data);
  contact.soft = material.is_soft();
  contact.gap_bias = gap_bias(options.contact, h, gap);
  const Bounce bounce = find_bounce(model, options, at.effects, data, {material, contact, gap, v});
  if (bounce.happens && gap > 0.0) contact.impact_time = bounce.time;
  set_contact_law(law_options_[is_wedged(contact) ? 1 : 0], h,
                  {material, alpha, gap, candidate.area, v, bounce, is_round(model, a, b)},
                  contact.law);
  if (contact.law.rows >= 3)
    for (int i = 1; i < 3; ++i) contact.law.bias[i] = contact.frame.col(i).dot(open.surface);
  return v;
}

void ContactFinder::find(const StepContext& at, const Kinematics& data, SleepMask idle,
                         ConstraintSet& out, EffectCounts& counts) {
  const Model& model = at.model;
  const double h = at.h();
  speed_.clear();
  std::vector<collision::Candidate>& candidates = search_.find(at, data, idle, out.far);
  find_crowds(at, candidates);
  const bool parks = parks_contacts(at.options);
  std::fill(turn_known_.begin(), turn_known_.end(), 0);
  material_of_ = {-1, -1};
  law_options_ = {law_options(at.options, false), law_options(at.options, true)};
  const double near = parking_gap(at.options.contact, h);
  for (collision::Candidate& candidate : candidates) {
    move_to_meeting(model, candidate);
    count_contact(material_of(model, at.effects, candidate), counts);
    const ParkedContact open = describe(at, data, candidate);
    if (!open.surface.isZero(0.0)) counts.add(Effect::kSurfaceMotion);
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
  newly_parked_.reserve(out.far.size());
  out.contacts.reserve(out.contacts.size() + later);
  speed_.reserve(candidates.size());
  out.pairs.reserve(out.pairs.size() + later + model.closures().size());
  spread_friction(at, data, search_.radii(), out);
  friction_slip_.set(model, at.options, speed_, out);
}

}  // namespace counterpoint
