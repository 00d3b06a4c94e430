// A batch returns the bits of one simulator run after run, on any number of threads.
#include "counterpoint/engine/batch.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "counterpoint/model/scene.h"
#include "support/paths.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint::test::batch_test {
namespace {

constexpr int kRollouts = 7;  // not a multiple of 2 or 5 threads
constexpr int kSteps = 150;   // beyond the first impacts

Scene scene() { return load_scene(source_dir() + "/data/scenes/quadruped_drop.yaml"); }

/// Force of a rollout at a step [N, N m]: a function of these two numbers only.
VectorX force(const Model& model, int rollout, int step) {
  Random random(static_cast<unsigned>(1000 * rollout + step / 10));
  VectorX out = random_vector(model.nv(), random.bits(), 2.0);
  out.head<6>().setZero();
  return out;
}

std::uint64_t roll_out(int rollout, Simulator& simulator) {
  simulator.reset();
  for (int k = 0; k < kSteps; ++k) {
    simulator.input().applied_force = force(simulator.model(), rollout, k);
    EXPECT_TRUE(simulator.step().succeeded());
  }
  return state_hash(simulator.state());
}

TEST(Batch, RolloutsHaveTheBitsOfOneAfterTheOther) {
  std::vector<std::uint64_t> alone;
  for (int i = 0; i < kRollouts; ++i) {
    Simulator fresh(scene());
    alone.push_back(roll_out(i, fresh));
  }
  for (const int threads : {1, 2, 5}) {
    Batch batch(scene(), threads);
    EXPECT_EQ(batch.num_threads(), threads);
    std::vector<std::uint64_t> together(kRollouts);
    batch.run(kRollouts,
              [&](int i, Simulator& simulator) { together[i] = roll_out(i, simulator); });
    EXPECT_EQ(together, alone) << threads << " threads";
  }
}

TEST(Batch, StepsManyStates) {
  constexpr int kStates = 40;
  Simulator alone(scene());
  std::vector<State> states;
  std::vector<Input> inputs;
  for (int i = 0; i < kStates; ++i) {
    states.push_back(alone.state());
    inputs.push_back({force(alone.model(), i, 0), {}});
    alone.step();
  }
  std::vector<State> expected = states;
  for (int i = 0; i < kStates; ++i) {
    alone.set_state(states[i]);
    alone.input() = inputs[i];
    ASSERT_TRUE(alone.step().succeeded());
    expected[i] = alone.state();
  }
  Batch batch(scene(), 3);
  std::vector<StepReport> reports(kStates);
  batch.step(states, inputs, reports);
  for (int i = 0; i < kStates; ++i) {
    EXPECT_TRUE(reports[i].succeeded());
    EXPECT_EQ(state_hash(states[i]), state_hash(expected[i])) << i;
  }
}

TEST(Batch, AFailedStepLeavesItsStateAndNoOther) {
  Simulator alone(scene());
  std::vector<State> states(3, alone.state());
  states[1].v[0] = std::numeric_limits<double>::quiet_NaN();
  const double q = states[1].q[2];
  const std::vector<Input> inputs(3, Input{VectorX::Zero(alone.model().nv()), {}});
  std::vector<StepReport> reports(3);
  Batch batch(scene(), 2);
  batch.step(states, inputs, reports);
  EXPECT_TRUE(reports[0].succeeded());
  EXPECT_FALSE(reports[1].succeeded());
  EXPECT_TRUE(reports[2].succeeded());
  EXPECT_EQ(states[1].q[2], q);
  EXPECT_EQ(state_hash(states[0]), state_hash(states[2]));
}

TEST(Batch, ThrowsWhatATaskThrew) {
  Batch batch(scene(), 2);
  std::atomic<int> begun{0};
  EXPECT_THROW(batch.run(1000,
                         [&](int i, Simulator&) {
                           ++begun;
                           if (i == 3) throw std::runtime_error("three");
                         }),
               std::runtime_error);
  EXPECT_GE(begun, 4);
  std::vector<State> states(2);
  std::vector<Input> inputs(1);
  std::vector<StepReport> reports(2);
  EXPECT_THROW(batch.step(states, inputs, reports), InputError);
  EXPECT_THROW(Batch(scene(), -1), InputError);
}

// Runge-Kutta has forward derivatives but no inverse.
TEST(Batch, WhatAnIntegratorHasNotIsNotANumber) {
  Scene falling = free_ball({});
  falling.options.integrator = Integrator::kRungeKutta4;
  Batch batch(falling, 1);
  const State start = Simulator(falling).state();
  const auto n = static_cast<std::size_t>(start.v.size());
  std::vector<double> force(n, 0.0), dq(n * n, 0.0), dv_du(n * n, 0.0);
  ForwardDerivativeBlocks forward;
  forward.dv_du = dv_du.data();
  batch.forward_derivatives({&start, 1}, {&start, 1}, {},
                            {force.data(), dq.data(), nullptr, nullptr, nullptr}, forward);
  for (const double x : force) EXPECT_TRUE(std::isnan(x));
  for (const double x : dq) EXPECT_TRUE(std::isnan(x));
  for (const double x : dv_du) EXPECT_TRUE(std::isfinite(x));
  EXPECT_GT(dv_du[0], 0.0);
}

TEST(Batch, DerivativesHaveTheBitsOfOneAfterTheOther) {
  constexpr int kCount = 30;  // not a multiple of a thread's chunk
  Simulator alone(scene());
  const Model& model = alone.model();
  std::vector<State> starts, ends;
  for (int i = 0; i < 20 * kCount; ++i) {
    const State start = alone.state();
    ASSERT_TRUE(alone.step().succeeded());
    if (i % 20 != 0) continue;
    starts.push_back(start);
    ends.push_back(alone.state());
  }
  const auto n = static_cast<std::size_t>(model.nv()), block = n * n;
  Workspace workspace(model);
  Inverse inverse;
  InverseDerivatives by_motion;
  ForwardDerivatives forward;
  std::vector<double> force, dq, dv_next, dv_du, dq_dv;
  std::vector<char> by_differences;
  const auto append = [](std::vector<double>& to, const auto& from) {
    to.insert(to.end(), from.data(), from.data() + from.size());
  };
  for (int i = 0; i < kCount; ++i) {
    ASSERT_TRUE(step_forward_derivatives(model, alone.options(), starts[i].q, starts[i].v,
                                         ends[i].v, Input(), workspace, inverse, by_motion,
                                         forward));
    append(force, inverse.applied_force);
    append(dq, by_motion.dq);
    append(dv_next, by_motion.dv_next);
    append(dv_du, forward.dv_du);
    append(dq_dv, forward.dq_dv);
    by_differences.push_back(by_motion.by_differences);
  }
  for (const int threads : {1, 2, 5}) {
    Batch batch(scene(), threads);
    std::vector<double> u(kCount * n), by_q(kCount * block), by_next(by_q), by_u(by_q), q_v(by_q);
    std::vector<char> flags(kCount);
    InverseDerivativeBlocks to{u.data(), by_q.data(), nullptr, by_next.data(), flags.data()};
    batch.inverse_derivatives(starts, ends, {}, to);
    EXPECT_EQ(u, force) << threads;
    EXPECT_EQ(by_q, dq) << threads;
    EXPECT_EQ(by_next, dv_next) << threads;
    EXPECT_EQ(flags, by_differences) << threads;
    ForwardDerivativeBlocks all;
    all.dv_du = by_u.data();
    all.dq_dv = q_v.data();
    batch.forward_derivatives(starts, ends, {}, {}, all);
    EXPECT_EQ(by_u, dv_du) << threads;
    EXPECT_EQ(q_v, dq_dv) << threads;
    EXPECT_THROW(batch.inverse_derivatives(starts, {}, {}, to), InputError);
  }
}

}  // namespace
}  // namespace counterpoint::test::batch_test
