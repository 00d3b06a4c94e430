// What tests of a step's derivatives share: a moment of a scene, and the exact derivatives there
// against differences.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step/step_workspace.h"
#include "support/allocation_guard.h"
#include "support/random_model.h"

namespace counterpoint::test {

/// Of the largest entry. The reference, extrapolated differences, is right to about 1e-9 of it.
inline constexpr double kDerivativeTolerance = 1e-7;

inline double largest(const MatrixX& m) { return m.size() ? m.cwiseAbs().maxCoeff() : 0.0; }

/// Where speeds are scaled to keep energy, rounding alone ends the search: steps leave 1e-7, which
/// differences would see.
inline void sharpen(Workspace& ws) { ws.impl().start.set_projection_tolerance(1e-15); }

/// A moment of a scene and where it leads.
struct Moment {
  VectorX q, v, v_next;
  Input known;
  VectorX q_next = {};  ///< where derivatives want it
};

/// may_differ: what acts may have no closed form. Returns whether it has.
inline bool expect_exact(const Scene& scene, const Moment& at, const std::string& what,
                         bool may_differ = false, double difference_step = 0.0) {
  const Model& model = scene.model;
  Workspace ws(model);
  sharpen(ws);
  Inverse out;
  InverseDerivatives exact, reference;
  step_inverse_derivatives(model, scene.options, at.q, at.v, at.q_next, at.v_next, at.known, ws,
                           out, reference, DerivativeMethod::kExtrapolated, difference_step);
  step_inverse_derivatives(model, scene.options, at.q, at.v, at.q_next, at.v_next, at.known, ws,
                           out, exact);
  EXPECT_TRUE(may_differ || !exact.by_differences) << what;
  // An entry may vanish altogether: of a body without forces, say. M / h is there always.
  const double scale = largest(reference.dv_next) * 0.05;
  // Two differences with steps of their own differ by their rounding.
  if (!exact.by_differences) {
    EXPECT_LE(largest(exact.dq - reference.dq),
              kDerivativeTolerance * (scale + largest(reference.dq)))
        << what;
    EXPECT_LE(largest(exact.dv - reference.dv),
              kDerivativeTolerance * (scale + largest(reference.dv)))
        << what;
  }
  EXPECT_LE(largest(exact.dv_next - reference.dv_next),
            kDerivativeTolerance * largest(reference.dv_next))
      << what;
  const std::size_t before = allocation_count();
  step_inverse_derivatives(model, scene.options, at.q, at.v, at.q_next, at.v_next, at.known, ws,
                           out, exact);
  EXPECT_EQ(allocation_count(), before) << what;
  return !exact.by_differences;
}

/// Differences of two lengths agree, so that no kink lies within them.
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

/// Wide enough that no kink lies within a difference.
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

/// Where a step of the scene leads under `input`.
inline Moment step_moment(const Scene& scene, const Input& input) {
  Workspace ws(scene.model);
  const State start{0.0, scene.q, scene.v};
  State next = start;
  EXPECT_TRUE(step_forward(scene.model, scene.options, contact::Settings(), start, input, ws, next)
                  .succeeded());
  return {start.q, start.v, next.v, input, next.q};
}

/// Where a simulation of the scene is after so many steps, and one more.
inline Moment moment_of(const Scene& scene, int steps) {
  Simulator sim(scene);
  for (int i = 0; i < steps; ++i) EXPECT_TRUE(sim.step().succeeded());
  const State before = sim.state();
  EXPECT_TRUE(sim.step().succeeded());
  return {before.q, before.v, sim.state().v, sim.input(), sim.state().q};
}

}  // namespace counterpoint::test
