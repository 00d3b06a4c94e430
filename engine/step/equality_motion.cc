#include "counterpoint/engine/step/equality_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {
namespace {

/// ContactOptions::compliance for equalities: the regularizer is this times alpha and
/// kClosureSoftness or kMimicSoftness. It is large enough for redundant closures and singular
/// poses, and too small for an error that a step would show.
constexpr double kCompliance = 1e-14;
/// Newton's method on the error of q: most steps, and the error [m, rad] that counts as zero.
constexpr int kMostSteps = 10;
constexpr double kClosed = 1e-14;

/// Options under which the bias of an equality is its curvature (stabilization 0), or its error
/// (stabilization 1, at rest).
SimulationOptions equality_options(const SimulationOptions& options, bool error) {
  SimulationOptions out = options;
  out.contact.compliance = kCompliance;
  out.contact.stabilization = error ? 1.0 : 0.0;
  out.contact.max_recovery_speed = std::numeric_limits<double>::infinity();
  out.time_step = error ? 1.0 : 2.0;
  return out;
}

EffectSet equalities_of(EffectSet effects) {
  EffectSet equalities;
  for (const Effect effect : {Effect::kClosures, Effect::kMimics})
    equalities.set(effect, effects.has(effect));
  return equalities;
}

/// Sets all biases to zero.
void drop_biases(ConstraintSet& constraints) {
  for (PairConstraint& pair : constraints.pairs) pair.law.bias.fill(0.0);
  for (JointConstraint& row : constraints.joints) row.law.bias.fill(0.0);
}

double largest_bias(const ConstraintSet& constraints) {
  double largest = 0.0;
  for (const PairConstraint& pair : constraints.pairs)
    for (int i = 0; i < pair.law.rows; ++i)
      largest = std::max(largest, std::abs(pair.law.bias[static_cast<size_t>(i)]));
  for (const JointConstraint& row : constraints.joints)
    largest = std::max(largest, std::abs(row.law.bias[0]));
  return largest;
}

}  // namespace

bool has_equalities(const Model& model, EffectSet effects, const VectorRef& z) {
  const auto acts = [&](const Closure& closure) { return closure.acts(z); };
  return (effects.has(Effect::kClosures) &&
          std::any_of(model.closures().begin(), model.closures().end(), acts)) ||
         (effects.has(Effect::kMimics) && !model.mimics().empty());
}

/// x (nv) becomes x - inv(M) J' f with J x + bias = 0 for the equalities in the constraints at
/// the poses of the stage. False if that has no solution.
bool EqualityMotion::solve(const Model& model, EffectSet effects, VectorX& x) {
  ContactSolution& solution = ws_.solution;
  contact::Problem& problem = solution.problem;
  assemble_problem(model, ws_.constraints, x, ws_.start.rotor_inertia(model, effects),
                   {ws_.stage.at, ws_.stage.velocity, ws_.motion.external, ws_.motion.scratch},
                   solution.block_of_tree, problem);
  solution.grow();
  Eigen::Ref<VectorX> velocities = solution.velocities();
  if (ws_.equality_solver.factor(problem)) {
    ws_.equality_solver.solve(problem, velocities);
  } else {
    velocities = problem.free_velocity();
    const contact::Report& solved =
        solution.solver.solve(problem, contact::Settings(), velocities, solution.impulses());
    if (!contact::succeeded(solved.status)) return false;
  }
  for_each_touched(model, solution,
                   [&](auto in_tree, auto in_block) { x(in_tree) = solution.velocity(in_block); });
  return true;
}

/// Finds the equalities at the kinematics of the stage.
void EqualityMotion::find(const StepContext& at) {
  ws_.finder.find({at.model, at.options, equalities_of(at.effects), at.q, at.v, at.z}, ws_.stage.at,
                  ws_.constraints, ws_.counts);
}

void EqualityMotion::constrain_acceleration(const StepContext& at, VectorX& acceleration,
                                            StepReport& report) {
  const SimulationOptions of_curvature = equality_options(at.options, false);
  find({at.model, of_curvature, at.effects, at.q, at.v, at.z});
  if (!solve(at.model, at.effects, acceleration)) report.status = contact::Status::kNoProgress;
}

double EqualityMotion::project(const StepArguments& step, State& state, StepReport& report) {
  const Model& model = step.model;
  const SimulationOptions& options = step.options;
  const EffectSet effects = step.effects;
  const SimulationOptions of_error = equality_options(options, true);
  const double most = options.time_step * options.contact.max_recovery_speed;
  VectorX& change = ws_.displacement;
  double first = 0.0, last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMostSteps; ++i) {
    change.setZero(model.nv());
    compute_kinematics(model, state.q, change, ws_.stage.at);
    find({model, of_error, effects, state.q, change, step.z});
    const double error = largest_bias(ws_.constraints);
    if (i == 0) first = error;
    // Ends at rounding, and where the equalities cannot close.
    if (error <= kClosed || !(error < 0.5 * last)) break;
    last = error;
    const double share = std::min(1.0, most / error);
    for (PairConstraint& pair : ws_.constraints.pairs)
      for (double& b : pair.law.bias) b *= share;
    for (JointConstraint& row : ws_.constraints.joints) row.law.bias[0] *= share;
    if (!solve(model, effects, change)) {
      report.status = contact::Status::kNoProgress;
      return first;
    }
    integrate_configuration(model, state.q, change, 1.0, state.q);
    if (share < 1.0) break;
  }
  compute_kinematics(model, state.q, state.v, ws_.stage.at);
  find({model, of_error, effects, state.q, state.v, step.z});
  drop_biases(ws_.constraints);
  if (!solve(model, effects, state.v)) report.status = contact::Status::kNoProgress;
  return first;
}

}  // namespace counterpoint
