// The MuJoCo adapter drives our scenes with the same bodies, frames, forces and signs as ours.
#include "peers/mujoco.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "apps/command.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/model.h"
#include "support/paths.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint::peers::mujoco_test {
namespace {

constexpr double kGravity = 9.81;
const MujocoSettings kBoth[] = {MujocoSettings::kDefault, MujocoSettings::kBest};

class MujocoTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (mujoco_version().empty()) GTEST_SKIP() << "MuJoCo was not found when this was built";
  }

  /// Loads a scene from YAML text; without contacts unless the text has a ground.
  Scene scene(const std::string& yaml) const {
    folder_.write("scene.yaml", "gravity: [0, 0, -9.81]\n" + yaml);
    return load_scene(folder_.path("scene.yaml"));
  }

  /// Steps for `seconds`.
  static void run(Mujoco& mujoco, const Scene& scene, double seconds, const Input& input = {}) {
    const long steps = std::lround(seconds / scene.options.time_step);
    for (long i = 0; i < steps; ++i) ASSERT_EQ(mujoco.step(input).failure, "");
  }

  test::CommandFolder folder_{"mujoco"};
};

/// Random trees with every joint type, rotated inertias and axes, and nonzero velocities.
Scene random_scene(std::uint64_t seed) {
  test::RandomModelOptions options;
  options.links = 10;
  options.robots = 2;
  options.armature = true;
  options.damping = true;
  test::Random random(seed);
  Scene scene = test::make_random_scene(seed, options, random);
  scene.options.effects = EffectSet::all().without({Effect::kContacts, Effect::kVelocityLimits});
  return scene;
}

TEST_F(MujocoTest, HasOurMassesFramesAndEnergy) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Scene scene = random_scene(seed);
    const Mujoco mujoco(scene, MujocoSettings::kDefault);
    Data data(scene.model);
    compute_poses(scene.model, scene.q, data);
    compute_velocities(scene.model, scene.v, data);
    compute_inertias(scene.model, data);

    // Round-off of a few hundred operations on numbers of size 1 ... 100.
    constexpr double kRoundOff = 1e-10;
    const std::vector<Pose> X_WB = mujoco.poses();
    const std::vector<Motion> V = mujoco.velocities();
    for (std::size_t i = 1; i < X_WB.size(); ++i) {
      EXPECT_LT((X_WB[i].translation - data.X_WB[i].translation).norm(), kRoundOff);
      EXPECT_LT((X_WB[i].rotation - data.X_WB[i].rotation).norm(), kRoundOff);
      EXPECT_LT((V[i].angular - data.V[i].angular).norm(), kRoundOff);
      EXPECT_LT((V[i].linear - data.V[i].linear).norm(), kRoundOff);
    }
    const double energy =
        kinetic_energy(scene.model, scene.v, data) + potential_energy(scene.model, data);
    EXPECT_NEAR(mujoco.energy(), energy, kRoundOff * std::max(1.0, std::abs(energy)));

    // Our floating joints express the linear velocity in the joint's frame.
    MatrixX to_mujoco = MatrixX::Identity(scene.model.nv(), scene.model.nv());
    for (const Body& body : scene.model.bodies()) {
      if (body.parent == 0 && body.joint_type == JointType::kFloating)
        to_mujoco.block<3, 3>(body.v_index, body.v_index) = body.X_PJ.rotation;
    }
    MatrixX M = MatrixX::Zero(scene.model.nv(), scene.model.nv());
    for (int tree = 0; tree < scene.model.num_trees(); ++tree) {
      const Tree& t = scene.model.trees()[static_cast<std::size_t>(tree)];
      const int n = t.v_end - t.v_begin;
      M.block(t.v_begin, t.v_begin, n, n) = reference_mass_matrix(scene.model, tree, scene.q);
    }
    EXPECT_LT((to_mujoco.transpose() * mujoco.mass_matrix() * to_mujoco - M).norm(),
              kRoundOff * M.norm());
  }
}

// Without constraints both schemes are semi-implicit Euler with implicit damping. One step agrees
// to first order, since we evaluate Coriolis forces at the middle of the step. Gravity, Coriolis
// forces, applied forces and wrenches all take part.
TEST_F(MujocoTest, StepsFreeTreesAsWeDo) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Scene scene = random_scene(seed);
    // The second-order difference is up to 1e-3 at 2 ms, mostly from the momentum balance of the
    // base, and 1e-11 at this step. For comparison: 1 N on 1 kg gives 2e-7 m/s.
    scene.options.time_step = 2e-7;
    const int nv = scene.model.nv();
    Input input;
    input.applied_force = test::random_vector(nv, seed + 100, 10.0);
    input.wrenches.push_back({scene.model.num_bodies() - 1,
                              {Vector3(1, 2, 3), Vector3(-4, 5, 6)},
                              Vector3(0.1, 0.2, -0.3)});
    Simulator sim(scene);
    sim.input() = input;
    ASSERT_TRUE(sim.step().succeeded());
    Mujoco mujoco(scene, MujocoSettings::kDefault);
    ASSERT_EQ(mujoco.step(input).failure, "");
    const double scale = std::max(1.0, sim.state().v.cwiseAbs().maxCoeff());
    EXPECT_LT((mujoco.state().v - sim.state().v).cwiseAbs().maxCoeff(), 1e-11 * scale) << seed;
    VectorX way(nv);
    configuration_difference(scene.model, sim.state().q, mujoco.state().q, way);
    // Round-off of the pose, plus h^2 / 2 times the base acceleration due to its links.
    EXPECT_LT(way.cwiseAbs().maxCoeff(), 2e-13 * scale) << seed;
  }
}

TEST_F(MujocoTest, FallsFreely) {
  const Scene ball = test::free_ball({.gravity = Vector3(0, 0, -kGravity)});
  for (const MujocoSettings settings : kBoth) {
    Mujoco mujoco(ball, settings);
    run(mujoco, ball, 1.0);
    // Semi-implicit Euler with a constant force: v is exact, the distance is g t (t + h) / 2.
    const double h = ball.options.time_step;
    EXPECT_NEAR(mujoco.state().v[2], -kGravity, 1e-11);
    EXPECT_NEAR(mujoco.state().q[2] - ball.q[2], -0.5 * kGravity * (1.0 + h), 1e-11);
    EXPECT_NEAR(mujoco.state().time, 1.0, 1e-12);
  }
}

TEST_F(MujocoTest, SwingsWithThePendulumsPeriod) {
  Scene pendulum = load_scene(test::source_dir() + "/data/scenes/pendulum.yaml");  // length 1 m
  pendulum.q[0] = 1e-3;
  const double h = pendulum.options.time_step;
  const double period = 2.0 * std::numbers::pi * std::sqrt(1.0 / kGravity);
  for (const MujocoSettings settings : kBoth) {
    Mujoco mujoco(pendulum, settings);
    double last = pendulum.q[0], first_crossing = 0.0, crossing = 0.0;
    int count = 0;
    while (count < 11) {
      ASSERT_EQ(mujoco.step({}).failure, "");
      const double now = mujoco.state().q[0];
      if (last < 0.0 && now >= 0.0) {
        crossing = mujoco.state().time - h * now / (now - last);
        if (count++ == 0) first_crossing = crossing;
      }
      last = now;
    }
    // Relative errors of the period: (w h)^2 / 24 = 4e-7 from the scheme, a^2 / 16 = 6e-8 from the
    // amplitude, 2e-7 from the inertia of the bob.
    EXPECT_NEAR((crossing - first_crossing) / 10.0, period, 2e-6 * period);
  }
}

TEST_F(MujocoTest, CarriesABoxByItsWeight) {
  const Scene box = test::box_on_plane({.mass = 3.0});
  for (const MujocoSettings settings : kBoth) {
    Mujoco mujoco(box, settings);
    run(mujoco, box, 2.0);
    Vector3 sum = Vector3::Zero();
    for (const ContactForce& c : mujoco.contacts()) {
      // Geometry A has the lower index; the force acts on B.
      const bool box_is_b = box.model.geometries()[std::size_t(c.contact.geometry_b)].body == 1;
      sum += box_is_b ? c.force : Vector3(-c.force);
      EXPECT_GT(c.contact.normal.dot(c.force), 0.0);
    }
    EXPECT_GE(mujoco.contacts().size(), 3u);
    // At rest; soft contacts settle slowly: 1e-6 of the weight measured.
    EXPECT_LT((sum - Vector3(0, 0, 3.0 * kGravity)).norm(), 1e-5 * 3.0 * kGravity);
  }
}

// MuJoCo itself would use the larger of the two friction coefficients.
TEST_F(MujocoTest, SlidesWithOurFrictionOfThePair) {
  const Scene block = scene(
      "ground: {friction: 0.8}\n"
      "models: [{name: a, box: [0.1, 0.1, 0.02], mass: 1, position: [0, 0, 0.02], friction: 0.2,"
      " velocity: {linear: [3, 0, 0]}}]\n");
  Mujoco mujoco(block, MujocoSettings::kBest);
  run(mujoco, block, 0.1);  // after the first bounces
  const double before = mujoco.state().v[0];
  run(mujoco, block, 0.4);
  // sqrt(0.2 0.8) = 0.4. The plate hops: 11 % off measured; the larger coefficient would give 100
  // %.
  EXPECT_NEAR((before - mujoco.state().v[0]) / 0.4, 0.4 * kGravity, 0.15 * 0.4 * kGravity);
}

TEST_F(MujocoTest, ClosuresCarryWhatHangsOnThem) {
  const std::string body = "{name: a, sphere: 0.1, mass: 2, position: [0.3, 0, 1]}";
  for (const char* closure :
       {"{type: ball, between: [world, a/body], anchor_a: [0.3, 0, 1.2]}",
        "{type: ball, between: [a/body, world], anchor_a: [0, 0, 0.2]}",
        "{type: weld, between: [world, a/body]}", "{type: weld, between: [a/body, world]}",
        "{type: distance, between: [world, a/body], anchor_a: [0.3, 0, 2], length: 1}",
        "{type: distance, between: [a/body, world], anchor_b: [0.3, 0, 2], length: 1}"}) {
    const Scene hanging = scene("models: [" + body + "]\nclosures: [" + closure + "]\n");
    const bool a_is_world = hanging.model.closures()[0].body_a == 0;
    for (const MujocoSettings settings : kBoth) {
      Mujoco mujoco(hanging, settings);
      run(mujoco, hanging, 2.0);
      const Vector3 on_b = mujoco.closures().at(0).force.force;
      const Vector3 known(0, 0, (a_is_world ? 1.0 : -1.0) * 2.0 * kGravity);
      EXPECT_LT((on_b - known).norm(), 1e-6 * known.norm()) << closure;  // at rest
      // Soft closures sag by about g / stiffness, 1 mm at the defaults.
      EXPECT_LT((mujoco.state().q.head<3>() - hanging.q.head<3>()).norm(), 1e-3) << closure;
    }
  }
}

TEST_F(MujocoTest, RodOfAnotherLengthThanAtTheStartIsPulledToIt) {
  const Scene rod = scene(
      "models: [{name: a, sphere: 0.1, mass: 2, position: [0, 0, 1]}]\n"
      "closures: [{type: distance, between: [world, a/body], anchor_a: [0, 0, 2], length: 1.1}]\n");
  Mujoco mujoco(rod, MujocoSettings::kBest);
  run(mujoco, rod, 2.0);
  EXPECT_NEAR(mujoco.state().q[2], 0.9, 1e-4);  // sag as in ClosuresCarryWhatHangsOnThem
}

TEST_F(MujocoTest, JointForcesAreOurs) {
  // A slider: dry friction holds 3 N, a servo pulls with 200 N/m, its effort limit cuts 50 N to 20
  // N.
  Scene held = test::slider({.mass = 2.0, .dry_friction = 5.0});
  Input push{VectorX::Constant(1, 3.0), {}};
  Mujoco friction(held, MujocoSettings::kBest);
  run(friction, held, 1.0, push);
  EXPECT_LT(std::abs(friction.state().v[0]), 1e-3);  // soft friction creeps
  push.applied_force[0] = 9.0;
  run(friction, held, 1.0, push);
  EXPECT_NEAR(friction.state().v[0], (9.0 - 5.0) / 2.0, 1e-2);

  const Scene limited = test::slider({.mass = 2.0, .effort_limit = 20.0});
  Mujoco cut(limited, MujocoSettings::kDefault);
  run(cut, limited, 1.0, {VectorX::Constant(1, 50.0), {}});
  EXPECT_NEAR(cut.state().v[0], 10.0, 1e-9);

  const Scene servo =
      test::slider({.mass = 2.0, .servo = {.stiffness = 200.0, .damping = 40.0, .position = 0.3}});
  Mujoco pulled(servo, MujocoSettings::kDefault);
  run(pulled, servo, 5.0, {VectorX::Constant(1, 10.0), {}});
  EXPECT_NEAR(pulled.state().q[0], 0.3 + 10.0 / 200.0, 1e-9);
}

TEST_F(MujocoTest, RefusesWhatMujocoLacks) {
  const Scene bouncing = test::box_on_plane({.restitution = 0.5});
  EXPECT_THROW(Mujoco(bouncing, MujocoSettings::kDefault), NotExpressible);
  const Scene quadratic = test::free_ball({.drag = {.quadratic = 1.0}});
  EXPECT_THROW(Mujoco(quadratic, MujocoSettings::kDefault), NotExpressible);
}

// When the contacts exceed the buffer, the step is repeated with a larger one.
TEST_F(MujocoTest, FindsRoomForContacts) {
  const Scene boxes = scene(
      "ground: {}\nmodels: [{name: a, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 0.0999],"
      " count: 100, spacing: [0.5, 0, 0]}]\n");
  Mujoco mujoco(boxes, MujocoSettings::kDefault);
  ASSERT_EQ(mujoco.step({}).failure, "");
  EXPECT_EQ(mujoco.contacts().size(), 400u);
}

TEST_F(MujocoTest, SaysThatAMotionIsLost) {
  Scene ball = test::free_ball({});
  ball.v[0] = 1e11;  // above the largest value that MuJoCo accepts
  Mujoco mujoco(ball, MujocoSettings::kDefault);
  EXPECT_NE(mujoco.step({}).failure, "");
}

}  // namespace
}  // namespace counterpoint::peers::mujoco_test
