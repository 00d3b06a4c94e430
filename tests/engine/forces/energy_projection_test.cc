// Trees that turn fast: their energy stays bounded and the inverse stays exact.
#include "counterpoint/engine/forces/energy_projection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/simulator.h"
#include "support/linkages.h"
#include "support/random_model.h"

namespace counterpoint::energy_projection_test {
namespace {

struct Conserved {
  double energy;
  Vector3 momentum;
};

/// Linear momentum of a tree [N s] at the kinematics in `data`.
Vector3 momentum_of(const Tree& tree, const Kinematics& data) {
  Vector3 sum = Vector3::Zero();
  for (int i = tree.body_begin; i < tree.body_end; ++i)
    sum += data.inertia[i].mass * data.V[i].at(data.inertia[i].center);
  return sum;
}

/// Momentum, and the kinetic energy that the projection keeps: that of a floating linkage about its
/// centre of mass is taken at q (-) h w, the pose where the last step's forces acted.
Conserved conserved(const Simulator& sim) {
  const Model& model = sim.model();
  const State& state = sim.state();
  const Data now = test::kinematics_of(sim);
  VectorX q = state.q;
  const auto moved = [&](const Tree& tree) {
    return model.body(tree.body_begin).joint_type == JointType::kFloating &&
           tree.body_end - tree.body_begin > 1;
  };
  for (const Tree& tree : model.trees())
    if (moved(tree))
      integrate_configuration(model, state.q, state.v, -sim.options().time_step,
                              {tree.body_begin, tree.body_end}, q);
  Data data(model);
  compute_poses(model, q, data);
  compute_velocities(model, state.v, data);
  compute_inertias(model, data);
  double energy = kinetic_energy(model, state.v, data);
  for (const Tree& tree : model.trees()) {
    if (!moved(tree)) continue;
    double mass = 0.0;
    for (int i = tree.body_begin; i < tree.body_end; ++i) mass += data.inertia[i].mass;
    energy +=
        0.5 / mass * (momentum_of(tree, now).squaredNorm() - momentum_of(tree, data).squaredNorm());
  }
  return {energy, total_momentum(model, now).force};
}

/// True if all joints below the base are revolute or spherical. The trees have six links, no
/// gravity and no other forces.
bool turns_only(const Model& model) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const JointType type = model.body(i).joint_type;
    const bool base = type == JointType::kFloating && model.body(i).parent == 0;
    if (!base && type != JointType::kRevolute && type != JointType::kSpherical) return false;
  }
  return true;
}

Model random_tree(int seed, Base base) {
  ModelBuilder builder(Vector3::Zero());
  builder.add_robot(test::make_random_robot(seed, {.links = 6, .base = base}), base, Pose(), "");
  return builder.build();
}

/// Calls visit(simulator) for ten such trees with velocities of up to `speed` [rad/s] a coordinate.
template <class Visit>
void for_each_tree(Base base, double speed, Visit visit) {
  int count = 0;
  for (int seed = 1; count < 10; ++seed) {
    ASSERT_LT(seed, 200) << "trees that turn only";
    Model model = random_tree(seed, base);
    if (!turns_only(model)) continue;
    ++count;
    SCOPED_TRACE(seed);
    Simulator sim = test::simulate(std::move(model));
    State state = sim.state();
    state.v = test::random_vector(sim.model().nv(), seed, speed);
    sim.set_state(state);
    visit(sim);
  }
}

class FastTree : public ::testing::TestWithParam<Base> {};
INSTANTIATE_TEST_SUITE_P(Bases, FastTree, ::testing::Values(Base::kFixed, Base::kFloating),
                         [](const auto& base) {
                           return base.param == Base::kFixed ? "fixed" : "floating";
                         });

TEST_P(FastTree, KeepsEnergyHoweverFast) {
  for (const double speed : {100.0, 1000.0}) {  // up to two radians a step
    for_each_tree(GetParam(), speed, [&](Simulator& sim) {
      const Conserved before = conserved(sim);
      // The tolerance of the velocity scaling, 1e-7, twice over in the energy, per step.
      constexpr double kEnergy = 2e-7;
      for (int i = 1; i <= 500; ++i) {
        ASSERT_TRUE(sim.step().succeeded()) << speed << " " << i;
        ASSERT_NEAR(conserved(sim).energy / before.energy, 1.0, kEnergy * i + 1e-10)
            << speed << " " << i;
      }
      // Rounding over 500 steps.
      if (GetParam() == Base::kFloating) {
        const Vector3 change = conserved(sim).momentum - before.momentum;
        EXPECT_LT(change.norm(), 1e-11 * before.momentum.norm());
      }
    });
  }
}

// Energy grows by h u'w+ less |w+ - w_free|^2_M / 2; internal torques do not change the momentum.
TEST(EnergyProjection, ForcesGiveNoMoreThanTheirWork) {
  for (const double speed : {100.0, 1000.0}) {
    for_each_tree(Base::kFloating, speed, [&](Simulator& sim) {
      const Conserved before = conserved(sim);
      const int joints = sim.model().nv() - 6;
      double work = 0.0, most = before.energy;
      for (int i = 1; i <= 500; ++i) {
        // Torques that could bring joints to their present speed within some tens of steps.
        sim.input().applied_force.tail(joints) = test::random_vector(joints, i, 20.0);
        ASSERT_TRUE(sim.step().succeeded()) << speed << " " << i;
        work += sim.options().time_step * sim.input().applied_force.dot(sim.state().v);
        const double energy = conserved(sim).energy;
        most = std::max(most, energy);
        // The tolerance of the velocity scaling, as above.
        ASSERT_LE(energy - before.energy, work + 2e-7 * most * i) << speed << " " << i;
      }
      // At 1000 rad/s the steps lose more energy than these torques add.
      if (speed < 1000.0) {
        EXPECT_GT(most, before.energy);
      }
      const Vector3 change = conserved(sim).momentum - before.momentum;
      EXPECT_LT(change.norm(), 1e-11 * std::sqrt(most / before.energy) * before.momentum.norm());
    });
  }
}

TEST_P(FastTree, TheInverseFindsNothingApplied) {
  // From speeds without any correction to speeds with the full one.
  for (const double speed : {1.0, 5.0, 10.0, 20.0, 1000.0}) {
    for_each_tree(GetParam(), speed, [&](Simulator& sim) {
      for (int i = 0; i < 50; ++i) {
        const VectorX q = sim.state().q, v = sim.state().v;
        ASSERT_TRUE(sim.step().succeeded());
        const Inverse& inverse = sim.inverse(q, v, sim.state().v);
        // Rounding of (w+ - w) / h, and of recursions through six links of up to a metre.
        double mass = 0.0;
        for (int b = 1; b < sim.model().num_bodies(); ++b) mass += sim.model().body(b).inertia.mass;
        const double rounding = 1e-13 * mass * v.cwiseAbs().maxCoeff() / sim.options().time_step;
        EXPECT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), rounding) << i;
      }
    });
  }
}

TEST_P(FastTree, NothingIsDoneToSlowTrees) {
  for_each_tree(GetParam(), 3.0, [&](Simulator& sim) {
    const Model& model = sim.model();
    Data data = test::kinematics_of(sim);
    EnergyProjection energy_projection(model);
    const VectorX none = VectorX::Zero(model.nv());
    // At 3 rad/s a coordinate and six links h omega^2 may exceed kSlow; at a hundredth of the time
    // step it is far below.
    SimulationOptions options;
    options.time_step = 2e-5;
    const StepContext at{model, options, EffectSet::all(), sim.state().q, sim.state().v};
    for (int t = 0; t < model.num_trees(); ++t) {
      EXPECT_EQ(energy_projection.apply(at, false, none, t, data), 0.0);
      EXPECT_FALSE(data.has_mean_force[model.trees()[t].body_begin]);
    }
  });
}

}  // namespace
}  // namespace counterpoint::energy_projection_test
