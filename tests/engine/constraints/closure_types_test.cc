// Hinges, sliders, prismatic, cylindrical and screw closures against joints and closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "counterpoint/engine/constraints/contact_law.h"
#include "support/linkages.h"
#include "support/recover.h"

namespace counterpoint::closure_types_test {
namespace {

using test::energy;
using test::kinematics_of;
using test::kRecovered;
using test::open_by;
using test::recover;
using test::simulate;

constexpr double kGravity = 9.81;  // [m/s^2]

/// A free bar of mass m [kg] along x, its centre in the link origin, its principal moments given
/// [kg m^2].
RobotSpec bar(double m, const Vector3& moments) {
  RobotSpec robot = test::base_only("bar", "body");
  robot.links[0].inertia = {m, Vector3::Zero(), moments.asDiagonal()};
  return robot;
}

/// A model of one free bar and a closure with the world.
Model tied_bar(double m, const Vector3& moments, ClosureSpec closure,
               const Vector3& gravity = Vector3(0, 0, -kGravity), const Pose& start = Pose()) {
  ModelBuilder builder(gravity);
  builder.add_robot(bar(m, moments), Base::kFloating, start);
  closure.link_a = "world";
  closure.link_b = "body";
  builder.add_closure(closure);
  return builder.build();
}

ClosureSpec closure_of(ClosureType type, const Vector3& anchor, const Vector3& axis) {
  ClosureSpec spec;
  spec.type = type;
  spec.anchor_a = anchor;
  spec.axis = axis;
  if (type == ClosureType::kScrew) spec.pitch = 0.05;
  return spec;
}

/// The bar on a revolute joint about y at its end, `length` [m] from its centre.
Model revolute_bar(double m, const Vector3& moments, double length) {
  RobotSpec robot = test::base_only("bar", "base");
  LinkSpec link;
  link.name = "body";
  link.inertia = {m, Vector3(length, 0, 0), moments.asDiagonal()};
  robot.links.push_back(link);
  JointSpec joint;
  joint.name = "pivot";
  joint.parent = "base";
  joint.child = "body";
  joint.axis = Vector3::UnitY();
  robot.joints.push_back(joint);
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  builder.add_robot(robot, Base::kFixed, Pose());
  return builder.build();
}

TEST(Hinge, BarSwingsLikeOnARevoluteJoint) {
  const double m = 2.0, length = 0.4;
  const Vector3 moments(0.01, 0.12, 0.11);
  ClosureSpec hinge = closure_of(ClosureType::kHinge, Vector3(-length, 0, 0), Vector3::UnitY());
  const auto angle_after = [&](Simulator sim, bool joint, double& open) {
    const double start = energy(sim).total();
    const int steps = static_cast<int>(std::lround(1.0 / sim.options().time_step));
    for (int i = 0; i < steps; ++i) {
      EXPECT_TRUE(sim.step().succeeded());
      open = std::max(open, open_by(sim));
    }
    // Both are of first order: h times the angular acceleration, of the energy per radian.
    EXPECT_LT(std::abs(energy(sim).total() - start), 30.0 * sim.options().time_step);
    const VectorX& q = sim.state().q;
    return joint ? q[0] : std::atan2(-q[2], q[0] + length);
  };
  double ignored = 0.0, last = 0.0;
  const double exact = angle_after(simulate(revolute_bar(m, moments, length), 1e-5), true, ignored);
  for (const double h : {0.004, 0.002, 0.001}) {
    double open = 0.0;
    const double error = angle_after(simulate(tied_bar(m, moments, hinge), h), false, open) - exact;
    const double own =
        angle_after(simulate(revolute_bar(m, moments, length), h), true, ignored) - exact;
    // First order, equal to joint coordinates to second order in h.
    EXPECT_NEAR(error / own, 1.0, 2e4 * h * h) << h;
    if (last != 0.0) {
      EXPECT_NEAR(last / error, 2.0, 0.25) << h;
    }
    EXPECT_LT(open, 1e4 * h * h * h) << h;  // third order
    last = error;
  }
}

TEST(Hinge, KeepsItsAxisUnderALoadAcrossIt) {
  // The torque of the weight about x is held by the rows of angles: m g y.
  const double m = 2.0, arm = 0.3;
  ClosureSpec hinge = closure_of(ClosureType::kHinge, Vector3(0, -arm, 0), Vector3::UnitY());
  Simulator sim = simulate(tied_bar(m, Vector3::Constant(0.02), hinge));
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(sim.step().succeeded());
  const State before = sim.state();
  ASSERT_TRUE(sim.step().succeeded());
  const Force& force = sim.inverse(before.q, before.v, sim.state().v).closures[0].force;
  EXPECT_LT((force.force - Vector3(0, 0, m * kGravity)).norm(), 1e-6);  // the solver's 1e-10
  EXPECT_LT((force.torque - Vector3(m * kGravity * arm, 0, 0)).norm(), 1e-6);
  EXPECT_LT(open_by(sim), 1e-6);
}

TEST(Slider, BeadOnALineFallsWithTheSineOfItsSlope) {
  const double slope = 0.4, h = 0.002;
  const Vector3 axis(std::cos(slope), 0, -std::sin(slope));
  for (const ClosureType type :
       {ClosureType::kSlider, ClosureType::kPrismatic, ClosureType::kCylindrical}) {
    SCOPED_TRACE(closure_type_name(type));
    Simulator sim = simulate(
        tied_bar(1.5, Vector3::Constant(0.01), closure_of(type, Vector3::Zero(), axis)), h);
    for (int n = 1; n <= 1000; ++n) {
      ASSERT_TRUE(sim.step().succeeded());
      // Constant forces are exact in velocity; rounding of 20 m/s over 1000 steps.
      ASSERT_NEAR(axis.dot(sim.state().v.head<3>()), n * h * kGravity * std::sin(slope), 1e-9);
    }
    EXPECT_LT(open_by(sim), 1e-6);  // 1e4 times the sag of a weight, 100 eps h^2 g / beta
  }
}

TEST(Slider, OfAMovingBodyActsWhereTheBeadIs) {
  // A bead on a beam that turns freely about the vertical: the angular momentum about the pivot is
  // kept as the bead flies out, I w0 = (I + m r^2) w, though the bead is far from the beam's
  // anchor.
  const double m = 0.5, inertia = 0.2, r0 = 0.3, w0 = 3.0;
  RobotSpec robot = test::base_only("beam", "base");
  LinkSpec link;
  link.name = "beam";
  link.inertia = {1.0, Vector3::Zero(), inertia * Matrix3::Identity()};
  robot.links.push_back(link);
  JointSpec joint;
  joint.name = "pivot";
  joint.parent = "base";
  joint.child = "beam";
  joint.axis = Vector3::UnitZ();
  robot.joints.push_back(joint);
  ModelBuilder builder(Vector3::Zero());
  builder.add_robot(robot, Base::kFixed, Pose(), "");
  Pose start;
  start.translation.x() = r0;
  builder.add_robot(bar(m, Vector3::Constant(1e-6)), Base::kFloating, start, "bead/");
  ClosureSpec slider = closure_of(ClosureType::kSlider, Vector3::Zero(), Vector3::UnitX());
  slider.anchor_b = Vector3::Zero();
  slider.link_a = "beam";
  slider.link_b = "bead/body";
  builder.add_closure(slider);
  Simulator sim = simulate(builder.build(), 0.001);
  State state = sim.state();
  state.v[0] = w0;
  state.v[2] = w0 * r0;
  sim.set_state(state);
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(sim.step().succeeded());
  const Vector3 p = sim.state().q.segment<3>(1), v = sim.state().v.segment<3>(1);
  const double momentum = inertia * sim.state().v[0] + m * p.cross(v).z();
  EXPECT_GT(p.norm(), 2.0 * r0);
  // First order: h w of the momentum of the bead, 0.14 kg m^2/s at the start.
  EXPECT_NEAR(momentum, (inertia + m * r0 * r0) * w0, 3e-3 * m * r0 * r0 * w0 / 0.1);
  // Energy of a free motion on a smooth line: r' ^2 = w0^2 I0 (1 / I - ...): both are kept.
  const double kinetic =
      0.5 * (inertia * sim.state().v[0] * sim.state().v[0] + m * v.squaredNorm());
  EXPECT_NEAR(kinetic, 0.5 * (inertia + m * r0 * r0) * w0 * w0, 0.01);
}

TEST(Screw, FallsByThePitchOfItsThread) {
  for (const double pitch : {0.05, -0.2, 1.0}) {
    const double m = 2.0, inertia = 0.003, h = 0.002;
    ClosureSpec screw = closure_of(ClosureType::kScrew, Vector3::Zero(), Vector3::UnitZ());
    screw.pitch = pitch;
    Simulator sim = simulate(tied_bar(m, Vector3(0.004, 0.005, inertia), screw), h);
    const double turns_per_metre = 2.0 * M_PI / pitch;
    const double a = kGravity / (1.0 + turns_per_metre * turns_per_metre * inertia / m);
    double angle = 0.0;
    for (int n = 1; n <= 1500; ++n) {
      ASSERT_TRUE(sim.step().succeeded());
      const VectorX& v = sim.state().v;
      angle += h * v[5];
      // The row yields to its force in the first steps, by 100 eps h g, a part beta less each step.
      const double yields = kClosureSoftness * sim.options().contact.compliance * h * kGravity *
                            std::pow(1.0 - sim.options().contact.stabilization, n - 1);
      ASSERT_NEAR(v[2], -a * n * h, 1e-6 * a * n * h + yields) << pitch << ' ' << n;
      ASSERT_NEAR(v[5], turns_per_metre * v[2],
                  1e-6 * std::abs(v[5]) + 2.0 * yields * std::abs(turns_per_metre));
    }
    // The way over many turns is that of the angle: nothing is lost where the angle passes pi.
    EXPECT_GT(std::abs(angle), 4.0 * M_PI);
    EXPECT_NEAR(sim.state().q[2], angle / turns_per_metre, 1e-6);
    EXPECT_LT(open_by(sim), 1e-6);
  }
}

constexpr ClosureType kTypes[] = {ClosureType::kHinge, ClosureType::kSlider,
                                  ClosureType::kPrismatic, ClosureType::kCylindrical,
                                  ClosureType::kScrew};

/// A row of free bodies, each tied to the next one by one of the closures.
Model chain(const std::vector<ClosureSpec>& closures, const SpatialInertia& inertia,
            const Vector3& gravity) {
  ModelBuilder builder(gravity);
  for (size_t i = 0; i <= closures.size(); ++i) {
    RobotSpec robot = test::base_only("link", "body");
    robot.links[0].inertia = inertia;
    Pose start;
    start.translation.x() = 0.3 * static_cast<double>(i);
    builder.add_robot(robot, Base::kFloating, start, std::to_string(i) + "/");
  }
  for (size_t i = 0; i < closures.size(); ++i) {
    ClosureSpec closure = closures[i];
    closure.link_a = std::to_string(i) + "/body";
    closure.link_b = std::to_string(i + 1) + "/body";
    builder.add_closure(closure);
  }
  return builder.build();
}

std::vector<ClosureSpec> one_of_each() {
  std::vector<ClosureSpec> closures;
  for (const ClosureType type : kTypes)
    closures.push_back(closure_of(type, Vector3(0.1, 0.05, 0), Vector3(0.3, -1.0, 0.5)));
  return closures;
}

TEST(ClosureTypes, BetweenFreeBodiesKeepMomentum) {
  // Spheres, whose spin is integrated exactly; the closures start up to 5 cm open.
  std::vector<ClosureSpec> closures = one_of_each();
  for (ClosureSpec& closure : closures) closure.anchor_b = Vector3(-0.17, 0.03, 0.02);
  Simulator sim = simulate(
      chain(closures, {1.5, Vector3::Zero(), 0.01 * Matrix3::Identity()}, Vector3::Zero()));
  test::set_random_velocities(sim, 1.0);
  test::expect_momentum_kept(sim, [] {});
  EXPECT_LT(open_by(sim), 1e-3);
}

TEST(ClosureInverse, RecoversForcesOfAllTypes) {
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint}) {
    test::Random random(5);
    Simulator sim = simulate(
        chain(one_of_each(), solid_inertia({ShapeType::kBox, {0.1, 0.05, 0.15}, nullptr}, 1.0),
              Vector3(0, 0, -kGravity)));
    sim.options().integrator = integrator;
    double error = 0.0, scale = 0.0;
    sim.settings().tolerance = 1e-12;  // the solver's error must not hide the inverse's
    for (int i = 0; i < 300; ++i) {
      if (i % 10 == 0)
        sim.input().applied_force = test::random_vector(sim.model().nv(), random.bits(), 1.0);
      const State before = sim.state();
      ASSERT_TRUE(sim.step().succeeded());
      Inverse inverse;
      Workspace ws(sim.model());
      step_inverse(sim.model(), sim.options(), before.q, before.v, sim.state().q, sim.state().v,
                   sim.input(), ws, inverse);
      error = std::max(error,
                       (inverse.applied_force - sim.input().applied_force).cwiseAbs().maxCoeff());
      scale = std::max(scale, inverse.force_scale);
    }
    EXPECT_LT(error / scale, kRecovered) << integrator_name(integrator);
  }
}

TEST(ClosureTypes, AreMetExactlyByRungeKutta) {
  double last = 0.0;
  for (const double h : {0.004, 0.002, 0.001}) {
    Simulator sim = simulate(
        chain(one_of_each(), {1.5, Vector3::Zero(), 0.01 * Matrix3::Identity()}, Vector3::Zero()),
        h);
    sim.options().integrator = Integrator::kRungeKutta4;
    State start = sim.state();
    start.v = test::random_vector(sim.model().nv(), 11, 1.0);
    sim.set_state(start);
    ASSERT_TRUE(sim.step().succeeded());  // removes the part of v that the closures do not allow
    const double before = energy(sim).total();
    const int steps = static_cast<int>(std::lround(0.5 / h));
    for (int i = 0; i < steps; ++i) ASSERT_TRUE(sim.step().succeeded());
    EXPECT_LT(open_by(sim), 1e-12);  // end of Newton's method, 1e-14, and rounding of poses
    // Free bodies are projected each step, so the energy has an error of second order; 1.9 J.
    const double drift = std::abs(energy(sim).total() - before);
    EXPECT_LT(drift, 10.0 * h * h) << h;
    if (last > 0.0) {
      EXPECT_GT(last / drift, 3.0) << h;
    }
    last = drift;
  }
}

}  // namespace
}  // namespace counterpoint::closure_types_test
