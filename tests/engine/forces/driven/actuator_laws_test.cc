// Laws of actuators on a joint against closed forms of the discrete scheme.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "counterpoint/engine/simulator.h"
#include "engine/forces/driven/wheel.h"

namespace counterpoint::actuator_laws_test {
namespace {

using test::kWheelInertia;
using test::named;
using test::wheel;

constexpr double kRoundoff = 1e-12;

/// Steps with a command, and calls look(inverse of the step, speed after it) after each.
void run(Simulator& sim, int steps, double command,
         const std::function<void(const Inverse&, double)>& look) {
  sim.settings().tolerance = 1e-14;
  sim.input().command = VectorX::Constant(1, command);
  for (int i = 0; i < steps; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    const Inverse inverse = sim.last_forces();
    ASSERT_LT(inverse.applied_force.cwiseAbs().maxCoeff(), 1e-9);
    ASSERT_LT((inverse.z_next - sim.state().z).norm(), 1e-12);
    look(inverse, sim.state().v[0]);
  }
}

/// A force of gain u + bias at gear g accelerates by g (gain u + bias) / I; the force reported is
/// the actuator's own.
TEST(Actuators, ForceActsThroughItsGear) {
  Actuator a = named("motor");
  a.gain = 3.0;
  a.bias = 0.5;
  a.gear = -4.0;
  a.most_command = 2.0;
  Simulator sim(wheel(a));
  double speed = 0.0;
  run(sim, 50, 5.0, [&](const Inverse& inverse, double v) {
    speed += 0.002 * -4.0 * (3.0 * 2.0 + 0.5) / kWheelInertia;  // the command ends at its bound
    EXPECT_NEAR(v, speed, kRoundoff * std::abs(speed));
    EXPECT_NEAR(inverse.actuator_force[0], 6.5, 1e-10);
  });
}

/// Voltage u: backward Euler of I dw/dt = N K i, L di/dt + R i = u - K N w, as a linear system of
/// two unknowns.
TEST(Actuators, DcMotorFollowsItsTwoEquations) {
  for (const double inductance : {0.0, 0.02}) {
    Actuator a = named("motor");
    a.law = ActuatorLaw::kDcMotor;
    a.torque_constant = 0.3;
    a.resistance = 1.5;
    a.inductance = inductance;
    a.gear = 5.0;
    Simulator sim(wheel(a));
    const double h = 0.002, K = a.gear * a.torque_constant;
    double w = 0.0, i = 0.0;
    run(sim, 3000, 12.0, [&](const Inverse& inverse, double v) {
      Eigen::Matrix2d A;
      A << kWheelInertia / h, -K, K, a.resistance + inductance / h;
      const Eigen::Vector2d next =
          A.lu().solve(Eigen::Vector2d(kWheelInertia / h * w, 12.0 + inductance / h * i));
      w = next[0];
      i = next[1];
      EXPECT_NEAR(v, w, 1e-11 * (1.0 + std::abs(w)));
      EXPECT_NEAR(inverse.actuator_force[0], a.torque_constant * i, 1e-9);
    });
    EXPECT_NEAR(w, 12.0 / K, 1e-6);  // the speed without load
  }
}

/// At rest a motor gives its limit of current, and less where the back-EMF leaves less: the speed-
/// torque curve.
TEST(Actuators, CurrentLimitIsAPlateauOfTorque) {
  Actuator a = named("motor");
  a.law = ActuatorLaw::kDcMotor;
  a.torque_constant = 0.5;
  a.resistance = 2.0;
  a.current_limit = 3.0;
  Simulator sim(wheel(a));
  run(sim, 10000, 24.0, [&](const Inverse& inverse, double v) {
    const double torque = std::min(1.5, 0.5 * (24.0 - 0.5 * v) / 2.0);
    EXPECT_NEAR(inverse.actuator_force[0], torque, 1e-9);
  });
  EXPECT_GT(sim.state().v[0], 40.0);  // beyond the plateau, which ends at 36 rad/s
}

/// A PID position law under a constant load: the integral takes the load over, and the error goes.
TEST(Actuators, IntegralTakesTheLoadOver) {
  Actuator a = named("motor");
  a.law = ActuatorLaw::kPid;
  a.kp = 20.0;
  a.ki = 30.0;
  a.kd = 5.0;
  Simulator sim(wheel(a));
  sim.input().applied_force = VectorX::Constant(1, -2.0);
  sim.input().command = VectorX::Constant(1, 0.7);
  for (int i = 0; i < 10000; ++i) ASSERT_TRUE(sim.step().succeeded());
  EXPECT_NEAR(sim.state().q[0], 0.7, 1e-9);
  EXPECT_NEAR(30.0 * sim.state().z[1], 2.0, 1e-7);  // z: setpoint, integral
}

/// A stop keeps the wheel from its target: the integral ends at its limit, or waits at the bound of
/// the force, and the wheel leaves the stop at once when the command turns.
TEST(Actuators, IntegralDoesNotWindUp) {
  Actuator a = named("motor");
  a.law = ActuatorLaw::kPid;
  a.kp = 10.0;
  a.ki = 10.0;
  a.integral_limit = 1.5;
  Simulator limited(wheel(a, 0.1));
  a.integral_limit = kInfinity;
  a.least = -4.0;
  a.most = 4.0;
  Simulator bounded(wheel(a, 0.1));
  for (Simulator* sim : {&limited, &bounded}) {
    sim->input().command = VectorX::Constant(1, 1.0);
    for (int i = 0; i < 5000; ++i) ASSERT_TRUE(sim->step().succeeded());
  }
  EXPECT_DOUBLE_EQ(10.0 * limited.state().z[0], 1.5);
  EXPECT_LT(10.0 * bounded.state().z[0], 4.0);  // the force is at its bound by kp alone
  for (Simulator* sim : {&limited, &bounded}) {
    sim->input().command = VectorX::Constant(1, -1.0);
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(sim->step().succeeded());
    EXPECT_LT(sim->state().v[0], -0.1);
  }
}

/// First order lag: 1 - exp(-t / T) at every step.
TEST(Actuators, LagIsExact) {
  Actuator a = named("motor");
  a.lag = 0.05;
  Simulator sim(wheel(a));
  int i = 0;
  run(sim, 200, 1.0, [&](const Inverse& inverse, double) {
    EXPECT_NEAR(inverse.actuator_force[0], 1.0 - std::exp(-0.002 * i++ / 0.05), kRoundoff);
  });
}

/// Behind a lag the command of a PID law has the rate (a(t + h) - a(t)) / h of the lag's output a,
/// in which backward Euler takes I dw/dt = kd (da/dt - w).
TEST(Actuators, PidBehindALagTakesTheRateOfTheLag) {
  Actuator a = named("motor");
  a.law = ActuatorLaw::kPid;
  a.kd = 2.0;
  a.lag = 0.05;
  Simulator sim(wheel(a));
  const double h = 0.002, c = h * a.kd / kWheelInertia;
  double w = 0.0;
  int i = 0;
  run(sim, 200, 1.0, [&](const Inverse& inverse, double v) {
    const double rate = (std::exp(-h * i / a.lag) - std::exp(-h * (i + 1) / a.lag)) / h;
    ++i;
    w = (w + c * rate) / (1.0 + c);
    EXPECT_NEAR(v, w, 1e-11 * (1.0 + std::abs(w)));
    EXPECT_NEAR(inverse.actuator_force[0], a.kd * (rate - w), 1e-9 * a.kd * (1.0 + rate));
  });
}

/// The command passes a slew limit as a ramp.
TEST(Actuators, SlewLimitsTheRate) {
  Actuator a = named("motor");
  a.slew = 10.0;
  Simulator sim(wheel(a));
  int i = 0;
  run(sim, 100, 1.0, [&](const Inverse& inverse, double) {
    EXPECT_NEAR(inverse.actuator_force[0], std::min(1.0, 10.0 * 0.002 * ++i), kRoundoff);
  });
}

/// A delay of 30 ms in 3 samples holds every command for 30 to 40 ms, whatever the step.
TEST(Actuators, DelayHoldsCommandsForItsTime) {
  for (const double h : {0.001, 0.0037, 0.01, 0.05}) {
    Actuator a = named("motor");
    a.delay = 0.03;
    a.delay_samples = 3;
    Scene scene = wheel(a);
    scene.options.time_step = h;
    Simulator sim(scene);
    double arrival = -1.0;
    const int steps = static_cast<int>(std::ceil(0.2 / h));
    int i = 0;
    run(sim, steps, 1.0, [&](const Inverse& inverse, double) {
      const double f = inverse.actuator_force[0];
      EXPECT_TRUE(std::abs(f) < kRoundoff || std::abs(f - 1.0) < kRoundoff) << f;
      if (arrival < 0.0 && f > 0.5) arrival = h * i;
      ++i;
    });
    EXPECT_GE(arrival, 0.03 - 1e-9) << h;
    EXPECT_LT(arrival, std::max(0.04, h) + h) << h;
  }
}

TEST(Actuators, BadValuesAreRefused) {
  const auto refuses = [](Actuator a, const std::string& words) {
    try {
      wheel(a);
      ADD_FAILURE() << words;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  Actuator a = named("");
  refuses(a, "a name is expected");
  a = named("motor");
  a.lag = -1.0;
  refuses(a, "lag must not be negative");
  a = named("motor");
  a.delay = 0.1;
  refuses(a, "delay and delay_samples");
  a = named("motor");
  a.least = -1.0;
  refuses(a, "two finite bounds");
  a = named("motor");
  a.law = ActuatorLaw::kDcMotor;
  refuses(a, "torque_constant must be positive");
  a = named("motor");
  a.law = ActuatorLaw::kMuscle;
  refuses(a, "max_force must be positive");
  a = named("motor");
  a.stiffness = kInfinity;
  refuses(a, "stiffness must not be negative");
  a = named("motor");
  a.transmission = Transmission::kTendon;
  refuses(a, "there is no tendon ''");
  a.transmission = Transmission::kLink;
  a.law = ActuatorLaw::kPid;
  refuses(a, "on a link only a force is possible");
}

/// A command that is not finite fails the step with its name.
TEST(Actuators, CommandsThatAreNotFiniteFailTheStep) {
  Simulator sim(wheel(named("motor")));
  sim.input().command = VectorX::Constant(1, std::nan(""));
  const StepReport report = sim.step();
  EXPECT_FALSE(report.succeeded());
  EXPECT_EQ(report.fault.kind, FaultKind::kCommand);
  EXPECT_EQ(describe(sim.model(), report.fault).element, "motor");
  sim.input().command = VectorX::Zero(2);
  EXPECT_THROW(sim.step(), InputError);
}

/// A servo whose target is the integral of the command follows n h u, within its bounds; the wheel
/// obeys the two equations of the step.
TEST(Actuators, AnIntegratedCommandMovesTheTargetOfAServo) {
  Actuator a = named("servo");
  a.gain = a.stiffness = 30.0;
  a.damping = 2.0;
  a.integrates = true;
  a.least_setpoint = -1.0;
  a.most_setpoint = 0.02;
  Simulator sim(wheel(a));
  const double h = 0.002;
  double q = 0.0, w = 0.0;
  int step = 0;
  run(sim, 30, 0.7, [&](const Inverse&, double v) {
    const double target = std::min(step++ * h * 0.7, 0.02);
    w = (w + h * 30.0 * (target - q) / kWheelInertia) /
        (1.0 + h * (2.0 + h * 30.0) / kWheelInertia);
    q += h * w;
    EXPECT_NEAR(v, w, kRoundoff);
  });
  EXPECT_EQ(sim.state().z[0], 0.02);
}

/// A damper of c u slows the wheel by 1 / (1 + h c u / I) a step.
TEST(Actuators, ACommandScalesADamper) {
  Actuator a = named("brake");
  a.gain = a.least_command = 0.0;
  a.command_damping = 4.0;
  Simulator sim(wheel(a));
  State start = sim.state();
  double w = start.v[0] = 9.0;
  sim.set_state(start);
  run(sim, 30, 0.6, [&](const Inverse& inverse, double v) {
    w /= 1.0 + 0.002 * 4.0 * 0.6 / kWheelInertia;
    EXPECT_NEAR(v, w, 10.0 * kRoundoff);
    EXPECT_NEAR(inverse.actuator_force[0], -4.0 * 0.6 * w, 1e-9);
  });
}

}  // namespace
}  // namespace counterpoint::actuator_laws_test
