// Semi-implicit steps whose contact problem is solved by the 2011 formulation instead of the
// spectral law (apps/accuracy/kinetic_energy/kinetic_energy.h): dense, in contact space, for
// comparison only.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "accuracy/kinetic_energy/kinetic_energy.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/step/step_constraints.h"
#include "counterpoint/engine/step/step_forces.h"
#include "counterpoint/engine/step/step_workspace.h"
#include "stepping_adapter.h"

namespace counterpoint::apps::accuracy {
namespace {

/// Range of contact forces at a distance [m]: the regularizer grows with the gap. At the default
/// compliance of 1e-6 a body 0.1 mm away feels half of the force that it would feel in contact.
constexpr double kReach = 1e-7;
/// Smoothing of the velocity bound [N m], and the speed below which it is continued quadratically
/// [m/s].
constexpr double kVelocitySmoothing = 1e-9, kContinuation = 1e-6;

class KineticEnergyAdapter : public SteppingAdapter {
 public:
  KineticEnergyAdapter(const Scene& scene, const EngineSetting& setting)
      : SteppingAdapter(scene, setting) {
    setting_.options.integrator = Integrator::kSemiImplicitEuler;
    setting_.options.contact.friction_model = FrictionModel::kConvex;  // the only one it has
  }

 private:
  StepReport step(const State& state, State& next) override {
    Workspace::Impl& ws = workspace_.impl();
    const double h = setting_.options.time_step;
    const EffectSet effects = active_effects(ws.called, setting_.options.effects);
    StepReport report;
    ws.sleepers.wake_all(model_);
    ws.constraints =
        prepare_step(
            {model_, setting_.options, effects, state.q, state.v, given_z(model_, state.z)}, ws)
            .constraints();
    const Input none;
    const StepArguments arguments{model_, setting_.options, setting_.solver,         state,
                                  none,   effects,          given_z(model_, state.z)};
    ws.start.find_inertias(model_);
    find_free_velocity(
        {arguments, ws.start, ws.sleepers, ws.taut_links, ws.counts, nullptr, nullptr}, ws.motion,
        ws.constraints, next.v, report);
    if (report.succeeded() && !ws.constraints.empty()) solve(next.v, report);
    next.q = state.q;
    integrate_configuration(model_, state.q, next.v, h, next.q);
    next.time = state.time + h;
    if (!next.q.allFinite() || !next.v.allFinite()) report.status = contact::Status::kNotFinite;
    return report;
  }

  void solve(VectorX& w_next, StepReport& report) {
    Workspace::Impl& ws = workspace_.impl();
    ContactSolution& solution = ws.solution;
    assemble_problem(model_, ws.constraints, w_next, ws.motion.forces.diagonal, ws.bodies(),
                     solution.block_of_tree, solution.problem);
    const contact::Problem& problem = solution.problem;
    const int rows = problem.num_rows(), size = problem.num_velocities();
    MatrixX J = MatrixX::Zero(rows, size), response = MatrixX::Zero(size, rows);
    contact::KineticEnergyProblem dual;
    for (int i = 0; i < problem.num_constraints(); ++i) {
      const int first = problem.first_row(i), count = problem.law(i).rows;
      for (int side = 0; side < 2; ++side) {
        const int block = problem.block(i, side);
        if (block < 0) continue;
        J.block(first, problem.block_start(block), count, problem.block_size(block)) +=
            problem.jacobian(i, side);
      }
      add_law(problem.law(i), dual);
    }
    for (int b = 0; b < problem.num_blocks(); ++b) {
      const int at = problem.block_start(b), n = problem.block_size(b);
      const MatrixX mass = problem.mass(b);
      response.middleRows(at, n) = mass.llt().solve(J.middleCols(at, n).transpose());
    }
    dual.A = J * response;
    dual.A = 0.5 * (dual.A + dual.A.transpose()).eval();
    dual.velocity_smoothing = kVelocitySmoothing;
    dual.continuation_speed = kContinuation;
    const VectorX free = problem.free_velocity();
    const contact::KineticEnergyResult result =
        contact::solve_kinetic_energy(dual, J * free, setting_.solver);
    report.status = result.status;
    report.newton_iterations = result.iterations;
    report.residual = result.residual;
    const VectorX w = free + response * result.f;
    for_each_touched(model_, solution,
                     [&](auto in_tree, auto in_block) { w_next(in_tree) = w(in_block); });
  }

  /// Adds the law of a constraint; its normal bias becomes a bound on the normal velocity.
  void add_law(contact::Law law, contact::KineticEnergyProblem& dual) const {
    double bound = 0.0;
    if (law.type == contact::LawType::kFrictionCone || law.type == contact::LawType::kUnilateral) {
      bound = law.bias[0];
      law.bias[0] = 0.0;
      const double gap = std::max(0.0, bound) * setting_.options.time_step;
      law.regularizer = contact::distant_regularizer(law.regularizer, gap, kReach);
    }
    dual.laws.push_back(law);
    dual.gap_speed.push_back(bound);
  }
};

}  // namespace

std::unique_ptr<EngineAdapter> kinetic_energy_adapter(const Scene& scene,
                                                      const EngineSetting& setting) {
  return std::make_unique<KineticEnergyAdapter>(scene, setting);
}

}  // namespace counterpoint::apps::accuracy
