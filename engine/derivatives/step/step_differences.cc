#include "counterpoint/engine/derivatives/step/step_differences.h"

#include <algorithm>

#include "counterpoint/engine/dynamics.h"

namespace counterpoint {
namespace {

/// Largest difference step of velocities [m/s, rad/s].
constexpr double kMaxVelocityStep = 1e-4;

/// Derivatives by one argument: of the applied force (nv x nv), and of the contact forces on some
/// bodies (3 n x nv).
struct Columns {
  MatrixX &u, &contacts;
};

/// Differences of the inverse of one model.
struct Differences {
  const Model& model;
  const std::vector<int>& bodies;  ///< ContactForceDerivatives::bodies
  DifferenceScratch& scratch;

  /// Sets the columns k to (u(+s) - u(-s)) / (2 s); invert(k, shift, out) leaves u(shift) in `out`.
  template <class Invert>
  void find(double step, const Invert& invert, Columns d) const {
    d.u.resize(model.nv(), model.nv());
    d.contacts.resize(3 * static_cast<Eigen::Index>(bodies.size()), model.nv());
    for (int k = 0; k < model.nv(); ++k) {
      const Inverse &plus = scratch.plus, &minus = scratch.minus;
      invert(k, step, scratch.plus);
      invert(k, -step, scratch.minus);
      d.u.col(k) = (plus.applied_force - minus.applied_force) / (2.0 * step);
      for (size_t i = 0; i < bodies.size(); ++i)
        d.contacts.col(k).segment<3>(3 * static_cast<Eigen::Index>(i)) =
            (contact_force_on(model, plus, bodies[i]) - contact_force_on(model, minus, bodies[i])) /
            (2.0 * step);
    }
  }

  template <class Invert>
  void find(double step, bool extrapolated, const Invert& invert, Columns d) const {
    find(step, invert, d);
    if (!extrapolated) return;
    find(2.0 * step, invert, {scratch.wide, scratch.wide_contacts});
    d.u = (4.0 * d.u - scratch.wide) / 3.0;
    d.contacts = (4.0 * d.contacts - scratch.wide_contacts) / 3.0;
  }
};

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
  const Differences differences{model, d.contacts.bodies, scratch};
  const auto by_q = [&](int k, double s, Inverse& out) {
    scratch.direction[k] = 1.0;
    integrate_configuration(model, q, scratch.direction, s, scratch.q);
    scratch.direction[k] = 0.0;
    invert(out);
  };
  differences.find(step, extrapolated, by_q, {d.dq, d.contacts.dq});
  scratch.q = q;
  const auto by_component = [&](const VectorRef& at, VectorX& changed) {
    return [&](int k, double s, Inverse& out) {
      changed[k] = at[k] + s;
      invert(out);
      changed[k] = at[k];
    };
  };
  differences.find(v_step, extrapolated, by_component(v, scratch.v), {d.dv, d.contacts.dv});
  if (!by_v_next) return;
  differences.find(v_step, extrapolated, by_component(v_next, scratch.v_next),
                   {d.dv_next, d.contacts.dv_next});
}

}  // namespace counterpoint
