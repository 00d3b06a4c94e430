#include "counterpoint/engine/constraints/constraints.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/closures.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

/// Whether some closure moves bodies so light that a body more than kHeaviestHeld times heavier may
/// hang on it.
bool holds_much(const InverseWeights& weights) {
  double least = std::numeric_limits<double>::infinity(), loosest = 0.0;
  for (const double w : weights.contact)
    if (w > 0.0) least = std::min(least, w);
  for (const ClosureWeight& w : weights.closure) loosest = std::max(loosest, w.linear);
  return loosest > kHeaviestHeld * least;
}

/// Adds one row per coordinate: it holds up to the bound h force and slides beyond.
void find_dry_friction(const StepContext& at, const std::vector<DryCoordinate>& coordinates,
                       const InverseWeights& weights, SleepMask idle, ConstraintSet& out) {
  const double h = at.h();
  for (const auto& [i, body] : coordinates) {
    if (idle(body)) continue;
    const SlidingFriction friction = dry_friction_at(at.model, at.effects, i, at.v[i]);
    if (!(friction.value > 0.0)) continue;
    JointConstraint row;
    row.effect = Effect::kDryFriction;
    row.law = make_dry_friction_law(at.options.contact, h, weights.dof[i], friction.value);
    row.bound_by_velocity = at.v[i] < 0.0 ? -h * friction.by_speed : h * friction.by_speed;
    out.add(row, {{i}});
  }
}

void find_mimics(const Model& model, const SimulationOptions& options, const VectorRef& q,
                 const InverseWeights& weights, SleepMask idle, ConstraintSet& out) {
  for (const Mimic& mimic : model.mimics()) {
    if (idle(mimic.joint + 1)) continue;  // the master is in the same island, hence idle too
    const Body& follower = model.body(mimic.joint + 1);
    const Body& master = model.body(mimic.master + 1);
    const double error = mimic_error(model, mimic, q);
    const double alpha = weights.dof[follower.v_index] +
                         mimic.multiplier * mimic.multiplier * weights.dof[master.v_index];
    JointConstraint row;
    row.effect = Effect::kMimics;
    row.law = make_mimic_law(options.contact, options.time_step, alpha, error);
    out.add(row, {{follower.v_index}, {master.v_index, -mimic.multiplier}});
  }
}

}  // namespace

SlidingFriction dry_friction_at(const Model& model, EffectSet effects, int v_index, double v) {
  const double moving = model.dry_friction()[v_index];
  const double at_rest = model.breakaway_friction()[v_index];
  if (!effects.has(Effect::kBreakawayFriction) || at_rest < moving) return {moving};
  return friction_curve(moving, at_rest, model.stribeck_speed()[v_index], std::abs(v));
}

bool has_equalities(const ConstraintSet& constraints) {
  return !constraints.closures.empty() ||
         std::any_of(constraints.joints.begin(), constraints.joints.end(),
                     [](const JointConstraint& row) {
                       return row.law.type == contact::LawType::kEquality;
                     });
}

ConstraintFinder::ConstraintFinder(const Model& model, InverseWeights weights)
    : weights_(std::move(weights)),
      contacts_(model, weights_.contact),
      holds_much_(holds_much(weights_)),
      limited_(list_limited_coordinates(model)),
      speed_limits_(list_speed_limits(model)),
      acceleration_(model.closures().empty() ? 0 : model.num_bodies()) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (model.joint(i - 1).prescribed) continue;
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k)
      if (model.friction_at_rest(k) > 0.0) dry_.push_back({k, i});
  }
}

void ConstraintFinder::find(const StepContext& at, const Kinematics& data, ConstraintSet& out,
                            EffectCounts& counts, SleepMask idle) {
  const auto& [model, options, effects, q, v, z] = at;
  out.clear();
  const auto runs = [&](Effect effect) {
    if (!at.effects.has(effect)) return false;
    counts.add(effect);
    return true;
  };
  if (runs(Effect::kContacts))
    contacts_.find(at, data, idle, out, counts);
  else
    contacts_.forget();
  if (runs(Effect::kClosures)) find_closures(at, data, weights_, idle, acceleration_, out);
  if (runs(Effect::kLimits)) find_joint_limits(at, limited_, weights_, idle, out);
  if (runs(Effect::kVelocityLimits))
    find_velocity_limits(options, speed_limits_, v, weights_, idle, out);
  if (runs(Effect::kDryFriction)) {
    runs(Effect::kBreakawayFriction);
    find_dry_friction(at, dry_, weights_, idle, out);
  }
  if (runs(Effect::kMimics)) find_mimics(model, options, q, weights_, idle, out);
  if (holds_much_) stiffen_closures(model, out);
}

bool ConstraintFinder::find_overrun(const StepContext& at, const Reached& w, const Kinematics& data,
                                    ConstraintSet& out, SleepMask idle) {
  const bool limits = at.effects.has(Effect::kLimits) &&
                      find_overrun_limits(at, limited_, w.velocity, weights_, idle, out);
  return contacts_.find_reached(at, w, data, out) || limits;
}

/// Limits the compliance of closures that may carry heavy bodies (kHeaviestHeld). A closure may
/// carry every body that closures and contacts with rows join it to; like the rows this depends on
/// (q, w) only.
void ConstraintFinder::stiffen_closures(const Model& model, ConstraintSet& out) {
  const auto tree_of = [&](int body) { return model.body(body).tree; };
  islands_.reset(model.num_trees());
  for (const PairConstraint& pair : out.pairs)
    if (pair.body_a != 0 && pair.body_b != 0)
      islands_.join(tree_of(pair.body_a), tree_of(pair.body_b));
  least_weight_.assign(static_cast<size_t>(model.num_trees()),
                       std::numeric_limits<double>::infinity());
  for (int b = 1; b < model.num_bodies(); ++b) {
    if (!(weights_.contact[b] > 0.0)) continue;
    double& least = least_weight_[static_cast<size_t>(islands_.root(tree_of(b)))];
    least = std::min(least, weights_.contact[b]);
  }
  for (size_t i = 0; i < out.closures.size(); ++i) {
    PairConstraint& pair = out.pairs[out.contacts.size() + i];
    if (pair.soft) continue;
    const int body = pair.body_b != 0 ? pair.body_b : pair.body_a;
    const double least = least_weight_[static_cast<size_t>(islands_.root(tree_of(body)))];
    const double alpha = weights_.closure[static_cast<size_t>(out.closures[i].index)].linear;
    if (alpha > kHeaviestHeld * least) pair.law.regularizer *= kHeaviestHeld * least / alpha;
  }
}

Vector3 relative_velocity_at(const Vector3& position, int body_a, int body_b,
                             const Kinematics& data, const std::vector<Motion>& V) {
  Vector3 linear = Vector3::Zero();
  if (body_a != 0) linear -= V[body_a].at(position - data.X_WB[body_a].translation);
  if (body_b != 0) linear += V[body_b].at(position - data.X_WB[body_b].translation);
  return linear;
}

contact::Rows relative_velocity(const PairConstraint& pair, const Kinematics& data,
                                const std::vector<Motion>& V) {
  Vector3 angular = Vector3::Zero();
  if (pair.first + pair.law.rows > 3 || pair.lead != 0.0) {
    if (pair.body_a != 0) angular -= V[pair.body_a].angular;
    if (pair.body_b != 0) angular += V[pair.body_b].angular;
  }
  Vector3 v = pair.frame.transpose() *
              relative_velocity_at(pair.position, pair.body_a, pair.body_b, data, V);
  if (!pair.friction_point.isZero(0.0))
    v.tail<2>() = pair.frame.rightCols<2>().transpose() *
                  relative_velocity_at(pair.position + pair.friction_point, pair.body_a,
                                       pair.body_b, data, V);
  const Vector3 w = pair.frame.transpose() * angular;
  contact::Rows rows(pair.law.rows);
  for (int i = 0; i < pair.law.rows; ++i) {
    const int row = pair.first + i;
    rows[i] = row < 3 ? v[row] : w[row - 3];
    if (pair.lead != 0.0) rows[i] += pair.lead * pair.frame.col(row).dot(angular);
  }
  return rows;
}

}  // namespace counterpoint
