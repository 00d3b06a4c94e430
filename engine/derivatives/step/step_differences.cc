#include "counterpoint/engine/derivatives/step/step_differences.h"

#include <algorithm>

#include "counterpoint/engine/dynamics.h"

namespace counterpoint {
namespace {

/// Largest difference step of velocities [m/s, rad/s].
constexpr double kMaxVelocityStep = 1e-4;

/// Sets d(:, k) = (u(+s) - u(-s)) / (2 s); invert(k, shift, out) leaves u(shift) in `out`.
template <class Invert>
void difference_columns(int nv, double step, DifferenceScratch& scratch, MatrixX& d,
                        const Invert& invert) {
  for (int k = 0; k < nv; ++k) {
    invert(k, step, scratch.plus);
    invert(k, -step, scratch.minus);
    d.col(k) = (scratch.plus.applied_force - scratch.minus.applied_force) / (2.0 * step);
  }
}

template <class Invert>
void difference(int nv, double step, bool extrapolated, DifferenceScratch& scratch, MatrixX& d,
                const Invert& invert) {
  d.resize(nv, nv);
  difference_columns(nv, step, scratch, d, invert);
  if (!extrapolated) return;
  scratch.wide.resize(nv, nv);
  difference_columns(nv, 2.0 * step, scratch, scratch.wide, invert);
  d = (4.0 * d - scratch.wide) / 3.0;
}

}  // namespace

double velocity_difference_step(double step, double h) {
  return std::min(step / h, kMaxVelocityStep);
}

double suitable_difference_step(const SimulationOptions& options, bool constrained) {
  constexpr double kSmooth = 1e-6, kShare = 1e-5, kLeast = 1e-10;
  return constrained ? std::clamp(kShare * options.contact.smoothing, kLeast, kSmooth) : kSmooth;
}

void difference_step_inverse(const InverseArguments& of, Workspace& workspace,
                             const DifferenceOptions& how, DifferenceScratch& scratch,
                             InverseDerivatives& d) {
  const Model& model = of.model;
  const VectorRef &q = of.q, &v = of.v, &v_next = of.v_next;
  const auto [step, extrapolated, by_v_next] = how;
  const int nv = model.nv();
  const double v_step = velocity_difference_step(step, of.h());
  const auto none = VectorX();
  scratch.q = q;
  scratch.v = v;
  scratch.v_next = v_next;
  scratch.direction.setZero(nv);
  const auto invert = [&](Inverse& out) {
    step_inverse(model, of.options, scratch.q, scratch.v, none, scratch.v_next, of.known, workspace,
                 out);
  };
  difference(nv, step, extrapolated, scratch, d.dq, [&](int k, double s, Inverse& out) {
    scratch.direction[k] = 1.0;
    integrate_configuration(model, q, scratch.direction, s, scratch.q);
    scratch.direction[k] = 0.0;
    invert(out);
  });
  scratch.q = q;
  difference(nv, v_step, extrapolated, scratch, d.dv, [&](int k, double s, Inverse& out) {
    scratch.v[k] = v[k] + s;
    invert(out);
    scratch.v[k] = v[k];
  });
  if (!by_v_next) return;
  difference(nv, v_step, extrapolated, scratch, d.dv_next, [&](int k, double s, Inverse& out) {
    scratch.v_next[k] = v_next[k] + s;
    invert(out);
    scratch.v_next[k] = v_next[k];
  });
}

}  // namespace counterpoint
