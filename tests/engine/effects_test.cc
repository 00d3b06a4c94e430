// A scene runs the effects that it calls for and no instruction of any other.
#include "counterpoint/engine/effects.h"

#include <gtest/gtest.h>

#include <map>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "support/recover.h"
#include "support/temp_folder.h"

namespace counterpoint::effects_test {
namespace {

constexpr const char* kRobot = R"(<robot name="robot">
  <link name="base"/>
  <link name="upper">
    <inertial><mass value="1"/><origin xyz="0 0 -0.3"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.02"/></inertial>
  </link>
  <link name="lower">
    <inertial><mass value="0.5"/><origin xyz="0.1 0 -0.3"/><inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.01"/></inertial>
  </link>
  <joint name="shoulder" type="continuous">
    <parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>SHOULDER
  </joint>
  <joint name="elbow" type="ELBOW_TYPE">
    <parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.6"/><axis xyz="1 0 0"/>ELBOW
  </joint>
</robot>)";

struct Parts {
  std::string shoulder = "", elbow = "", elbow_type = "continuous";
  std::string scene = "";  ///< more keys of the scene file
  std::string more = "";   ///< more models
  std::string model = "";  ///< more keys of the robot
};

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  return text.replace(text.find(what), what.size(), with);
}

Scene make(const Parts& parts) {
  const test::TempFolder folder;
  std::string robot = replaced(kRobot, "ELBOW_TYPE", parts.elbow_type);
  robot = replaced(replaced(robot, "SHOULDER", parts.shoulder), "ELBOW", parts.elbow);
  folder.write("robot.urdf", robot);
  return load_scene(
      folder.write("scene.yaml", "models:\n  - {urdf: robot.urdf, name: r, position: [0, 0, 5]" +
                                     parts.model + "}\n" + parts.more + parts.scene + "\n"));
}

constexpr const char* kBall = "  - {name: ball, sphere: 0.1, mass: 1, position: [0, 0, 0.1]}\n";

/// Scenes that call for one effect each, besides gravity and Coriolis forces.
std::map<Effect, Parts> scenes_with() {
  return {
      {Effect::kDamping, {.shoulder = "<dynamics damping=\"0.3\"/>"}},
      {Effect::kDryFriction, {.shoulder = "<dynamics friction=\"0.3\"/>"}},
      {Effect::kBreakawayFriction,
       {.shoulder = "<dynamics friction=\"0.3\"/>",
        .model = ", dynamics: {shoulder: {breakaway_friction: 0.5, stribeck_speed: 1}}"}},
      {Effect::kLimits,
       {.elbow = "<limit lower=\"-1\" upper=\"1\" effort=\"10\" velocity=\"10\"/>",
        .elbow_type = "revolute"}},
      {Effect::kArmature, {.model = ", dynamics: {shoulder: {armature: 0.1}}"}},
      {Effect::kSprings, {.model = ", dynamics: {elbow: {stiffness: 20}}"}},
      {Effect::kServos,
       {.model = ", dynamics: {elbow: {servo: {stiffness: 20, damping: 1, position: 0.3}}}"}},
      {Effect::kEffortLimits, {.model = ", dynamics: {elbow: {effort_limit: 0.7}}"}},
      {Effect::kVelocityLimits,
       {.scene = "effects: {velocity_limits: on}",
        .model = ", dynamics: {elbow: {velocity_limit: 0.9}}"}},
      {Effect::kDrag, {.model = ", drag: {lower: {linear: 0.3, angular_quadratic: 0.1}}"}},
      {Effect::kMimics, {.elbow = "<mimic joint=\"shoulder\" multiplier=\"2\"/>"}},
      {Effect::kTendons,
       {.scene = "tendons: [{joints: {r/elbow: 1, r/shoulder: 0.5}, stiffness: 20}]"}},
      {Effect::kActuators, {.scene = "actuators: [{name: m, joint: r/elbow, command: 0.5}]"}},
      {Effect::kClosures,
       {.scene = "closures: [{type: distance, between: [r/lower, world], length: 3}]"}},
      {Effect::kContacts, {.scene = "ground: {friction: 0}", .more = kBall}},
      {Effect::kFriction, {.scene = "ground: {friction: 0.5}", .more = kBall}},
      {Effect::kStaticFriction,
       {.scene = "ground: {friction: 0.5}\ndefaults: {friction: 0.5, static_friction: 0.6}",
        .more = kBall}},
      {Effect::kFrictionDirections,
       {.scene = "ground: {friction: [0.25, 0.0625], friction_axis: [1, 0, 0]}\n"
                 "defaults: {friction: 1}",  // roots of powers of two are exact
        .more = kBall}},
      {Effect::kSurfaceMotion,  // slow, since a speed is rounded
       {.scene = "ground: {friction: 0.5, surface_velocity: [0.05, 0, 0]}", .more = kBall}},
      {Effect::kTorsionalFriction,
       {.scene = "ground: {friction: 0.5}\ndefaults: {torsional_friction: 0.01}", .more = kBall}},
      {Effect::kRollingFriction,
       {.scene = "ground: {friction: 0.5}\ndefaults: {rolling_friction: 0.01}", .more = kBall}},
      {Effect::kRestitution,
       {.scene = "ground: {friction: 0}\ndefaults: {restitution: 0.5}", .more = kBall}},
      {Effect::kStiffness,
       {.scene = "ground: {friction: 0}\ndefaults: {stiffness: 1000}", .more = kBall}},
  };
}

/// Effects that are part of every scene.
EffectSet always() {
  return {Effect::kGravity, Effect::kCoriolis, Effect::kAppliedForces, Effect::kExternalWrenches};
}

EffectSet with_effect(Effect effect) {
  EffectSet set = always();
  set.set(effect, true);
  const auto contacts = {Effect::kContacts, Effect::kSleeping};
  switch (effect) {
    case Effect::kLimits:  // a URDF limit sets all three
      set.set(Effect::kEffortLimits, true);
      set.set(Effect::kVelocityLimits, true);
      break;
    case Effect::kBreakawayFriction:
      set.set(Effect::kDryFriction, true);
      break;
    case Effect::kClosures:  // links that the closure may pull taut
      set.set(Effect::kTautLinks, true);
      break;
    case Effect::kStaticFriction:
    case Effect::kFrictionDirections:
    case Effect::kSurfaceMotion:
    case Effect::kTorsionalFriction:
    case Effect::kRollingFriction:
      set.set(Effect::kFriction, true);
      [[fallthrough]];
    case Effect::kContacts:
    case Effect::kFriction:
    case Effect::kRestitution:
    case Effect::kStiffness:
      for (const Effect e : contacts) set.set(e, true);
      break;
    default:
      break;
  }
  return set;
}

TEST(Effects, NamesAreReadBackAndDiffer) {
  for (int i = 0; i < kNumEffects; ++i) {
    const auto effect = static_cast<Effect>(i);
    EXPECT_EQ(effect_from_name(effect_name(effect)), effect);
  }
  EXPECT_FALSE(effect_from_name("unknown"));
}

TEST(Effects, AStepRunsWhatTheSceneCallsForAndNothingElse) {
  for (const auto& [effect, parts] : scenes_with()) {
    const Scene scene = make(parts);
    Workspace workspace(scene.model);
    State state{0.0, scene.q, scene.v}, next;
    state.v.setConstant(-0.5);
    const Input input{VectorX::Ones(scene.model.nv()), {}};
    ASSERT_TRUE(
        step_forward(scene.model, scene.options, {}, state, input, workspace, next).succeeded());
    Inverse inverse;
    step_inverse(scene.model, scene.options, state.q, state.v, next.v, workspace, inverse);
    const EffectSet allowed = with_effect(effect);
    for (int i = 0; i < kNumEffects; ++i) {
      const auto other = static_cast<Effect>(i);
      const long runs = workspace.effect_counts()[other];
      if (!allowed.has(other)) {
        EXPECT_EQ(runs, 0) << effect_name(other) << " in a scene with " << effect_name(effect);
      }
      if (other == effect) {
        EXPECT_GT(runs, 0) << effect_name(effect);
      }
    }
  }
}

TEST(Effects, SwitchedOffTheSceneMovesAsOneWithoutToTheBit) {
  const std::string smooth = "ground: {friction: 0}\ndefaults: {friction: 0}";
  // The same surfaces without the property under test.
  const std::map<Effect, std::string> without_it = {
      {Effect::kFriction, smooth},
      {Effect::kRestitution, smooth},
      {Effect::kStiffness, smooth},
      {Effect::kStaticFriction, "ground: {friction: 0.5}\ndefaults: {friction: 0.5}"},
      {Effect::kFrictionDirections, "ground: {friction: 0.125}\ndefaults: {friction: 1}"},
      {Effect::kSurfaceMotion, "ground: {friction: 0.5}"},
      {Effect::kTorsionalFriction, "ground: {friction: 0.5}"},
      {Effect::kRollingFriction, "ground: {friction: 0.5}"}};
  const Scene bare = make({}), bare_ball = make({.more = kBall});
  for (const auto& [effect, parts] : scenes_with()) {
    Scene scene = make(parts);
    scene.options.effects = EffectSet::all().without({effect});
    if (effect == Effect::kLimits) scene.options.effects.set(Effect::kVelocityLimits, false);
    Scene other = parts.more.empty() ? bare : bare_ball;
    if (const auto surface = without_it.find(effect); surface != without_it.end()) {
      Parts without = parts;
      without.scene = surface->second;
      other = make(without);
    }
    if (effect == Effect::kBreakawayFriction) other = make({.shoulder = parts.shoulder});
    Simulator off(std::move(scene)), never(std::move(other));
    for (Simulator* sim : {&off, &never}) {
      State state = sim->state();
      state.v.setConstant(-0.5);
      sim->set_state(state);
    }
    for (int k = 0; k < 50; ++k) {
      ASSERT_TRUE(off.step().succeeded() && never.step().succeeded());
      ASSERT_EQ(off.state().q, never.state().q) << effect_name(effect) << ", step " << k;
    }
  }
}

TEST(Effects, TheInverseRecoversWhatWasAppliedWithEachOfThem) {
  for (const auto& [effect, parts] : scenes_with()) {
    Simulator sim(make(parts));
    test::Random random(11);
    // Forces on the ball spin it up to 1 rad/s at most: rounding of w+ gives a force error of 1e-16
    // |J||w| / (r h).
    const double force = parts.more.empty() ? 0.5 : 0.01;
    EXPECT_LT(test::recover(sim, 300, force, random), test::kRecovered) << effect_name(effect);
  }
}

/// A ball and ground without any surface effect; `pair` adds properties of the pair.
Parts smooth_ball(const std::string& pair) {
  return {.scene = "ground: {friction: 0}\ndefaults: {friction: 0}\n" + pair, .more = kBall};
}

TEST(Effects, SurfacesOfPairsCallForTheirEffects) {
  const std::map<Effect, std::string> pairs = {{Effect::kFriction, "friction"},
                                               {Effect::kRestitution, "restitution"},
                                               {Effect::kTorsionalFriction, "torsional_friction"},
                                               {Effect::kRollingFriction, "rolling_friction"}};
  const Scene bare = make(smooth_ball(""));
  const EffectSet nothing = called_for(bare.model, collision::Collider(bare.model));
  for (const auto& [effect, key] : pairs) {
    const Scene scene =
        make(smooth_ball("pairs:\n  - {between: [ground, ball/body], " + key + ": 0.5}"));
    // Without sliding friction these two have no effect.
    if (effect == Effect::kTorsionalFriction || effect == Effect::kRollingFriction) {
      EXPECT_FALSE(called_for(scene.model, collision::Collider(scene.model)).has(effect)) << key;
      continue;
    }
    const EffectSet called = called_for(scene.model, collision::Collider(scene.model));
    EXPECT_FALSE(nothing.has(effect)) << key;
    EXPECT_TRUE(called.has(effect)) << key;
    EXPECT_EQ(called.without({effect}), nothing) << key;
  }
  for (const auto& [effect, key] : pairs) {
    if (effect == Effect::kFriction) continue;
    const Scene scene = make(
        smooth_ball("pairs:\n  - {between: [ground, ball/body], friction: 0.5, " + key + ": 0.5}"));
    const EffectSet called = called_for(scene.model, collision::Collider(scene.model));
    EXPECT_TRUE(called.has(effect)) << key;
    EXPECT_EQ(called.without({effect, Effect::kFriction}), nothing) << key;
  }
}

TEST(Effects, SurfacesOfPairsActAsThoseOfMaterials) {
  Simulator pair(
      make(smooth_ball("pairs: [{between: [ground, ball/body], friction: 0.5, "
                       "restitution: 0.5}]")));
  Simulator material(make({.scene = "ground: {friction: 0.5}\n"
                                    "defaults: {friction: 0.5, restitution: 0.5}",
                           .more = kBall}));
  for (Simulator* sim : {&pair, &material}) {
    State state = sim->state();
    state.v.setConstant(-0.5);
    sim->set_state(state);
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(sim->step().succeeded());
  }
  EXPECT_EQ(pair.state().q, material.state().q);
}

TEST(Effects, GravityOffIsAWorldWithoutGravity) {
  Scene off = make({.scene = "effects: {gravity: off}"});
  Scene never = make({.scene = "gravity: [0, 0, 0]"});
  Simulator a(std::move(off)), b(std::move(never));
  a.input().applied_force << 0.3, 0.2;
  b.input().applied_force << 0.3, 0.2;
  for (int k = 0; k < 100; ++k) {
    const State before = a.state();
    a.step();
    b.step();
    ASSERT_EQ(a.state().q, b.state().q);
    // The inverse knows the switch as well; only rounding is left.
    const Inverse& inverse = a.inverse(before.q, before.v, a.state().v);
    EXPECT_NEAR(inverse.applied_force[0], 0.3, 1e-9 * inverse.force_scale);
  }
}

TEST(Effects, WithoutCoriolisForcesASteadilyTurningBodyNeedsNoForce) {
  // Off: without gravity and forces the velocity stays constant for any inertia, and the inverse
  // recovers zero. On: the shoulder's motion drives the elbow.
  for (const bool on : {false, true}) {
    Simulator sim(make({.scene = std::string("gravity: [0, 0, 0]\neffects: {coriolis: ") +
                                 (on ? "on}" : "off}")}));
    State state = sim.state();
    state.v << 2.0, -3.0;
    sim.set_state(state);
    ASSERT_TRUE(sim.step().succeeded());
    const double change = (sim.state().v - state.v).cwiseAbs().maxCoeff();
    if (on) {
      EXPECT_GT(change, 1e-4);
    } else {
      EXPECT_EQ(change, 0.0);
    }
    const Inverse& inverse = sim.inverse(state.q, state.v, sim.state().v);
    EXPECT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Effects, TableSaysWhatCallsForEachAndWhoSwitchedItOff) {
  Scene scene = make({.shoulder = "<dynamics damping=\"0.3\" friction=\"0.1\"/>",
                      .scene = "effects: {damping: off}"});
  const std::vector<EffectUse> table =
      list_effects(scene.model, collision::Collider(scene.model), scene.options);
  ASSERT_EQ(table.size(), static_cast<size_t>(kNumEffects));
  const EffectUse& damping = table[static_cast<size_t>(Effect::kDamping)];
  EXPECT_TRUE(damping.called_for);
  EXPECT_FALSE(damping.on);
  EXPECT_NE(damping.why.find("r/shoulder"), std::string::npos) << damping.why;
  EXPECT_NE(damping.why.find("switched off"), std::string::npos) << damping.why;
  const EffectUse& dry = table[static_cast<size_t>(Effect::kDryFriction)];
  EXPECT_TRUE(dry.on);
  EXPECT_EQ(dry.rows, 1);
  EXPECT_FALSE(table[static_cast<size_t>(Effect::kContacts)].called_for);
}

TEST(Effects, UnknownNameIsAnErrorThatListsTheKnown) {
  try {
    make({.scene = "effects: {frction: off}"});
    FAIL() << "no error";
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("scene.yaml:"), std::string::npos) << message;
    EXPECT_NE(message.find("frction"), std::string::npos) << message;
    EXPECT_NE(message.find("torsional_friction"), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace counterpoint::effects_test
