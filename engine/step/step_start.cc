#include "counterpoint/engine/step/step_start.h"

#include <algorithm>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {

StepStart::StepStart(const Model& model)
    : free_flight_(model),
      predictor_(model),
      mid_velocity_(model),
      energy_projection_(model),
      other_(VectorX::Zero(model.nv())) {}

/// Of all that is awake, after all are awake that these touch.
void StepStart::find_constraints(const StepContext& at, Workspace::Impl& ws) {
  if (ws.sleepers.awake().empty()) return constraints_.clear();
  const PhaseTimer timer(ws.times, &PhaseTimes::contacts);
  const auto find = [&](std::span<const BodyRange> ranges) {
    for (const BodyRange& bodies : ranges) {
      compute_poses(at.model, at.q, bodies, ws.data);
      compute_velocities(at.model, at.v, bodies, ws.data);
    }
    ws.finder.find(at, ws.data, constraints_, ws.counts, ws.sleepers.idle_bodies());
  };
  find(ws.sleepers.awake());
  while (ws.sleepers.wake_touched(at.model, constraints_, ws.finder.in_reach_of_fast()))
    find(ws.sleepers.woken());
}

/// The share of a predicted tree's velocity-dependent forces that energy_projection leaves, and
/// what the rest of its acceleration makes of them, at the velocity in the middle of the step.
void StepStart::add_rest(const Model& model, const VectorRef& v, int t, double share,
                         Workspace::Impl& ws) {
  const Tree& tree = model.trees()[t];
  const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
  auto other = other_(part);
  other = v(part) * (1.0 - share) + (predictor_.velocity()(part) - v(part));
  if (share > 0.0) other -= share * energy_projection_.plain_change()(part);
  mid_velocity_.add_force(model, v, other_, tree, ws.data);
}

/// Velocity-dependent forces of a semi-implicit step: their mean over it where that is known
/// (free_flight.h, energy_projection.h). Predictions know of the constraints, and aim closures.
void StepStart::set_mean_forces(const StepContext& at, Workspace::Impl& ws) {
  if (!ws.data.has_coriolis) return;
  const Model& model = at.model;
  const std::span<const BodyRange> ranges = ws.sleepers.awake();
  Data& data = ws.data;
  data.mean_rotor_force.setZero();
  for (const BodyRange& bodies : ranges) {
    std::fill(data.has_mean_force.begin() + bodies.begin, data.has_mean_force.begin() + bodies.end,
              0);
    free_flight_.apply(model, at.h(), at.v, gravity_, bodies, data);
  }
  if (!at.options.mean_velocity_forces) return;
  predictor_.find(at, VelocityPredictor::Of::kLinkages, at.h(), gravity_, constraints_, ranges,
                  data);
  predictor_.refine(at, gravity_, constraints_, data);
  const VectorX& rotors = rotor_inertia(model, at.effects, ws);
  for (const BodyRange& bodies : ranges) {
    for (int i = bodies.begin; i < bodies.end;) {
      const int t = model.body(i).tree;
      i = model.trees()[t].body_end;
      const bool predicted = predictor_.covers(t);
      const double share = energy_projection_.apply(at, predicted, rotors, t, data);
      if (predicted) add_rest(model, at.v, t, share, ws);
    }
  }
}

/// What closures and mimic joints will make of w_m of the midpoint rule (midpoint.h).
void StepStart::predict_equalities(const StepContext& at, Workspace::Impl& ws) {
  if (!ws.data.has_coriolis || constraints_.empty()) return;
  std::fill(ws.data.has_mean_force.begin(), ws.data.has_mean_force.end(), 0);
  predictor_.find(at, VelocityPredictor::Of::kUnderEqualities, 0.5 * at.h(), gravity_, constraints_,
                  ws.sleepers.awake(), ws.data);
}

const StepStart& prepare_step(const StepContext& at, Workspace::Impl& ws) {
  StepStart& start = ws.start;
  start.predictor_.forget();
  ws.data.has_external = false;
  ws.data.added.clear();
  switch (at.options.integrator) {
    case Integrator::kSemiImplicitEuler:
      start.find_constraints(at, ws);
      start.gravity_ = set_body_forces(at.model, at.effects, ws);
      start.set_mean_forces(at, ws);
      ws.free_groups.find(at, start.constraints_, ws.sleepers.idle_bodies(), ws.data);
      break;
    case Integrator::kImplicitMidpoint:
      start.find_constraints(at, ws);
      start.gravity_ = set_body_forces(at.model, at.effects, ws);
      start.predict_equalities(at, ws);
      ws.free_groups.find(at, start.constraints_, {}, ws.data);
      break;
    case Integrator::kRungeKutta4:
      start.constraints_.clear();
      if (!ws.free_groups.any()) break;
      compute_poses(at.model, at.q, ws.data);
      compute_velocities(at.model, at.v, ws.data);
      ws.free_groups.find(at, start.constraints_, {}, ws.data);
      break;
  }
  ws.taut_links.find_losses(at.model, at.h(), ws.data);
  return start;
}

}  // namespace counterpoint
