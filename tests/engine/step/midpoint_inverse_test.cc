// The implicit_midpoint inverse computes the contact velocity from poses, whose rounding scales
// with the size of the scene, and refines it by the velocities.
#include <gtest/gtest.h>

#include <algorithm>

#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/random_model.h"

namespace counterpoint::midpoint_inverse_test {
namespace {

struct Error {
  double force = 0.0, largest = 0.0;
  double relative() const { return force / largest; }
};

/// Returns the largest error over the steps. Random forces of up to `force` [N, N m], redrawn every
/// ten steps; none if it is zero.
Error invert(Simulator& sim, int steps, double force) {
  Error out;
  test::Random random(3);
  Input& input = sim.input();
  input.applied_force.setZero(sim.model().nv());
  for (int i = 0; i < steps; ++i) {
    if (i % 10 == 0 && force > 0.0)
      input.applied_force.tail(sim.model().nv() - 6) =
          test::random_vector(sim.model().nv() - 6, random.bits(), force);
    const State before = sim.state();
    const StepReport report = sim.step();
    EXPECT_TRUE(report.succeeded()) << i;
    input.softening = report.softening;
    const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().q, sim.state().v);
    out.force = std::max(out.force,
                         (inverse.applied_force - input.applied_force).lpNorm<Eigen::Infinity>());
    out.largest = std::max(out.largest, inverse.force_scale);
    input.softening = {};
  }
  return out;
}

Simulator midpoint(Scene scene, double h) {
  scene.options.integrator = Integrator::kImplicitMidpoint;
  scene.options.time_step = h;
  return Simulator(std::move(scene));
}

// Poses of the topmost box are rounded to 30 m * 1.1e-16: 2e-12 m/s over a step, or 2e-6 N s at a
// contact of compliance 1e-6, or 1e-3 N. Velocities, at rest -g h / 2, are 1e4 times more accurate
// and give forces without the contact law.
TEST(MidpointInverse, OfATowerDoesNotSeeItsHeight) {
  ModelBuilder builder;
  builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), {});
  const Shape box{ShapeType::kBox, Vector3(0.5, 0.5, 0.5), nullptr};
  for (int i = 0; i < 30; ++i) {
    const std::string name = "box" + std::to_string(i);
    builder.add_robot(object_of(name, box, 1.0), Base::kFloating,
                      {Matrix3::Identity(), Vector3(0, 0, i + 0.5)}, name + "/");
  }
  Simulator sim = midpoint(scene_of(builder.build()), 0.002);
  EXPECT_LT(invert(sim, 200, 0.0).relative(), 1e-12);
}

// Accelerations of links of 1 kg from velocities of about 10 m/s at 5 ms, next to forces of 1e4 N,
// are accurate to 1e-16. The remaining error: poses, velocities and laws are taken at velocities
// that the solver found to its own round-off floor. The requirement is 1e-8.
TEST(MidpointInverse, OfAHumanoidUnderRandomTorques) {
  Simulator sim =
      midpoint(load_scene(test::source_dir() + "/data/scenes/humanoid_drop.yaml"), 0.005);
  EXPECT_LT(invert(sim, 600, 20.0).relative(), 1e-8);
}

// Poses that no step with these velocities reaches: their part in the contacts is kept, and the
// velocities give the rest, as with measured data.
TEST(MidpointInverse, PosesThatVelocitiesDoNotExplainCount) {
  Simulator sim = midpoint(load_scene(test::source_dir() + "/data/scenes/cube_drop.yaml"), 0.002);
  while (sim.state().time < 1.0) ASSERT_TRUE(sim.step().succeeded());
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  const double weight =
      sim.inverse(before.q, before.v, sim.state().q, sim.state().v).contact_force[2];
  VectorX lower = sim.state().q;
  lower[2] -= 1e-9;
  const double pressed = sim.inverse(before.q, before.v, lower, sim.state().v).contact_force[2];
  EXPECT_GT(pressed, 1.5 * weight);
}

}  // namespace
}  // namespace counterpoint::midpoint_inverse_test
