// Pose and velocity of a frame by name, against the model's tree and against differences of poses
// along the motion.
#include <gtest/gtest.h>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/random_model.h"
#include "support/small_scenes.h"

namespace counterpoint::frames_test {
namespace {

/// Two ways to compute a pose, some ten products of rotations each: round-off only.
constexpr double kRoundoff = 1e-12;
/// Central differences with step 1e-5 on smooth functions of unit scale: error of order step^2.
constexpr double kDifferenceStep = 1e-5;
constexpr double kDifference = 2e-8;

class FramesOfRandomTrees : public ::testing::TestWithParam<int> {};

TEST_P(FramesOfRandomTrees, PosesAreThoseOfTheTreeAndVelocitiesTheirDerivatives) {
  test::Random random(GetParam());
  test::RandomModelOptions options;
  options.fixed_share = 0.3;  // links merged by fixed joints have frames too
  const Model model = test::make_random_model(GetParam(), options);
  State state;
  state.q = test::random_configuration(model, random.bits());
  state.v = test::random_vector(model.nv(), random.bits());
  const auto at = [&](double time) {
    State moved = state;
    integrate_configuration(model, state.q, state.v, time, moved.q);
    return frame_motions(model, moved);
  };
  const auto frames = frame_motions(model, state);
  const auto before = at(-kDifferenceStep), after = at(kDifferenceStep);
  const std::vector<Pose> X_WB = body_poses(model, state.q);
  ASSERT_EQ(frames.size(), model.frames().size());
  for (size_t i = 0; i < frames.size(); ++i) {
    const Frame& frame = model.frames()[i];
    const Pose expected = X_WB[frame.body] * frame.X_BF;
    EXPECT_LT((frames[i].X_WF.translation - expected.translation).norm(), kRoundoff) << frame.name;
    EXPECT_LT((frames[i].X_WF.rotation - expected.rotation).norm(), kRoundoff) << frame.name;
    const Vector3 velocity =
        (after[i].X_WF.translation - before[i].X_WF.translation) / (2.0 * kDifferenceStep);
    EXPECT_LT((frames[i].velocity - velocity).norm(), kDifference * (1.0 + velocity.norm()));
    // dR/dt R' = [omega]x.
    const Matrix3 spin = (after[i].X_WF.rotation - before[i].X_WF.rotation) /
                         (2.0 * kDifferenceStep) * frames[i].X_WF.rotation.transpose();
    const Vector3 omega(spin(2, 1), spin(0, 2), spin(1, 0));
    EXPECT_LT((frames[i].angular_velocity - omega).norm(), kDifference * (1.0 + omega.norm()));
    const FrameMotion by_name = frame_motion(model, state, frame.name);
    EXPECT_EQ(by_name.X_WF.translation, frames[i].X_WF.translation);
    EXPECT_EQ(by_name.velocity, frames[i].velocity);
  }
}
INSTANTIATE_TEST_SUITE_P(Trees, FramesOfRandomTrees, ::testing::Range(1, 13));

TEST(FrameMotion, OfAPendulumAsByHand) {
  Simulator sim(load_scene(test::source_dir() + "/data/scenes/pendulum.yaml"));
  for (int i = 0; i < 100; ++i) sim.step();
  const std::string& link = sim.model().frames().back().name;
  const FrameMotion motion = sim.frame(link);
  // The link turns about one axis at the rate v.
  EXPECT_NEAR(motion.angular_velocity.norm(), std::abs(sim.state().v[0]), kRoundoff);
}

TEST(Simulator, LastForcesAreTheInverseOfTheLastStep) {
  Simulator sim(load_scene(test::source_dir() + "/data/scenes/cube_drop.yaml"));
  EXPECT_THROW(sim.last_forces(), InputError);
  for (int i = 0; i < 500; ++i) sim.step();
  const State before = sim.state();
  sim.step();
  const Inverse kept = sim.last_forces();
  const Inverse& fresh = sim.inverse(before.q, before.v, sim.state().v);
  ASSERT_EQ(kept.contacts.size(), fresh.contacts.size());
  EXPECT_GT(kept.contacts.size(), 0u);
  EXPECT_EQ(kept.contact_force, fresh.contact_force);
  sim.reset();
  EXPECT_THROW(sim.last_forces(), InputError);
}

TEST(Simulator, LastForcesTellOfLimitsFrictionAndSlip) {
  // A block of 2 kg pushed by 30 N against its limit: the limit gives 30 N back.
  Simulator held(test::slider({.mass = 2.0, .upper = 0.0}));
  held.input().applied_force[0] = 30.0;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(held.step().succeeded());
  double limit = 0.0;
  for (const JointForce& joint : held.last_forces().joints)
    if (joint.effect == Effect::kLimits && joint.v_index == 0) limit += joint.force;
  EXPECT_NEAR(limit, -30.0, 1e-5);  // the limit yields by eps of the force
  // A block sliding against 5 N of dry friction.
  Simulator dragged(test::slider({.mass = 2.0, .dry_friction = 5.0}));
  dragged.input().applied_force[0] = 30.0;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(dragged.step().succeeded());
  const Inverse& forces = dragged.last_forces();
  ASSERT_EQ(forces.joints.size(), 1u);
  EXPECT_EQ(forces.joints[0].effect, Effect::kDryFriction);
  EXPECT_NEAR(forces.joints[0].force, -5.0, 1e-6);
  // A sliding box: every corner slips as the box does, against its friction.
  Simulator box(test::box_on_plane({}));
  State state = box.state();
  state.v[0] = 2.0;
  box.set_state(state);
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(box.step().succeeded());
  ASSERT_EQ(box.last_forces().contacts.size(), 4u);
  const double speed = box.state().v[0];
  for (const ContactForce& contact : box.last_forces().contacts) {
    const double sign = contact.contact.normal.z() > 0.0 ? 1.0 : -1.0;  // slip: B relative to A
    EXPECT_NEAR(sign * contact.slip.x(), speed, 1e-6);
    EXPECT_LT(contact.slip.dot(contact.force), 0.0);
  }
}

TEST(FrameMotion, AnUnknownNameNamesTheNearest) {
  const Model model = test::make_random_model(3);
  const std::string known = model.frames().front().name;
  try {
    State state;
    state.q = model.default_q();
    state.v = VectorX::Zero(model.nv());
    frame_motion(model, state, known + "x");
    FAIL() << "a name that no frame has";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(known), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace counterpoint::frames_test
