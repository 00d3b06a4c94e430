#include "counterpoint/engine/step.h"

#include "counterpoint/contact/law.h"
#include "counterpoint/engine/aba.h"
#include "counterpoint/engine/assemble.h"
#include "counterpoint/engine/integrator.h"
#include "counterpoint/engine/kinematics.h"
#include "counterpoint/engine/rnea.h"

namespace counterpoint {

struct Workspace::Impl {
  explicit Impl(const Model& model)
      : data(model),
        finder(model, compute_inverse_weights(model, data)),
        velocity(model.num_bodies()),
        body_impulse(model.num_bodies()),
        tau(VectorX::Zero(model.nv())),
        extra(VectorX::Zero(model.nv())),
        acceleration(VectorX::Zero(model.nv())) {}

  Data data;
  ConstraintFinder finder;
  ConstraintSet constraints;

  // forward
  std::vector<int> block_of_tree;
  contact::Problem problem;
  contact::Solver solver;
  // Grown only: Eigen allocates whenever a size changes.
  VectorX w;        ///< velocities of the touched trees, as the problem orders them, then unused
  VectorX impulse;  ///< of all constraints, then unused

  // inverse
  std::vector<Motion> velocity;  ///< V at v_next
  std::vector<Force> body_impulse;

  VectorX tau, extra, acceleration;
};

Workspace::Workspace(const Model& model) : impl_(std::make_unique<Impl>(model)) {}
Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

namespace {

void set_external(const std::vector<ExternalWrench>& wrenches, Data& data) {
  data.has_external = !wrenches.empty();
  if (!data.has_external) return;
  for (Force& f : data.external) f = Force();
  for (const ExternalWrench& w : wrenches) data.external[w.body] += w.wrench;
}

/// w* = w + h inv(M + hD) (n + u - D w): the velocity if there were no constraint.
bool compute_free_velocity(const Model& model, double h, const State& state, const Input& input,
                           Workspace::Impl& ws, VectorX& w_free) {
  ws.tau = input.applied_force;
  if (model.has_damping()) {
    ws.tau.noalias() -= model.damping().cwiseProduct(state.v);
    ws.extra = h * model.damping();
  }
  set_external(input.wrenches, ws.data);
  const bool ok = aba(model, ws.tau, ws.extra, model.gravity(), 1, model.num_bodies(), ws.data,
                      ws.acceleration);
  w_free = state.v + h * ws.acceleration;
  return ok;
}

void grow(VectorX& v, int size) {
  if (v.size() < size) v.resize(size);
}

/// Replaces the velocities of the touched trees by the solution of the contact problem.
void solve_constraints(const Model& model, const contact::Settings& settings, const State& state,
                       Workspace::Impl& ws, VectorX& w, StepReport& report) {
  assemble_problem(model, ws.constraints, w, ws.extra, ws.data, ws.block_of_tree, ws.problem);
  grow(ws.w, ws.problem.num_velocities());
  grow(ws.impulse, ws.problem.num_rows());
  for (int t = 0; t < model.num_trees(); ++t) {
    const int block = ws.block_of_tree[t];
    if (block < 0) continue;
    const Tree& tree = model.trees()[t];
    ws.w.segment(ws.problem.block_start(block), ws.problem.block_size(block)) =
        state.v.segment(tree.v_begin, tree.v_end - tree.v_begin);
  }
  const contact::Report& solved =
      ws.solver.solve(ws.problem, settings, ws.w.head(ws.problem.num_velocities()),
                      Eigen::Ref<VectorX>(ws.impulse.head(ws.problem.num_rows())));
  report.status = solved.status;
  report.newton_iterations = solved.iterations;
  report.residual = solved.residual;
  for (int t = 0; t < model.num_trees(); ++t) {
    const int block = ws.block_of_tree[t];
    if (block < 0) continue;
    const Tree& tree = model.trees()[t];
    w.segment(tree.v_begin, tree.v_end - tree.v_begin) =
        ws.w.segment(ws.problem.block_start(block), ws.problem.block_size(block));
  }
}

}  // namespace

StepReport step_forward(const Model& model, const SimulationOptions& options,
                        const contact::Settings& settings, const State& state, const Input& input,
                        Workspace& workspace, State& next) {
  Workspace::Impl& ws = workspace.impl();
  const double h = options.time_step;
  StepReport report;
  compute_poses(model, state.q, ws.data);
  compute_velocities(model, state.v, ws.data);
  compute_inertias(model, ws.data);
  ws.finder.find(model, options, state.q, state.v, ws.data, ws.constraints);
  if (!compute_free_velocity(model, h, state, input, ws, next.v))
    report.status = contact::Status::kSingular;
  if (report.succeeded() && !ws.constraints.empty())
    solve_constraints(model, settings, state, ws, next.v, report);
  next.q.resize(model.nq());
  integrate_configuration(model, state.q, next.v, h, next.q);
  next.time = state.time + h;
  if (report.succeeded() && !(next.v.allFinite() && next.q.allFinite()))
    report.status = contact::Status::kNotFinite;
  report.contacts = static_cast<int>(ws.constraints.contacts.size());
  report.constraint_rows = ws.constraints.empty() ? 0 : ws.problem.num_rows();
  report.max_penetration = ws.constraints.max_penetration;
  return report;
}

namespace {

/// J' f of all constraints at the velocity v_next, into ws.tau [N s]; contacts and closures listed
/// in `out`.
void recover_impulses(const Model& model, const VectorRef& v_next, double h, Workspace::Impl& ws,
                      Inverse& out) {
  compute_body_velocities(model, v_next, ws.data, ws.velocity);
  ws.tau.setZero();
  out.contacts.clear();
  out.closures.assign(model.closures().size(), {});
  for (Force& f : ws.body_impulse) f = Force();
  const ConstraintSet& constraints = ws.constraints;
  for (size_t i = 0; i < constraints.pairs.size(); ++i) {
    const PairConstraint& pair = constraints.pairs[i];
    contact::Rows y = relative_velocity(pair, ws.data, ws.velocity);
    for (int row = 0; row < pair.law.rows; ++row) y[row] += pair.law.bias[row];
    const Force impulse = pair_impulse(pair, contact::impulse(pair.law, y));
    add_pair_impulse(pair, impulse, ws.data, ws.body_impulse);
    if (i < constraints.contacts.size()) {
      out.contacts.push_back({constraints.contacts[i], impulse.force / h});
    } else {
      ClosureForce& closure = out.closures[constraints.closures[i - constraints.contacts.size()]];
      closure.position = pair.position;
      closure.force += impulse * (1.0 / h);
    }
  }
  project_on_joints(model, ws.data, ws.body_impulse, ws.tau);
  for (const JointConstraint& j : ws.constraints.joints) {
    contact::Rows y(1);
    y[0] = j.coefficient[0] * v_next[j.v_index[0]] + j.law.bias[0];
    if (j.v_index[1] >= 0) y[0] += j.coefficient[1] * v_next[j.v_index[1]];
    const double f = contact::impulse(j.law, y)[0];
    for (int k = 0; k < 2; ++k)
      if (j.v_index[k] >= 0) ws.tau[j.v_index[k]] += j.coefficient[k] * f;
  }
}

}  // namespace

void step_inverse(const Model& model, const SimulationOptions& options, VectorRef q, VectorRef v,
                  VectorRef v_next, Workspace& workspace, Inverse& out) {
  Workspace::Impl& ws = workspace.impl();
  const double h = options.time_step;
  compute_poses(model, q, ws.data);
  compute_velocities(model, v, ws.data);
  ws.finder.find(model, options, q, v, ws.data, ws.constraints);
  recover_impulses(model, v_next, h, ws, out);
  out.contact_force = ws.tau / h;

  ws.acceleration = (v_next - v) / h;
  ws.data.has_external = false;
  rnea(model, ws.acceleration, ws.data, ws.tau);
  if (model.has_damping()) ws.tau += model.damping().cwiseProduct(v_next);
  out.applied_force = ws.tau - out.contact_force;
  out.force_scale = 0.0;
  for (const VectorX* force : {&ws.tau, &out.contact_force, &out.applied_force})
    out.force_scale = std::max(out.force_scale, force->size() ? force->cwiseAbs().maxCoeff() : 0.0);
}

}  // namespace counterpoint
