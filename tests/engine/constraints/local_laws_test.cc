// A contact law depends on the contact's own motion and on the two bodies that it joins, not on
// bodies that do not touch them, however heavy and fast. Only the slip of friction
// (friction_slip.h) depends on the motion of bodies that touch them, and of bodies that touch
// those.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/estimate/contact_effects.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "support/random_model.h"
#include "support/temp_folder.h"

namespace counterpoint::local_laws_test {
namespace {

/// A pile of three boxes: `lower` and `upper` touch and have their own velocities; `above` touches
/// only `upper`.
std::string three_boxes(double compliance, double slide) {
  std::ostringstream text;
  text << "time_step: 0.002\ncontact: {compliance: " << compliance << "}\nground: {friction: 0.5}\n"
       << "models:\n"
       << "  - {name: lower, box: [0.2, 0.2, 0.1], mass: 2, friction: 0.5, position: [0, 0, 0.1]}\n"
       << "  - {name: upper, box: [0.1, 0.1, 0.1], mass: 0.1, friction: 0.5, restitution: 0.2,"
       << " position: [0.02, 0.01, 0.29999], velocity: {linear: [" << slide << ", 0.1, -0.2]}}\n"
       << "  - {name: above, box: [0.1, 0.1, 0.1], mass: 3, friction: 0.5,"
       << " position: [0.03, 0.01, 0.49998]}\n";
  return text.str();
}

/// Returns the laws of the contacts between the first two bodies.
std::vector<contact::Law> laws_between_first_two(const std::string& text) {
  const test::TempFolder folder;
  const Scene scene = load_scene(folder.write("scene.yaml", text));
  Data data(scene.model);
  ConstraintFinder finder(scene.model, compute_inverse_weights(scene.model, data));
  ConstraintSet found;
  const EffectSet effects =
      active_effects(called_for(scene.model, finder.collider()), scene.options.effects);
  estimation::find_all_constraints({scene.model, scene.options, effects, scene.q, scene.v}, finder,
                                   data, found);
  std::vector<contact::Law> laws;
  for (size_t i = 0; i < found.contacts.size(); ++i)
    if (found.pairs[i].body_a == 1 && found.pairs[i].body_b == 2)
      laws.push_back(found.pairs[i].law);
  return laws;
}

template <class Number>
bool same_bits(const Number& a, const Number& b) {
  return std::memcmp(&a, &b, sizeof(Number)) == 0;
}

bool is_same(const contact::Law& a, const contact::Law& b, bool slip) {
  return a.type == b.type && a.rows == b.rows && a.coulomb == b.coulomb &&
         same_bits(a.regularizer, b.regularizer) && same_bits(a.smoothing, b.smoothing) &&
         (!slip || same_bits(a.slip_speed, b.slip_speed)) && same_bits(a.bound, b.bound) &&
         same_bits(a.friction, b.friction) && same_bits(a.lean, b.lean) &&
         same_bits(a.bias, b.bias);
}

/// Expects every law of a among b, which may have more: near a fast body the search goes farther.
void expect_among(const std::vector<contact::Law>& a, const std::vector<contact::Law>& b,
                  bool slip) {
  for (const contact::Law& law : a)
    EXPECT_TRUE(std::any_of(b.begin(), b.end(),
                            [&](const contact::Law& other) { return is_same(law, other, slip); }));
}

TEST(LocalLaws, WhatDoesNotTouchTheTwoBodiesChangesNoLaw) {
  test::Random random(5);
  for (const double compliance : {1e-6, 0.1}) {
    for (const double slide : {0.0, 2.0}) {
      const std::string base = three_boxes(compliance, slide);
      const auto laws = laws_between_first_two(base);
      ASSERT_EQ(laws.size(), 4U);
      // On the third box, which joins it to their island; on the ground beside; far away.
      for (const auto& [place, apart] :
           {std::pair("0.03, 0.01, 0.69997", false), std::pair("1, 0, 0.09999", true),
            std::pair("0, 50, 70", true)}) {
        for (const double mass : {1e-6, 1.0, 1e9}) {
          std::ostringstream other;
          other << base << "  - {name: other, box: [0.1, 0.1, 0.1], mass: " << mass
                << ", friction: 0.5, position: [" << place << "], velocity: {linear: ["
                << random.uniform(-20.0, 20.0) << ", 0, 0], angular: [0, 0, 9]}}\n";
          SCOPED_TRACE(other.str());
          expect_among(laws, laws_between_first_two(other.str()), apart);
        }
      }
    }
  }
}

/// A robot in the air holds a part between two sprung fingers while its motor spins a wheel on the
/// ground at 5 to 20 m/s. Returns the speed at which the part slips through the fingers [m/s].
double creep_in_the_grip(double rim_speed, double time_step) {
  const test::TempFolder folder;
  folder.write("robot.urdf", R"(<robot name="r">
 <link name="base"><inertial><mass value="20"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size="0.6 0.6 0.2"/></geometry></collision></link>
 <link name="slider"><inertial><mass value="0.5"/><inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <link name="wheel"><inertial><mass value="1"/><inertia ixx="0.005" iyy="0.01" izz="0.005" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
 <link name="left"><inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size="0.02 0.06 0.06"/></geometry></collision></link>
 <link name="right"><inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size="0.02 0.06 0.06"/></geometry></collision></link>
 <joint name="lower" type="prismatic"><parent link="base"/><child link="slider"/><origin xyz="0.6 0 0"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" effort="1000" velocity="10"/></joint>
 <joint name="spin" type="continuous"><parent link="slider"/><child link="wheel"/><axis xyz="0 1 0"/></joint>
 <joint name="jl" type="prismatic"><parent link="base"/><child link="left"/><origin xyz="-0.0305 0 0.5"/><axis xyz="1 0 0"/>
  <limit lower="-0.05" upper="0.05" effort="60" velocity="1"/></joint>
 <joint name="jr" type="prismatic"><parent link="base"/><child link="right"/><origin xyz="0.0305 0 0.5"/><axis xyz="-1 0 0"/>
  <limit lower="-0.05" upper="0.05" effort="60" velocity="1"/></joint>
</robot>)");
  std::ostringstream text;
  text << "time_step: " << time_step
       << "\nground: {friction: 0.5}\ndefaults: {friction: 0.5}\nmodels:\n"
       << "  - {urdf: robot.urdf, name: r, base: floating, position: [0, 0, 0.1], dynamics: {"
       << "jl: {servo: {stiffness: 5000, damping: 50, position: 0.004}}, "
       << "jr: {servo: {stiffness: 5000, damping: 50, position: 0.004}}, "
       << "spin: {servo: {stiffness: 0, damping: 100, velocity: " << rim_speed / 0.1 << "}}, "
       << "lower: {servo: {stiffness: 5000, damping: 500, position: -0.002}}}}\n"
       << "  - {name: part, box: [0.02, 0.02, 0.02], mass: 0.3, position: [0, 0, 0.6]}\n";
  Simulator sim(load_scene(folder.write("scene.yaml", text.str())));
  const Model& model = sim.model();
  const int part = model.body(model.num_bodies() - 1).q_index;
  const auto height = [&] { return sim.state().q[part + 2] - sim.state().q[2]; };
  const int steps = static_cast<int>(std::lround(1.0 / time_step));
  for (int i = 0; i < steps; ++i) EXPECT_TRUE(sim.step().succeeded());
  const double before = height();
  for (int i = 0; i < steps; ++i) EXPECT_TRUE(sim.step().succeeded());
  return std::abs(height() - before);
}

// 0.3 kg is a third of the friction cone. The compliance gives about eps g h, 1e-8 m/s.
TEST(LocalLaws, AGripHoldsWhileAWheelOfTheRobotSpins) {
  constexpr double kCreep = 1e-7;  // [m/s]
  for (const double rim_speed : {5.0, 20.0}) EXPECT_LT(creep_in_the_grip(rim_speed, 2e-3), kCreep);
  EXPECT_LT(creep_in_the_grip(20.0, 5e-3), kCreep);
}

}  // namespace
}  // namespace counterpoint::local_laws_test
