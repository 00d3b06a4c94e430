#include "counterpoint/engine/sensors/sensor_derivatives.h"

#include "counterpoint/engine/derivatives/step/step_differences.h"

namespace counterpoint {
namespace {

/// Step of configurations where only kinematics is differentiated [m, rad].
constexpr double kKinematicStep = 1e-3;

/// Evaluates the sensors at changed arguments of one step.
class ChangedStep {
 public:
  ChangedStep(const Model& model, const SimulationOptions& options, const SensorStep& step,
              SensorTable& table)
      : q(step.q),
        v(step.v),
        v_next(step.v_next),
        model_(model),
        mean_velocity_(options.integrator == Integrator::kImplicitMidpoint),
        known_(step.known),
        h_(step.h),
        table_(table),
        q_next_(step.q_next) {}

  VectorX values() {
    const VectorX mean = 0.5 * (v + v_next);
    integrate_configuration(model_, q, mean_velocity_ ? mean : v_next, h_, q_next_);
    VectorX out(table_.size());
    table_.evaluate({q, v, q_next_, v_next, known_, h_}, out);
    return out;
  }

  VectorX q, v, v_next;

 private:
  const Model& model_;
  bool mean_velocity_;
  const Input& known_;
  double h_;
  SensorTable& table_;
  VectorX q_next_;
};

/// Returns df/ds at s = 0 from f(+-step), f(+-2 step).
template <class F>
VectorX extrapolated(double step, const F& f) {
  const VectorX near = f(step) - f(-step), far = f(2.0 * step) - f(-2.0 * step);
  return (8.0 * near - far) / (12.0 * step);
}

}  // namespace

void sensor_derivatives(const Model& model, const SimulationOptions& options,
                        const SensorStep& step, SensorTable& table, SensorDerivatives& d) {
  const int nv = model.nv();
  for (MatrixX* m : {&d.dq, &d.dv, &d.dv_next}) m->resize(table.size(), nv);
  ChangedStep changed(model, options, step, table);
  VectorX unit = VectorX::Zero(nv);
  const long inverses = table.work().inverses;
  if (table.size() == 0) return;
  changed.values();
  const bool smooth = table.work().inverses == inverses;
  const double s = smooth ? kKinematicStep : suitable_difference_step(options, true);
  const double s_v = velocity_difference_step(s, step.h);
  const auto by_component = [&](VectorX& argument, int k) {
    const double at = argument[k];
    const VectorX column = extrapolated(s_v, [&](double change) {
      argument[k] = at + change;
      return changed.values();
    });
    argument[k] = at;
    return column;
  };
  for (int k = 0; k < nv; ++k) {
    unit[k] = 1.0;
    d.dq.col(k) = extrapolated(s, [&](double change) {
      integrate_configuration(model, step.q, unit, change, changed.q);
      return changed.values();
    });
    unit[k] = 0.0;
    changed.q = step.q;
    d.dv.col(k) = by_component(changed.v, k);
    d.dv_next.col(k) = by_component(changed.v_next, k);
  }
}

SensorResponse sensor_response(const SensorDerivatives& sensors, const ForwardDerivatives& step) {
  return {sensors.dq + sensors.dv_next * step.dv_dq, sensors.dv + sensors.dv_next * step.dv_dv,
          sensors.dv_next * step.dv_du};
}

}  // namespace counterpoint
