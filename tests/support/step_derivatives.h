// Shared by tests of step derivatives: the variables of one step of a scene, and the comparison of
// exact derivatives with differences there.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step/step_workspace.h"
#include "support/allocation_guard.h"
#include "support/random_model.h"

namespace counterpoint::test {

/// Relative to the largest entry. The reference, extrapolated differences, is accurate to about
/// 1e-9.
inline constexpr double kDerivativeTolerance = 1e-7;

inline double largest(const MatrixX& m) { return m.size() ? m.cwiseAbs().maxCoeff() : 0.0; }

/// Lets only rounding end the iteration that scales speeds to conserve energy. Steps stop at 1e-7,
/// which differences would see.
inline void sharpen(Workspace& ws) { ws.impl().start.set_projection_tolerance(1e-15); }

/// State before a step, input, and velocity after it.
struct Moment {
  VectorX q, v, v_next;
  Input known;
  VectorX q_next = {};  ///< needed where derivatives depend on it
};

/// Compares the exact derivatives with extrapolated differences. may_differ: some forces may have
/// no closed form. Returns whether all have one.
inline bool expect_exact(const Scene& scene, const Moment& at, const std::string& what,
                         bool may_differ = false, double difference_step = 0.0) {
  const Model& model = scene.model;
  Workspace ws(model);
  sharpen(ws);
  Inverse out;
  InverseDerivatives exact, reference;
  for (int i = 0; i < model.num_bodies(); ++i)
    if (scene.options.integrator == Integrator::kSemiImplicitEuler)
      exact.contacts.bodies.push_back(i);
  reference.contacts.bodies = exact.contacts.bodies;
  step_inverse_derivatives(model, scene.options, at.q, at.v, at.q_next, at.v_next, at.known, ws,
                           out, reference, DerivativeMethod::kExtrapolated, difference_step);
  step_inverse_derivatives(model, scene.options, at.q, at.v, at.q_next, at.v_next, at.known, ws,
                           out, exact);
  EXPECT_TRUE(may_differ || !exact.by_differences) << what;
  // Entries may all vanish, for a body without forces for example; M / h in dv_next never does.
  const double scale = largest(reference.dv_next) * 0.05;
  // Two differences with different step lengths differ by their rounding.
  if (!exact.by_differences) {
    EXPECT_LE(largest(exact.dq - reference.dq),
              kDerivativeTolerance * (scale + largest(reference.dq)))
        << what;
    EXPECT_LE(largest(exact.dv - reference.dv),
              kDerivativeTolerance * (scale + largest(reference.dv)))
        << what;
    EXPECT_LE(largest(exact.contacts.dq - reference.contacts.dq),
              kDerivativeTolerance * (scale + largest(reference.dq)))
        << what;
    EXPECT_LE(largest(exact.contacts.dv - reference.contacts.dv),
              kDerivativeTolerance * (scale + largest(reference.dv)))
        << what;
  }
  EXPECT_LE(largest(exact.contacts.dv_next - reference.contacts.dv_next),
            kDerivativeTolerance * largest(reference.dv_next))
      << what;
  EXPECT_LE(largest(exact.dv_next - reference.dv_next),
            kDerivativeTolerance * largest(reference.dv_next))
      << what;
  const std::size_t before = allocation_count();
  step_inverse_derivatives(model, scene.options, at.q, at.v, at.q_next, at.v_next, at.known, ws,
                           out, exact);
  EXPECT_EQ(allocation_count(), before) << what;
  return !exact.by_differences;
}

/// True if differences of two step lengths agree, so that no kink lies within them.
inline bool is_smooth(const Scene& scene, const Moment& at, double difference_step) {
  Workspace ws(scene.model);
  sharpen(ws);
  Inverse out;
  InverseDerivatives d[2];
  for (const int i : {0, 1})
    step_inverse_derivatives(scene.model, scene.options, at.q, at.v, at.q_next, at.v_next, at.known,
                             ws, out, d[i], DerivativeMethod::kExtrapolated,
                             (1 + 2 * i) * difference_step);
  return largest(d[0].dq - d[1].dq) <= kDerivativeTolerance * largest(d[0].dq) &&
         largest(d[0].dv - d[1].dv) <= kDerivativeTolerance * largest(d[0].dv) &&
         largest(d[0].dv_next - d[1].dv_next) <= kDerivativeTolerance * largest(d[0].dv_next);
}

/// Widens the contact laws so that no kink lies within a difference.
inline void soften(Scene& scene) {
  scene.options.contact.smoothing = 1e-3;
  scene.options.contact.compliance = 1e-2;
}

inline Moment random_moment(const Scene& scene, Random& random, double change) {
  const int nv = scene.model.nv();
  Moment at{scene.q, scene.v, {}, {}};
  at.v_next = at.v + random_vector(nv, random.bits(), change);
  return at;
}

/// One step of the scene from its initial state under `input`.
inline Moment step_moment(const Scene& scene, const Input& input) {
  Workspace ws(scene.model);
  const State start{0.0, scene.q, scene.v};
  State next = start;
  EXPECT_TRUE(step_forward(scene.model, scene.options, contact::Settings(), start, input, ws, next)
                  .succeeded());
  return {start.q, start.v, next.v, input, next.q};
}

/// Runs the scene for `steps` steps; the moment is the step after these.
inline Moment moment_of(const Scene& scene, int steps) {
  Simulator sim(scene);
  for (int i = 0; i < steps; ++i) EXPECT_TRUE(sim.step().succeeded());
  const State before = sim.state();
  EXPECT_TRUE(sim.step().succeeded());
  return {before.q, before.v, sim.state().v, sim.input(), sim.state().q};
}

}  // namespace counterpoint::test
