// Derivatives of the inverse step and of the forward step.
#include "counterpoint/engine/step_derivatives.h"

#include <gtest/gtest.h>

#include "counterpoint/engine/integrator.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint {
namespace {

double largest(const MatrixX& m) { return m.size() ? m.cwiseAbs().maxCoeff() : 0.0; }

/// Differences of the forward step itself: error about the square of the step, and the solver's
/// tolerance over it.
constexpr double kForwardStep = 1e-5, kForwardDifference = 1e-6;

TEST(StepDerivatives, ForwardOnesAreThoseOfTheForwardStep) {
  for (int seed = 0; seed < 8; ++seed) {
    test::RandomModelOptions o;
    o.links = 1 + seed;
    o.base = seed % 2 == 0 ? Base::kFloating : Base::kFixed;
    o.damping = o.armature = o.springs = true;
    test::Random random(40 + seed);
    const Scene scene = test::make_random_scene(seed, o, random);
    const Model& model = scene.model;
    const int nv = model.nv();
    Workspace ws(model);
    contact::Settings settings;
    State state{0.0, scene.q, scene.v}, next = state;
    Input input;
    input.applied_force = test::random_vector(nv, 7 + seed);
    const auto step = [&](State& out) {
      ASSERT_TRUE(step_forward(model, scene.options, settings, state, input, ws, out).succeeded());
    };
    step(next);
    Inverse inverse;
    InverseDerivatives d_inverse;
    ForwardDerivatives d;
    ASSERT_TRUE(step_forward_derivatives(model, scene.options, state.q, state.v, next.v, input, ws,
                                         inverse, d_inverse, d));
    const State start = state;
    State plus = state, minus = state;
    VectorX direction = VectorX::Zero(nv), dq(nv);
    const auto compare = [&](int k, const MatrixX& dv_dx, const MatrixX& dq_dx, const char* what) {
      configuration_difference(model, next.q, plus.q, dq);
      VectorX dq_minus(nv);
      configuration_difference(model, next.q, minus.q, dq_minus);
      const VectorX dv_k = (plus.v - minus.v) / (2.0 * kForwardStep);
      const VectorX dq_k = (dq - dq_minus) / (2.0 * kForwardStep);
      EXPECT_LE((dv_dx.col(k) - dv_k).cwiseAbs().maxCoeff(),
                kForwardDifference * (1.0 + largest(dv_dx)))
          << what << " " << seed << " " << k;
      EXPECT_LE((dq_dx.col(k) - dq_k).cwiseAbs().maxCoeff(),
                kForwardDifference * (1.0 + largest(dq_dx)))
          << what << " " << seed << " " << k;
    };
    for (int k = 0; k < nv; ++k) {
      direction[k] = 1.0;
      integrate_configuration(model, start.q, direction, kForwardStep, state.q);
      step(plus);
      integrate_configuration(model, start.q, direction, -kForwardStep, state.q);
      step(minus);
      state.q = start.q;
      direction[k] = 0.0;
      compare(k, d.dv_dq, d.dq_dq, "q");
      state.v[k] = start.v[k] + kForwardStep;
      step(plus);
      state.v[k] = start.v[k] - kForwardStep;
      step(minus);
      state.v = start.v;
      compare(k, d.dv_dv, d.dq_dv, "v");
      const double u = input.applied_force[k];
      input.applied_force[k] = u + kForwardStep;
      step(plus);
      input.applied_force[k] = u - kForwardStep;
      step(minus);
      input.applied_force[k] = u;
      compare(k, d.dv_du, d.dq_du, "u");
    }
  }
}

}  // namespace
}  // namespace counterpoint
