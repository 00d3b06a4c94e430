#include "counterpoint/engine/step/step_start.h"

#include <algorithm>
#include <string>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/forces/driven/closure_switches.h"
#include "counterpoint/engine/step/step_forces.h"
#include "counterpoint/engine/step/step_workspace.h"
#include "counterpoint/engine/step/tree_parts.h"

namespace counterpoint {

StepStart::StepStart(const Model& model)
    : data_(model),
      tendons_(model),
      free_flight_(model),
      predictor_(model),
      mid_velocity_(model),
      energy_projection_(model),
      other_(VectorX::Zero(model.nv())),
      no_rotors_(VectorX::Zero(model.nv())) {
  actuates_tendons_ = std::any_of(model.actuators().begin(), model.actuators().end(),
                                  [](const Actuator& a) { return a.tendon >= 0; });
}

void StepStart::find_inertias(const Model& model, std::span<const BodyRange> ranges,
                              contact::ThreadPool* pool) {
  for_each_part(model, ranges, pool,
                [&](const BodyRange& bodies) { compute_inertias(model, bodies, data_); });
}

void StepStart::find_inertias(const Model& model) { compute_inertias(model, data_); }

/// Computes the kinematics of the awake trees and finds the constraints on them; wakes every tree
/// that these touch, and repeats until none is left.
void StepStart::find_constraints(const StepContext& at, ConstraintFinder& finder,
                                 Sleepers& sleepers, EffectCounts& counts,
                                 contact::ThreadPool* pool) {
  if (sleepers.awake().empty()) return constraints_.clear();
  const auto find = [&](std::span<const BodyRange> ranges) {
    for_each_part(at.model, ranges, pool, [&](const BodyRange& bodies) {
      compute_poses(at.model, at.q, bodies, data_);
      compute_velocities(at.model, at.v, bodies, data_);
    });
    finder.find(at, data_, constraints_, counts, sleepers.sleep_mask());
    const bool pulled = at.effects.has(Effect::kActuators) && actuates_tendons_;
    if (at.effects.has(Effect::kTendons) || pulled)
      tendons_.find(at.model, at.q, data_, sleepers.sleep_mask());
    if (!at.effects.has(Effect::kTendons)) return;
    counts.add(Effect::kTendons);
    add_tendon_rows(at, tendons_, finder.weights(), constraints_);
  };
  find(sleepers.awake());
  while (
      sleepers.wake_touched(at.model, constraints_, finder.contacts().search().in_reach_of_fast()))
    find(sleepers.woken());
}

/// Adds the velocity-dependent forces of a predicted tree that energy projection does not cover, at
/// the velocity in the middle of the step. share: the part of the forces that it covers [-].
void StepStart::add_unprojected_forces(const Model& model, const VectorRef& v, int tree,
                                       double share) {
  const Tree& of = model.trees()[tree];
  const auto part = Eigen::seqN(of.v_begin, of.v_end - of.v_begin);
  auto other = other_(part);
  other = v(part) * (1.0 - share) + (predictor_.velocity()(part) - v(part));
  if (share > 0.0) other -= share * energy_projection_.plain_change()(part);
  mid_velocity_.add_force(model, v, other_, of, data_);
}

/// Replaces the velocity-dependent forces of a semi-implicit step by their mean over the step where
/// that is known: free bodies (free_flight.h), fast linkages (energy_projection.h), linkages with a
/// predicted velocity (mid_velocity.h). The prediction also sets the biases of closures.
void StepStart::set_mean_forces(const StepContext& at, std::span<const BodyRange> awake) {
  if (!data_.has_coriolis) return;
  const Model& model = at.model;
  data_.mean_rotor_force.setZero();
  for (const BodyRange& bodies : awake) {
    std::fill(data_.has_mean_force.begin() + bodies.begin,
              data_.has_mean_force.begin() + bodies.end, 0);
    free_flight_.apply(model, at.h(), at.v, gravity_, bodies, data_, data_);
  }
  if (!at.options.mean_velocity_forces) return;
  predictor_.find(at, VelocityPredictor::Of::kLinkages, at.h(), gravity_, constraints_, awake,
                  data_);
  predictor_.refine(at, gravity_, constraints_, data_);
  const VectorX& rotors = rotor_inertia(model, at.effects);
  for (const BodyRange& bodies : awake) {
    for (int i = bodies.begin; i < bodies.end;) {
      const int t = model.body(i).tree;
      i = model.trees()[t].body_end;
      const bool predicted = predictor_.covers(t);
      const double share = energy_projection_.apply(at, predicted, rotors, t, data_);
      if (predicted) add_unprojected_forces(model, at.v, t, share);
    }
  }
}

/// Predicts the change that closures and mimic joints will make to w_m of the midpoint rule
/// (midpoint.h).
void StepStart::predict_equalities(const StepContext& at, std::span<const BodyRange> awake) {
  if (!data_.has_coriolis || constraints_.empty()) return;
  std::fill(data_.has_mean_force.begin(), data_.has_mean_force.end(), 0);
  predictor_.find(at, VelocityPredictor::Of::kUnderEqualities, 0.5 * at.h(), gravity_, constraints_,
                  awake, data_);
}

const VectorX& set_internal_states(const Model& model, EffectSet effects, const VectorRef& q,
                                   const VectorX& given, const Input& input, Workspace::Impl& ws) {
  if (given.size() != 0 && given.size() != model.nz())
    throw InputError("a step was given " + std::to_string(given.size()) +
                     " internal states; the model has " + std::to_string(model.nz()));
  ws.z = given_z(model, given);
  if (effects.has(Effect::kClosures)) switch_closures(model, q, input.attach, ws.z);
  return ws.z;
}

const StepStart& prepare_step(const StepContext& at, Workspace::Impl& ws) {
  StepStart& start = ws.start;
  start.predictor_.forget();
  ws.motion.external.has_external = false;
  ws.motion.external.added.clear();
  const auto find_constraints = [&] {
    const PhaseTimer timer(ws.times, &PhaseTimes::contacts);
    start.find_constraints(at, ws.finder, ws.sleepers, ws.counts, ws.pool.get());
    start.gravity_ = set_body_forces(at.model, at.effects, start.data_, ws.counts);
  };
  switch (at.options.integrator) {
    case Integrator::kSemiImplicitEuler:
      find_constraints();
      start.set_mean_forces(at, ws.sleepers.awake());
      ws.free_groups.find(at, start.constraints_, ws.sleepers.sleep_mask(), start.data_);
      break;
    case Integrator::kImplicitMidpoint:
      find_constraints();
      start.predict_equalities(at, ws.sleepers.awake());
      ws.free_groups.find(at, start.constraints_, {}, start.data_);
      break;
    case Integrator::kRungeKutta4:
      start.constraints_.clear();
      if (!ws.free_groups.any()) break;
      compute_poses(at.model, at.q, start.data_);
      compute_velocities(at.model, at.v, start.data_);
      ws.free_groups.find(at, start.constraints_, {}, start.data_);
      break;
  }
  ws.taut_links.find_losses(at.model, at.h(), start.data_);
  return start;
}

}  // namespace counterpoint
