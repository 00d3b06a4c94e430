#include "counterpoint/engine/derivatives/step/inverse_derivator.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/derivatives/forces/body_forces.h"
#include "counterpoint/engine/derivatives/forces/flight_terms.h"
#include "counterpoint/engine/derivatives/forces/joint_derivatives.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

/// Whether a contact is so far away that its force is below 1e-9 of the weight of the bodies it
/// moves, and the derivative of the force below 1e-9 of that weight per metre.
bool is_nothing(const PairConstraint& pair, const PairBodies& bodies, double h,
                const InverseWeights& weights) {
  constexpr double kNothing = 1e-9 * kStandardGravity;  // [m/s^2, 1/s^2]
  const double alpha = weights.contact[pair.body_a] + weights.contact[pair.body_b];
  const double y =
      pair.law.bias[0] + pair.frame.col(0).dot(bodies.next_b.linear - bodies.next_a.linear);
  double closing = y;
  if (pair.law.rows > 1 && !pair.law.coulomb) {  // smaller spectral value of the convex cone
    Vector3 slip = pair.frame.transpose() * (bodies.next_b.linear - bodies.next_a.linear);
    closing -= pair.law.friction[0] * std::hypot(slip[1], slip[2]);
    if (pair.law.rows > 3) return false;
  }
  if (!(closing > 0.0)) return false;
  // Upper bounds: f < k / y and G < k / y^2.
  const double f = pair.law.smoothing / closing;
  return alpha * f / h < kNothing && alpha * f / (closing * h * h) < kNothing;
}

/// Returns -df/dy of the rows of a closure [kg].
double slope_of(const PairConstraint& pair, const InvertedStep& inverted) {
  if (pair.law.type == contact::LawType::kEquality) return 1.0 / pair.law.regularizer;
  const ContactRows rows(pair, pair_bodies(pair, inverted.at(), *inverted.body_velocity));
  return contact::evaluate(pair.law, rows.y).hessian(0, 0);
}

}  // namespace

InverseDerivator::InverseDerivator(const Model& model)
    : sweep_(model),
      velocity_terms_(model),
      closures_(model),
      slips_(model),
      forces_(model),
      v_(VectorX::Zero(model.nv())),
      acceleration_(VectorX::Zero(model.nv())) {}

bool InverseDerivator::find_motion(const Model& model, double h, size_t contact,
                                   const InvertedStep& inverted, ContactMotion& out) {
  const PairConstraint& pair = inverted.constraints->pairs[contact];
  const InverseWeights& weights = inverted.finder.weights();
  const double alpha = weights.contact[pair.body_a] + weights.contact[pair.body_b];
  const double towards_b = weights.contact[pair.body_b] / alpha - 0.5;
  const collision::BodyMotions motions{inverted.at().V, weights.contact, h};
  return motions_.find(model, inverted.at(), inverted.finder.collider(), motions,
                       inverted.constraints->contacts[contact], towards_b, out);
}

/// Share of a contact's impulse that counts in `displacing_`: t / h for late impulses, else all.
ImpulseShare InverseDerivator::find_share(const Bounce& bounce, double h,
                                          const Vector3& fall) const {
  ImpulseShare share;
  if (displacing_ != Displacing::kLateImpulses) return share;
  share.value = bounce.time / h;
  share.gap = bounce.time_by_gap / h;
  share.v[0] = bounce.time_by_velocity / h;
  share.normal = bounce.time_by_fall / h * fall;
  return share;
}

bool InverseDerivator::contact_response(const InverseArguments& of, size_t contact,
                                        const PairBodies& bodies, const InvertedStep& inverted,
                                        PairResponse& out) {
  const Model& model = of.model;
  const SimulationOptions& options = of.options;
  const EffectSet effects = of.effects;
  const double h = of.h();
  const PairConstraint& pair = inverted.constraints->pairs[contact];
  const collision::Candidate& candidate = inverted.constraints->contacts[contact];
  const InverseWeights& weights = inverted.finder.weights();
  const double alpha = weights.contact[pair.body_a] + weights.contact[pair.body_b];
  const Material surface =
      active_material(model.pair_material(candidate.geometry_a, candidate.geometry_b), effects);
  ContactMotion motion;
  if (surface.per_area.is_soft() || pair.has_belt() ||
      !find_motion(model, h, contact, inverted, motion)) {
    find_velocity_response(pair, bodies, out);  // areas and belts move with the bodies
    return false;
  }
  double gap = candidate.gap;
  bool turning = false, closed = false;
  if (gap > 0.0) {
    const double closer = turning_advance(pair, bodies, h);
    turning = closer > 0.0;
    gap = std::max(gap - std::max(closer, 0.0), 0.0);
    closed = !(gap > 0.0);
  }
  const Vector3 v = pair.frame.transpose() * (bodies.start_b.linear - bodies.start_a.linear);
  const Bounce bounce = inverted.finder.contacts().find_bounce(
      model, options, effects, inverted.at(), {surface, pair, gap, v});
  if (contact::leans(pair.law) || (bounce.happens && bounce.spins) ||
      (gap > 0.0 && bounce.parting * h > gap)) {
    find_velocity_response(pair, bodies, out);  // these bounces have no closed form
    return false;
  }
  LawSlopes slopes =
      contact_law_slopes(law_options(options, inverted.finder.contacts().is_wedged(pair)), h,
                         {surface, alpha, gap, candidate.area, v, bounce});
  const Vector3 fall = inverted.finder.contacts().relative_fall(effects, pair);
  slopes.normal = slopes.fall * fall;
  if (displacing_ == Displacing::kRecovery)
    slopes = {.gap = pair.soft ? 0.0 : gap_bias_slope(options.contact, h, gap),
              .smoothing = slopes.smoothing,
              .softness = slopes.softness,
              .friction = slopes.friction};
  ImpulseShare share = find_share(bounce, h, fall);
  if (pair.body_a != 0 && pair.body_b != 0 && !slopes.normal.isZero(0.0)) {
    find_velocity_response(pair, bodies, out);  // gravity does not turn with the bodies
    return false;
  }
  if (pair.law.type != contact::LawType::kFrictionCone) {
    slopes.v[1] = slopes.v[2] = 0.0;
    slopes.friction.setZero();
  }
  if (closed) slopes.gap = slopes.smoothing = slopes.softness = share.gap = 0.0;
  find_contact_response(pair, bodies, motion, slopes, turning && !closed, h, out, share);
  return !pair.spins || pair.law.rows < 3 || add_patch(of, contact, bodies, inverted, out);
}

/// Adds the derivatives of the friction of a spinning patch for one of its contacts.
bool InverseDerivator::add_patch(const InverseArguments& of, size_t contact,
                                 const PairBodies& bodies, const InvertedStep& inverted,
                                 PairResponse& out) {
  const ConstraintSet& set = *inverted.constraints;
  // The friction point of a spinning patch does not turn with the axis of friction.
  if (displacing_ || !set.pairs[contact].friction_axis.isZero(0.0)) return false;
  const auto same_pair = [&](size_t i) {
    const collision::Candidate &a = set.contacts[i], &b = set.contacts[contact];
    return a.geometry_a == b.geometry_a && a.geometry_b == b.geometry_b;
  };
  size_t first = contact;
  while (first > 0 && same_pair(first - 1)) --first;
  const ContactPatch& patch = patch_.patch;
  find_patch(of.context(), inverted.at(), set, inverted.finder.radii(), first, patch_.patch);
  int index = -1;
  for (int k = 0; k < patch.size; ++k) {
    const size_t i = patch.contact[k];
    if (i == contact) index = k;
    if (!set.pairs[i].spins || !find_motion(of.model, of.h(), i, inverted, patch_.motions[k]))
      return false;
  }
  if (index < 0) return false;
  add_patch_response(patch_, index, set.pairs[contact], bodies, out);
  return true;
}

bool InverseDerivator::add_contacts(const InverseArguments& of, const InvertedStep& inverted) {
  const Model& model = of.model;
  const double h = of.h();
  bool known = true;
  PairResponse response;
  for (size_t i = 0; i < inverted.constraints->pairs.size(); ++i) {
    const PairConstraint& pair = inverted.constraints->pairs[i];
    const PairBodies bodies = pair_bodies(pair, inverted.at(), *inverted.body_velocity);
    if (i < inverted.constraints->contacts.size()) {
      const bool late = displacing_ == Displacing::kLateImpulses;
      if (late && !(pair.impact_time > 0.0)) continue;
      if (is_nothing(pair, bodies, h, inverted.finder.weights())) continue;
      known = contact_response(of, i, bodies, inverted, response) && known;
      slips_.add(model, pair, *inverted.body_velocity, h, inverted.at(),
                 late ? pair.impact_time / h : 1.0);
      contact_forces_.add_pair(model, pair, bodies, response, h, inverted.at());
    } else if (displacing_ && displacing_ != Displacing::kEqualities) {
      break;
    } else {
      const size_t index = i - inverted.constraints->contacts.size();
      const ActingClosure& acting = inverted.constraints->closures[index];
      find_contact_response(pair, bodies, closure_motion(model, acting, pair, inverted.at()),
                            LawSlopes(), false, h, response);
    }
    forces_.add_pair(model, pair, bodies, response, h, inverted.at());
  }
  return add_slip(model, of.options, inverted) && known;
}

/// Adds the change of friction with the sliding speed of the island's fastest contact.
bool InverseDerivator::add_slip(const Model& model, const SimulationOptions& options,
                                const InvertedStep& inverted) {
  const double h = options.time_step, share = h / options.contact.slip_time;
  const auto of_body = [&](const PairConstraint& pair, int body, const SpeedSlope::Row& q,
                           const SpeedSlope::Row& v) {
    SpeedByMotion out{body, share * q.transpose(), share * v.transpose()};
    if (body == 0) return out;
    const Vector3 arm =
        pair.position - TreeSweep::reference(model.trees()[model.body(body).tree], inverted.at());
    for (Vector6* row : {&out.q, &out.v}) row->head<3>() += arm.cross(row->tail<3>());
    return out;
  };
  for (size_t i = 0; i < slips_.sources().size(); ++i) {
    const int source = slips_.sources()[i].contact;
    const PairConstraint& pair = inverted.constraints->pairs[source];
    ContactMotion motion;
    if (!find_motion(model, h, source, inverted, motion)) return false;
    const SpeedSlope slope =
        speed_slope(pair, pair_bodies(pair, inverted.at(), *inverted.body_velocity), motion);
    const SpeedByMotion by_a = of_body(pair, pair.body_a, -slope.q, slope.v_a);
    const SpeedByMotion by_b = of_body(pair, pair.body_b, slope.q, slope.v_b);
    forces_.add_by_speed(slips_.forces(i), by_a, by_b);
    contact_forces_.add_by_speed(slips_.forces(i), by_a, by_b);
  }
  return true;
}

/// Sets the velocity and acceleration at which inertial and velocity-dependent forces are taken,
/// before the changes of velocity_terms.h. For free bodies (free_flight.h) these forces are a load.
void InverseDerivator::set_velocities(const Model& model, const VectorRef& v,
                                      const VectorRef& v_next, double h,
                                      const InvertedStep& inverted) {
  acceleration_ = (v_next - v) / h;
  v_ = v;
  if (!inverted.has_coriolis) v_.setZero();
  for (int n = 0; inverted.has_coriolis && n < inverted.start.free_flight().num_flyers(); ++n) {
    const int i = inverted.start.free_flight().body(n);
    v_.segment(model.body(i).v_index, joint_nv(model.body(i).joint_type)).setZero();
    forces_.add_load(i, inverted.start.velocity_forces().mean_force[i] * -1.0);
  }
}

bool InverseDerivator::sweep_trees(const InverseArguments& of, const InvertedStep& inverted,
                                   InverseDerivatives& d) {
  const Model& model = of.model;
  const SimulationOptions& options = of.options;
  const VectorRef &v = of.v, &v_next = of.v_next;
  const EffectSet effects = of.effects;
  const double h = of.h();
  SweepInput in;
  in.v = v_.data();
  in.a = acceleration_.data();
  in.gravity = effects.has(Effect::kGravity) ? model.gravity() : Vector3(Vector3::Zero());
  forces_.put_into(in);
  in.v_start = v.data();
  in.v_next = v_next.data();
  in.mass_in_next = 1.0 / h;
  in.mass_in_v = -1.0 / h;
  const SweepOutput out{d.dq, d.dv, d.dv_next};
  velocity_terms_.begin(of, inverted);
  for (int t = 0; t < model.num_trees(); ++t) {
    velocity_terms_.prepare(of, t, inverted, v_, acceleration_, in);
    sweep_.run(model, model.trees()[t], inverted.at(), in, out);
    velocity_terms_.add(of, t, inverted, d);
  }
  forces_.add_couplings(model, in, sweep_, out);
  contact_forces_.write(model, in, sweep_, d.contacts);
  if (inverted.has_coriolis)
    add_flight_derivatives(model, h, v, in.gravity, inverted.start.free_flight(), inverted.at(), d);
  if (!inverted.constraints->closures.empty()) closures_.begin(model, inverted.at(), v);
  const bool known = velocity_terms_.add_equalities(of, inverted, closures_, d);
  return add_closure_rows(model, options, inverted, d) && known;
}

/// Adds the derivatives of the biases of closures that are not aimed. Returns whether those of all
/// are known.
bool InverseDerivator::add_closure_rows(const Model& model, const SimulationOptions& options,
                                        const InvertedStep& inverted, InverseDerivatives& d) {
  const ConstraintSet& all = *inverted.constraints;
  const double h = options.time_step;
  bool known = true;
  for (size_t i = 0; i < all.closures.size(); ++i) {
    const PairConstraint& pair = all.pairs[all.contacts.size() + i];
    known = known && ClosureDerivator::knows(pair);
    if (velocity_terms_.aims(model, pair, inverted)) continue;
    closures_.compute(model, options.contact, h, all.closures[i], pair, inverted.at(), false);
    const double scale = slope_of(pair, inverted) / h;
    closures_.add_to(d.dq, scale, closures_.by_q);
    if (!velocity_terms_.aims_at_rest(model, pair)) closures_.add_to(d.dv, scale, closures_.by_v);
  }
  return known;
}

void InverseDerivator::begin(const Model& model, InverseDerivatives& d) {
  const int nv = model.nv();
  for (MatrixX* m : {&d.dq, &d.dv, &d.dv_next}) {
    if (m->rows() != nv || m->cols() != nv) m->resize(nv, nv);
    if (model.num_trees() != 1) m->setZero();
  }
  slips_.begin();
  forces_.begin();
  contact_forces_.begin(d.contacts);
  motions_.begin();
}

bool InverseDerivator::compute_impulses(const InverseArguments& of, const VectorRef& m,
                                        const VectorRef& w, const InvertedStep& all,
                                        InverseDerivatives& d) {
  InvertedStep inverted = all;
  inverted.has_coriolis = false;
  begin(of.model, d);
  EffectSet effects = of.effects;
  effects.set(Effect::kGravity, false);
  const InverseArguments at_w{of.model, of.options, of.q,    of.v, of.q_next,
                              w,        of.known,   effects, of.z};
  v_.setZero();
  acceleration_ = (w - m) / of.h();
  bool closed = add_contacts(at_w, inverted);
  closed = sweep_trees(at_w, inverted, d) && closed;
  add_joint_row_derivatives(of.options, *inverted.constraints, w, inverted.finder.weights(), d);
  add_tendon_curvature(inverted, of.model, of.h(), w, curvature_, d);
  return closed;
}

bool InverseDerivator::compute_displacing(Displacing part, const InverseArguments& of,
                                          const VectorRef& p, const VectorRef& w,
                                          const InvertedStep& inverted, InverseDerivatives& d) {
  const Model& model = of.model;
  const double h = of.h();
  const bool moves = part == Displacing::kRecovery;
  begin(model, d);
  displacing_ = part;
  v_.setZero();
  acceleration_ = p * (moves ? 1.0 / h : 0.0);
  if (part == Displacing::kEqualities && of.effects.has(Effect::kDrag))
    add_drag_responses(model, *inverted.body_velocity, inverted.at(), forces_);
  const bool known = add_contacts(of, inverted);
  SweepInput in;
  in.v = v_.data();
  in.a = acceleration_.data();
  forces_.put_into(in);
  in.v_start = of.v.data();
  in.v_next = w.data();
  in.mass_in_next = moves ? 1.0 / h : 0.0;
  const SweepOutput out{d.dq, d.dv, d.dv_next};
  for (const Tree& tree : model.trees()) sweep_.run(model, tree, inverted.at(), in, out);
  forces_.add_couplings(model, in, sweep_, out);
  if (part != Displacing::kLateImpulses) {
    add_joint_row_derivatives(of.options, *inverted.constraints, w, inverted.finder.weights(), d,
                              true);
    add_tendon_curvature(inverted, model, h, w, curvature_, d);
  }
  displacing_.reset();
  return known;
}

bool InverseDerivator::compute(const InverseArguments& of, const InvertedStep& inverted,
                               InverseDerivatives& d) {
  const Model& model = of.model;
  begin(model, d);
  set_velocities(model, of.v, of.v_next, of.h(), inverted);
  if (of.effects.has(Effect::kExternalWrenches))
    add_wrench_responses(model, of.known.wrenches, inverted.at(), forces_);
  if (of.effects.has(Effect::kDrag))
    add_drag_responses(model, *inverted.body_velocity, inverted.at(), forces_);
  add_loss_responses(model, of.h(), inverted.taut_links.links(), inverted.at(), forces_);
  bool closed = add_contacts(of, inverted);
  closed = sweep_trees(of, inverted, d) && closed;
  add_joint_force_derivatives(model, of.effects, of.h(), d);
  add_joint_row_derivatives(of.options, *inverted.constraints, of.v_next, inverted.finder.weights(),
                            d);
  add_tendon_curvature(inverted, model, of.h(), of.v_next, curvature_, d);
  return closed;
}

}  // namespace counterpoint
