#include "counterpoint/engine/sensors/sensor_derivatives.h"

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

/// Differences of configurations [m, rad]: where only smooth forces act, and with contacts and
/// limits, whose forces change within fractions of a millimetre.
constexpr double kSmoothStep = 1e-3, kConstrainedStep = 1e-8;
/// Residual of the solver at which rounding alone is left [-].
constexpr double kTolerance = 1e-15;

/// Evaluates the sensors in changed steps.
class ChangedStep {
 public:
  ChangedStep(const Model& model, const SimulationOptions& options, const State& state,
              const Input& input, Workspace& workspace, SensorTable& table)
      : start(state),
        known(input),
        model_(model),
        options_(options),
        workspace_(workspace),
        table_(table) {
    settings_.tolerance = kTolerance;
    if (known.applied_force.size() == 0) known.applied_force.setZero(model.nv());
    if (model.nz() > 0 && start.z.size() == 0) start.z = model.default_z();
  }

  /// Does the step; returns its report, and the values in `values` (NaN if it failed).
  StepReport step(VectorX& values) {
    const StepReport report =
        step_forward(model_, options_, settings_, start, known, workspace_, next_);
    values.setConstant(table_.size(), kNaN);
    if (!report.succeeded()) return report;
    Input of_step = known;
    of_step.z = start.z;
    of_step.softening = report.softening;
    find_taut_links(next_, of_step.taut_links);
    table_.evaluate({start.q, start.v, next_.q, next_.v, of_step, options_.time_step}, values);
    return report;
  }

  /// Returns the derivative of the values where set(change) changes the arguments.
  template <class Set>
  VectorX derivative(double length, const Set& set) {
    const auto at = [&](double change) {
      VectorX values;
      set(change);
      step(values);
      return values;
    };
    const VectorX near = at(length) - at(-length), far = at(2.0 * length) - at(-2.0 * length);
    set(0.0);
    return (8.0 * near - far) / (12.0 * length);
  }

  State start;
  Input known;

 private:
  const Model& model_;
  const SimulationOptions& options_;
  Workspace& workspace_;
  SensorTable& table_;
  contact::Settings settings_;
  State next_;
};

/// Diagonal of the mass matrix (nv) [kg, kg m^2].
VectorX inertias(const Model& model, const VectorX& q) {
  VectorX diagonal(model.nv());
  for (int t = 0; t < model.num_trees(); ++t) {
    const Tree& tree = model.trees()[static_cast<std::size_t>(t)];
    diagonal.segment(tree.v_begin, tree.v_end - tree.v_begin) =
        reference_mass_matrix(model, t, q).diagonal();
  }
  return diagonal;
}

}  // namespace

void sensor_derivatives(const Model& model, const SimulationOptions& options, const State& state,
                        const Input& input, Workspace& workspace, SensorTable& table,
                        SensorDerivatives& d) {
  const int nv = model.nv();
  for (MatrixX* m : {&d.dq, &d.dv, &d.du}) m->setConstant(table.size(), nv, kNaN);
  ChangedStep changed(model, options, state, input, workspace, table);
  VectorX values;
  const StepReport report = changed.step(values);
  if (!report.succeeded()) return;
  const double length = report.constraint_rows > 0 ? kConstrainedStep : kSmoothStep;
  const double speed = std::min(length / options.time_step, kSmoothStep);
  const VectorX inertia = inertias(model, state.q);
  VectorX unit = VectorX::Zero(nv);
  for (int k = 0; k < nv; ++k) {
    unit[k] = 1.0;
    d.dq.col(k) = changed.derivative(length, [&](double change) {
      integrate_configuration(model, state.q, unit, change, changed.start.q);
    });
    changed.start.q = state.q;
    unit[k] = 0.0;
    d.dv.col(k) =
        changed.derivative(speed, [&](double change) { changed.start.v[k] = state.v[k] + change; });
    const double given = changed.known.applied_force[k];
    d.du.col(k) = changed.derivative(inertia[k] * speed / options.time_step, [&](double change) {
      changed.known.applied_force[k] = given + change;
    });
  }
}

}  // namespace counterpoint
