#include "counterpoint/engine/constraints/constraints.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/constraints/closures.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/constraints/joint_limits.h"
#include "counterpoint/engine/constraints/parked_contacts.h"
#include "counterpoint/engine/constraints/velocity_limits.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

/// One row a coordinate: it takes up to the bound and yields beyond.
void find_dry_friction(const Model& model, const SimulationOptions& options,
                       const std::vector<DryCoordinate>& coordinates, const InverseWeights& weights,
                       Idle idle, ConstraintSet& out) {
  for (const auto& [i, body] : coordinates) {
    if (idle(body)) continue;
    JointConstraint row;
    row.effect = Effect::kDryFriction;
    row.law = make_dry_friction_law(options.contact, options.time_step, weights.dof[i],
                                    model.dry_friction()[i]);
    row.v_index[0] = i;
    out.joints.push_back(row);
  }
}

void find_mimics(const Model& model, const SimulationOptions& options, const VectorRef& q,
                 const InverseWeights& weights, Idle idle, ConstraintSet& out) {
  for (const Mimic& mimic : model.mimics()) {
    if (idle(mimic.joint + 1)) continue;  // and so is the master, of the same island
    const Body& follower = model.body(mimic.joint + 1);
    const Body& master = model.body(mimic.master + 1);
    const double error = mimic_error(model, mimic, q);
    const double alpha = weights.dof[follower.v_index] +
                         mimic.multiplier * mimic.multiplier * weights.dof[master.v_index];
    JointConstraint row;
    row.effect = Effect::kMimics;
    row.law = make_mimic_law(options.contact, options.time_step, alpha, error);
    row.v_index[0] = follower.v_index;
    row.v_index[1] = master.v_index;
    row.coefficient[1] = -mimic.multiplier;
    out.joints.push_back(row);
  }
}

}  // namespace

bool has_equalities(const ConstraintSet& constraints) {
  return !constraints.closures.empty() ||
         std::any_of(constraints.joints.begin(), constraints.joints.end(),
                     [](const JointConstraint& row) {
                       return row.law.type == contact::LawType::kEquality;
                     });
}

ConstraintFinder::ConstraintFinder(const Model& model, InverseWeights weights)
    : weights_(std::move(weights)),
      collider_(model),
      radius_(collision::body_radii(model)),
      travel_(model.num_bodies(), 0.0),
      slack_(model.num_bodies(), 0.0),
      margin_(model.num_bodies(), 0.0),
      in_reach_(model.num_trees(), 0),
      turn_share_(Eigen::ArrayXd::Zero(model.num_bodies())),
      fastest_point_(turn_share_),
      wedged_(model.num_bodies(), 0),
      fall_(free_fall(model)),
      limited_(list_limited_coordinates(model)),
      speed_limits_(list_speed_limits(model)),
      acceleration_(model.closures().empty() ? 0 : model.num_bodies()),
      V_(model.num_bodies()),
      turn_(model.num_bodies()),
      turn_known_(model.num_bodies(), 0) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k)
      if (model.dry_friction()[k] > 0.0) dry_.push_back({k, i});
  }
}

void ConstraintFinder::find(const StepContext& at, const Data& data, ConstraintSet& out,
                            EffectCounts& counts, Idle idle) {
  const auto& [model, options, effects, q, v] = at;
  out.clear();
  std::fill(in_reach_.begin(), in_reach_.end(), 0);
  const auto runs = [&](Effect effect) {
    if (!at.effects.has(effect)) return false;
    counts.add(effect);
    return true;
  };
  if (runs(Effect::kContacts)) find_contacts(at, data, out, counts, idle);
  if (runs(Effect::kClosures))
    find_closures(model, options, data, weights_, idle, acceleration_, out);
  if (runs(Effect::kLimits)) find_joint_limits(at, limited_, weights_, idle, out);
  if (runs(Effect::kVelocityLimits))
    find_velocity_limits(options, speed_limits_, v, weights_, idle, out);
  if (runs(Effect::kDryFriction)) find_dry_friction(model, options, dry_, weights_, idle, out);
  if (runs(Effect::kMimics)) find_mimics(model, options, q, weights_, idle, out);
}

bool ConstraintFinder::find_overrun(const StepContext& at, const Reached& w, const Data& data,
                                    ConstraintSet& out, Idle idle) {
  const bool limits = at.effects.has(Effect::kLimits) &&
                      find_overrun_limits(at, limited_, w.velocity, weights_, idle, out);
  return find_reached_contacts(at, w, data, out) || limits;
}

Vector3 relative_velocity_at(const Vector3& position, int body_a, int body_b, const Data& data,
                             const std::vector<Motion>& V) {
  Vector3 linear = Vector3::Zero();
  if (body_a != 0) linear -= V[body_a].at(position - data.X_WB[body_a].translation);
  if (body_b != 0) linear += V[body_b].at(position - data.X_WB[body_b].translation);
  return linear;
}

contact::Rows relative_velocity(const PairConstraint& pair, const Data& data,
                                const std::vector<Motion>& V) {
  Vector3 angular = Vector3::Zero();
  if (pair.first + pair.law.rows > 3) {
    if (pair.body_a != 0) angular -= V[pair.body_a].angular;
    if (pair.body_b != 0) angular += V[pair.body_b].angular;
  }
  const Vector3 v = pair.frame.transpose() *
                    relative_velocity_at(pair.position, pair.body_a, pair.body_b, data, V);
  const Vector3 w = pair.frame.transpose() * angular;
  contact::Rows rows(pair.law.rows);
  for (int i = 0; i < pair.law.rows; ++i) {
    const int row = pair.first + i;
    rows[i] = row < 3 ? v[row] : w[row - 3];
  }
  return rows;
}

}  // namespace counterpoint
