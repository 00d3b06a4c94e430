#include "counterpoint/engine/derivatives/parameters/parameter_constraints.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/derivatives/constraints/pair_response.h"
#include "counterpoint/engine/derivatives/constraints/slip_response.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

using K = StepParameterKind;

LawSource source_of(const PreparedParameter& p) {
  LawSource source;
  switch (p.kind()) {
    case K::kCompliance:
      source.compliance = 1.0;
      break;
    case K::kSmoothing:
      source.smoothing = 1.0;
      break;
    case K::kStabilization:
      source.stabilization = 1.0;
      break;
    case K::kMaxRecoverySpeed:
      source.max_recovery_speed = 1.0;
      break;
    default:
      break;
  }
  return source;
}

/// Derivative of combine_materials.
Material material_change(const PreparedParameter& p, const Geometry& a, int index_a,
                         const Geometry& b, int index_b) {
  Material out{0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  const bool of_a = p.has(index_a), of_b = p.has(index_b);
  const auto root = [](double x, double y, bool by_x, bool by_y) {
    const double both = std::sqrt(x * y);
    return both > 0.0 ? (by_x ? 0.5 * y / both : 0.0) + (by_y ? 0.5 * x / both : 0.0) : 0.0;
  };
  const auto larger = [&](double x, double y) -> double { return x >= y ? of_a : of_b; };
  const Material &x = a.material, &y = b.material;
  switch (p.kind()) {
    case K::kFriction:
      out.friction = root(x.friction, y.friction, of_a, of_b);
      // Where a surface has no static friction of its own, it is that of sliding.
      out.static_friction = root(x.friction_at_rest(), y.friction_at_rest(),
                                 of_a && !(x.friction_at_rest() > x.friction),
                                 of_b && !(y.friction_at_rest() > y.friction));
      break;
    case K::kRestitution:
      out.restitution = larger(x.restitution, y.restitution);
      break;
    case K::kTorsionalFriction:
      out.torsional_friction = larger(x.torsional_friction, y.torsional_friction);
      break;
    case K::kRollingFriction:
      out.rolling_friction = larger(x.rolling_friction, y.rolling_friction);
      break;
    default:
      break;
  }
  return out;
}

/// Derivative of dry_friction_at by the parameter, whose targets include this coordinate.
double dry_friction_change(const PreparedParameter& p, const InverseArguments& of, int v_index) {
  const SlidingFriction at = dry_friction_at(of.model, of.options.effects, v_index, of.v[v_index]);
  switch (p.kind()) {
    case K::kDryFriction:
      return of.model.breaks_away(v_index) ? 1.0 - at.by_static : 1.0;
    case K::kBreakawayFriction:
      return at.by_static;
    case K::kStribeckSpeed:
      return at.by_stribeck_speed;
    default:
      return 0.0;
  }
}

/// Adds factor times the generalized force of a wrench at `arm` from a body's origin.
void project(const Model& model, int body, const Vector3& arm, const Force& at, double factor,
             const Kinematics& data, VectorOut du) {
  Force f = shift(at, arm) * factor;
  for (int i = body; i != 0; i = model.body(i).parent) {
    const Body& joint = model.body(i);
    for (int k = joint.v_index; k < joint.v_index + joint_nv(joint.joint_type); ++k)
      du[k] += dot(data.axis[k], f);
    f = shift(f, data.arm[i]);
  }
}

}  // namespace

/// Finds the change of a contact's place, frame and gap. Returns false if the contact's motion is
/// not known.
bool ParameterConstraints::find_place(const PreparedParameter& p, const Model& model,
                                      const collision::Candidate& contact, double h,
                                      const InvertedStep& inverted, PlaceChange& out) {
  const InverseWeights& weights = inverted.finder.weights();
  const Kinematics& data = inverted.at();
  out = PlaceChange();
  const Geometry& a = model.geometries()[static_cast<size_t>(contact.geometry_a)];
  const Geometry& b = model.geometries()[static_cast<size_t>(contact.geometry_b)];
  const double alpha = weights.contact[a.body] + weights.contact[b.body];
  const double share_b = weights.contact[b.body] / alpha;
  if (p.weights) {
    const double sum = p.weights->contact[a.body] + p.weights->contact[b.body];
    const double by = (p.weights->contact[b.body] - share_b * sum) / alpha;
    out.place = by * std::max(contact.gap, 0.0) * contact.normal;
  }
  if (p.kind() != K::kHeight) return true;
  const bool of_a = p.has(contact.geometry_a), of_b = p.has(contact.geometry_b);
  if (!of_a && !of_b) return true;
  ContactMotion motion;
  motions_.begin();
  const collision::BodyMotions motions{data.V, weights.contact, h};
  if (!motions_.find(model, data, inverted.finder.collider(), motions, contact, share_b - 0.5,
                     motion))
    return false;
  const auto up = [&](const Geometry& g, int geometry) -> Vector3 {
    return data.X_WB[g.body].rotation * (g.X_BG.rotation * p.direction(geometry));
  };
  Vector6 relative = Vector6::Zero();
  if (of_a) {
    out.place += up(a, contact.geometry_a);
    relative.tail<3>() -= up(a, contact.geometry_a);
  }
  if (of_b) relative.tail<3>() += up(b, contact.geometry_b);
  out.place += motion.point * relative;
  const Vector3 turned = motion.normal * relative;
  out.turn = contact.normal.cross(turned);
  out.gap = motion.gap * relative;
  return true;
}

/// Finds the derivative of the slip speed that friction is allowed: with its place the island's
/// fastest contact changes its sliding speed. Returns false if that contact's motion is not known.
bool ParameterConstraints::find_slip(const PreparedParameter& p, const Model& model,
                                     const SimulationOptions& options, const PairConstraint& pair,
                                     const InvertedStep& inverted, double& out) {
  out = 0.0;
  if (pair.fastest_contact < 0) return true;
  const auto fastest = static_cast<size_t>(pair.fastest_contact);
  const PairConstraint& source = inverted.constraints->pairs[fastest];
  PlaceChange place;
  if (!find_place(p, model, inverted.constraints->contacts[fastest], options.time_step, inverted,
                  place))
    return false;
  const Sliding sliding(source, pair_bodies(source, inverted.at(), *inverted.body_velocity));
  out = options.time_step / options.contact.slip_time *
        sliding.by_place(place.place, place.turn).value();
  return true;
}

bool ParameterConstraints::add_contacts(const PreparedParameter& p, const Model& model,
                                        const SimulationOptions& options, EffectSet effects,
                                        const InvertedStep& inverted, VectorOut du) {
  const InverseWeights& weights = inverted.finder.weights();
  const LawSource of_all = source_of(p);
  for (size_t i = 0; i < inverted.constraints->contacts.size(); ++i) {
    const PairConstraint& pair = inverted.constraints->pairs[i];
    const collision::Candidate& contact = inverted.constraints->contacts[i];
    const Geometry& a = model.geometries()[static_cast<size_t>(contact.geometry_a)];
    const Geometry& b = model.geometries()[static_cast<size_t>(contact.geometry_b)];
    LawSource change = of_all;
    // A material given for the pair does not depend on that of either surface.
    if (model.find_pair_material(contact.geometry_a, contact.geometry_b) == nullptr)
      change.material = active_material(
          material_change(p, a, contact.geometry_a, b, contact.geometry_b), effects);
    if (p.kind() == K::kGravity && !model.gravity().isZero(0.0))
      change.fall = pair.frame.col(0).dot(inverted.finder.contacts().relative_fall(effects, pair)) /
                    model.gravity().norm();
    if (p.weights) change.alpha = p.weights->contact[pair.body_a] + p.weights->contact[pair.body_b];
    PlaceChange place;
    if (!find_place(p, model, contact, options.time_step, inverted, place)) return false;
    if (!find_slip(p, model, options, pair, inverted, change.slip_speed)) return false;
    const Material material =
        active_material(model.pair_material(contact.geometry_a, contact.geometry_b), effects);
    // Friction of bounces, of spinning patches and with an axis is left to differences.
    if (contact::leans(pair.law) || pair.spins || !pair.friction_axis.isZero(0.0)) return false;
    // The area may change, and a belt may turn.
    if (material.per_area.is_soft() || pair.has_belt()) return false;
    // The same for a bouncing ball whose place in the body moves: off the centre of mass its
    // impulse leans.
    if (p.kind() == K::kHeight && pair.law.coulomb && material.restitution > 0.0) return false;
    const Source source{material, weights.contact[pair.body_a] + weights.contact[pair.body_b],
                        contact.gap};
    add_contact(model, options, effects, pair, source, change, place, inverted, du);
  }
  return true;
}

/// Adds one contact's part of -J' f / h.
void ParameterConstraints::add_contact(const Model& model, const SimulationOptions& options,
                                       EffectSet effects, const PairConstraint& pair,
                                       const Source& source, const LawSource& change,
                                       const PlaceChange& place, const InvertedStep& inverted,
                                       VectorOut du) {
  const double h = options.time_step;
  const PairBodies bodies = pair_bodies(pair, inverted.at(), *inverted.body_velocity);
  const Motion next = bodies.next_b - bodies.next_a, start = bodies.start_b - bodies.start_a;
  const int rows = pair.law.rows;
  contact::Rows y = relative_velocity(pair, inverted.at(), *inverted.body_velocity);
  for (int r = 0; r < rows; ++r) y[r] += pair.law.bias[static_cast<size_t>(r)];
  // Change of the rows as place and frame move.
  const auto moved = [&](const Motion& V) {
    const Vector3 linear = V.angular.cross(place.place) + V.linear.cross(place.turn);
    Vector6 out;
    out << pair.frame.transpose() * linear, pair.frame.transpose() * V.angular.cross(place.turn);
    return out;
  };
  const Vector6 dy_all = moved(next);
  contact::Rows dy = dy_all.segment(pair.first, rows);
  // The bias depends on the gap, reduced by turning_advance, and on the velocity at the start.
  double by_gap = place.gap, gap = source.gap;
  bool closed = false;
  if (gap > 0.0) {
    const double closer = turning_advance(pair, bodies, h);
    if (closer > 0.0) {
      PairConstraint turned = pair;
      turned.frame.col(0) = place.turn.cross(pair.frame.col(0));
      PairBodies shifted = bodies;
      shifted.arm_a = shifted.arm_b = place.place;
      by_gap -= turning_advance(turned, bodies, h) + turning_advance(pair, shifted, h);
    }
    gap = std::max(gap - std::max(closer, 0.0), 0.0);
    closed = !(gap > 0.0);
  }
  const Vector3 v = pair.frame.transpose() * start.linear;
  const Bounce bounce = inverted.finder.contacts().find_bounce(
      model, options, effects, inverted.at(), {source.surface, pair, gap, v});
  const ContactStart from{source.surface, source.alpha, gap, 0.0, v, bounce};
  const LawOptions made_with = law_options(options, inverted.finder.contacts().is_wedged(pair));
  LawSlopes slopes = contact_law_slopes(made_with, h, from);
  if (pair.law.type != contact::LawType::kFrictionCone) slopes.v[1] = slopes.v[2] = 0.0;
  if (!closed) dy[0] += slopes.gap * by_gap;
  dy[0] += slopes.v.dot(moved(start).head<3>());
  dy[0] += slopes.fall * place.turn.cross(pair.frame.col(0))
                             .dot(inverted.finder.contacts().relative_fall(effects, pair));
  LawChange law = contact_law_change(made_with, h, from, change);
  if (pair.law.type == contact::LawType::kFrictionCone)
    for (size_t i = 0; i < 2; ++i) law.friction[i] += slopes.friction.dot(moved(start).head<3>());
  if (!closed) law.smoothing += slopes.smoothing * by_gap;
  if (!closed) law.normal += slopes.softness * by_gap;
  const contact::Rows f = contact::impulse(pair.law, y);
  const Force W = pair_impulse(pair, f);
  Force dW = pair_impulse(pair, impulse_change(pair.law, y, dy, law));
  dW.torque += place.turn.cross(W.torque) + place.place.cross(W.force);
  dW.force += place.turn.cross(W.force);
  project(model, pair.body_b, bodies.arm_b, dW, -1.0 / h, inverted.at(), du);
  project(model, pair.body_a, bodies.arm_a, dW, 1.0 / h, inverted.at(), du);
}

/// Adds the derivative by dry friction of coordinates that have none, hence no row.
void ParameterConstraints::add_first_friction(const PreparedParameter& p,
                                              const InverseArguments& of,
                                              const InvertedStep& inverted, VectorOut du) {
  const auto& options = of.options;
  const VectorRef& v_next = of.v_next;
  if (!options.effects.has(Effect::kDryFriction)) return;
  if (p.kind() != K::kDryFriction && p.kind() != K::kBreakawayFriction) return;
  for (const int i : p.parameter.targets) {
    if (dry_friction_at(of.model, options.effects, i, of.v[i]).value > 0.0) continue;
    const double h = options.time_step;
    const contact::Law law =
        make_dry_friction_law(options.contact, h, inverted.finder.weights().dof[i], 0.0);
    LawChange change;
    change.bound = h * dry_friction_change(p, of, i);
    du[i] -= impulse_change(law, contact::Rows::Constant(1, v_next[i]), contact::Rows::Zero(1),
                            change)[0] /
             h;
  }
}

void ParameterConstraints::add_joint_rows(const PreparedParameter& p, const InverseArguments& of,
                                          const InvertedStep& inverted, VectorOut du) {
  const auto& options = of.options;
  const VectorRef& v_next = of.v_next;
  const InverseWeights& weights = inverted.finder.weights();
  for (const JointConstraint& row : inverted.constraints->joints) {
    if (row.has_given_gains()) continue;
    const std::span<const RowTerm> terms = inverted.constraints->terms(row);
    double alpha = 0.0;
    LawSource source = source_of(p);
    contact::Rows y = contact::Rows::Constant(1, row.law.bias[0]);
    y[0] += row_velocity(terms, v_next);
    const auto weight = [&](const auto& by) {
      if (row.tendon >= 0) return static_cast<double>(by.tendon[static_cast<size_t>(row.tendon)]);
      double sum = 0.0;
      for (const RowTerm& term : terms)
        sum += term.coefficient * term.coefficient * by.dof[term.v_index];
      return sum;
    };
    alpha = weight(weights);
    if (p.weights) source.alpha = weight(*p.weights);
    const bool limit = row.law.type == contact::LawType::kUnilateral && !std::isnan(row.gap_bias);
    LawChange change = limit ? limit_law_change(options, alpha, row, source)
                             : plain_law_change(options, row.law, alpha, source);
    if (row.effect == Effect::kDryFriction && p.has(terms[0].v_index))
      change.bound = options.time_step * dry_friction_change(p, of, terms[0].v_index);
    const double df = impulse_change(row.law, y, contact::Rows::Zero(1), change)[0];
    for (const RowTerm& term : terms) du[term.v_index] -= term.coefficient * df / options.time_step;
  }
}

}  // namespace counterpoint
