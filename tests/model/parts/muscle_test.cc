// Forces of muscles and the dynamics of their activation.
#include "counterpoint/model/parts/muscle.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "support/random_model.h"

namespace counterpoint::muscle_test {
namespace {

/// Round-off of forces over max_force: a few units of products of numbers below 10.
constexpr double kRoundoff = 1e-13;

/// The muscle of the known answers: range 0.75 ... 1.05 over lengths 0.1 ... 0.4 m.
Muscle mujoco_muscle() {
  Muscle m;
  m.curves = Muscle::Curves::kMujoco;
  m.max_force = 800.0;
  m.optimal_length = 0.3 / (1.05 - 0.75);
  m.slack_length = 0.1 - 0.75 * m.optimal_length;
  m.max_speed = 1.5;
  return m;
}

Muscle millard_muscle() {
  Muscle m;
  m.max_force = 1000.0;
  m.optimal_length = 0.1;
  m.slack_length = 0.2;
  m.pennation = 0.3;
  return m;
}

/// A muscle without pennation, all of whose units are 1.
Muscle bare_muscle(double damping) {
  Muscle m;
  m.max_force = m.optimal_length = m.max_speed = 1.0;
  m.damping = damping;
  return m;
}

// The three curves, each seen beside a force that is large enough not to fade: the damping at twice
// max_speed, where the active force has its factor 1.4, or the passive force of a long fibre.
double active_curve(double x) {
  return muscle_force(bare_muscle(1.0), 1.0, x, 2.0).by_activation / 1.4;
}
double passive_curve(double x) { return muscle_force(bare_muscle(1.0), 0.0, x, 2.0).force - 2.0; }
double speed_curve(double v) {
  return muscle_force(bare_muscle(0.0), 1.0, 1.6, v).by_activation / active_curve(1.6);
}

// mju_muscleGain and mju_muscleBias of MuJoCo 2.2.2, times -1.
TEST(Muscle, ForcesAreThoseOfMujoco) {
  struct Row {
    double length, speed, gain, bias;
  };
  const std::vector<Row> rows = {{0.05, -0.9, 40.959999999999987, 0},
                                 {0.05, 0.1, 284.44444444444434, 0},
                                 {0.2, -0.3, 419.84000000000009, 0},
                                 {0.2, 0.8, 787.19999999999993, 0},
                                 {0.35, -0.9, 128.00000000000003, 0},
                                 {0.35, 0, 800, 0},
                                 {0.35, 0.8, 960, 0},
                                 {0.45, -0.3, 483.55555555555554, 57.777777777777864},
                                 {0.45, 0.1, 839.50617283950612, 57.777777777777864},
                                 {0.7, -0.9, 44.444444444444443, 693.33333333333337},
                                 {0.7, 0, 277.77777777777771, 693.33333333333337},
                                 {0.7, 0.1, 308.64197530864192, 693.33333333333337}};
  const Muscle m = mujoco_muscle();
  for (const Row& row : rows) {
    for (const double a : {0.0, 0.3, 1.0})
      EXPECT_NEAR(muscle_force(m, a, row.length, row.speed).force, a * row.gain + row.bias,
                  1e-12 * m.max_force)
          << row.length << " m, " << row.speed << " m/s";
  }
  // Beyond the range of active lengths only the passive force remains.
  EXPECT_EQ(muscle_force(m, 1.0, m.slack_length + 0.4, 0.0).force, 0.0);
  EXPECT_EQ(muscle_force(m, 1.0, m.slack_length + 1.7, 0.0).by_activation, 0.0);
}

// mju_muscleDynamics of MuJoCo 2.2.2: rates [1/s].
TEST(Muscle, RatesOfActivationAreThoseOfMujoco) {
  struct Row {
    double activation, excitation, rate;
  };
  const double h =
      1e-8;  // the quotient is exact to h times the square of a rate, and round-off / h
  for (const Row& row :
       {Row{0.1, 0, -1.6250000000000002}, Row{0.1, 0.4, 46.153846153846153},
        Row{0.1, 1, 138.46153846153845}, Row{0.5, 0, -15.625}, Row{0.5, 0.4, -3.125},
        Row{0.5, 1, 40}, Row{0.9, 0.4, -23.125000000000004}, Row{0.9, 1, 5.4054054054054035}}) {
    const double next = next_activation(Muscle{}, row.activation, row.excitation, h);
    EXPECT_NEAR((next - row.activation) / h, row.rate, 1e-3);
  }
}

TEST(Muscle, CurvesPassThroughTheirPublishedPoints) {
  EXPECT_NEAR(active_curve(1.0), 1.0, kRoundoff);
  EXPECT_NEAR(active_curve(0.4441), 0.0, kRoundoff);
  EXPECT_NEAR(active_curve(1.8123), 0.0, kRoundoff);
  EXPECT_EQ(active_curve(0.3), 0.0);
  EXPECT_EQ(active_curve(2.5), 0.0);
  EXPECT_NEAR(passive_curve(0.9), 0.0, kRoundoff);
  EXPECT_NEAR(passive_curve(1.7), 1.0, kRoundoff);
  EXPECT_NEAR(passive_curve(2.0), 1.0 + 0.3 * 2.0 / 0.7, kRoundoff) << "along the tangent";
  EXPECT_NEAR(speed_curve(-1.0), 0.0, kRoundoff);
  EXPECT_EQ(speed_curve(-7.0), 0.0);
  EXPECT_NEAR(speed_curve(0.0), 1.0, kRoundoff);
  EXPECT_NEAR(speed_curve(1.0), 1.4, kRoundoff);
  EXPECT_NEAR(speed_curve(9.0), 1.4, kRoundoff);
  const Muscle m = bare_muscle(0.0);
  EXPECT_NEAR(muscle_force(m, 1.0, 1.0, 0.0).by_speed, 5.0, 1e-12);
  EXPECT_NEAR(muscle_force(m, 1.0, 1.0, 0.0).by_length, 0.0, 1e-12);
  EXPECT_NEAR(muscle_force(m, 0.0, 1.7, 0.0).by_length, 2.0 / 0.7, 1e-12);
}

struct Knot {
  double x, y, slope;
};

/// Point of the quintic Bezier curve of a corner, by de Casteljau's algorithm on its six points.
std::array<double, 2> corner_point(const Knot& a, const Knot& b, double part, double u) {
  const double x = (b.y - b.slope * b.x - a.y + a.slope * a.x) / (a.slope - b.slope);
  const double y = a.y + a.slope * (x - a.x);
  const auto between = [&](double from, double to) { return from + part * (to - from); };
  std::array<double, 6> px = {
      a.x, between(a.x, x), between(a.x, x), between(b.x, x), between(b.x, x), b.x};
  std::array<double, 6> py = {
      a.y, between(a.y, y), between(a.y, y), between(b.y, y), between(b.y, y), b.y};
  for (int level = 5; level > 0; --level) {
    for (int i = 0; i < level; ++i) {
      px[i] += u * (px[i + 1] - px[i]);
      py[i] += u * (py[i + 1] - py[i]);
    }
  }
  return {px[0], py[0]};
}

struct Corner {
  Knot from, to;
  double part;
  double (*curve)(double);
};

/// All corners, with the numbers of OpenSim's default curves written out.
std::vector<Corner> corners() {
  const double shoulder = 1.0 - 0.8616 * 0.22;
  const Knot steep{0.58705, shoulder / 2, 1.25 * shoulder / 0.2859};
  const Knot shallow{0.84, (1 + shoulder) / 2, 0.8616}, top{1, 1, 0};
  const Knot falling{1.43115, 0.5, -1 / 0.7123};
  const Knot foot{1.035, 0.0035, 0.2}, slow{-0.9, 0.0125, 0.25}, rest{0, 1, 5};
  const Knot fast{0.9, 1.3925, 0.15};
  return {{{0.4441, 0, 0}, steep, 0.9, active_curve},
          {steep, shallow, 0.9, active_curve},
          {shallow, top, 0.9, active_curve},
          {top, falling, 0.9, active_curve},
          {falling, {1.8123, 0, 0}, 0.9, active_curve},
          {{1, 0, 0}, foot, 0.7, passive_curve},
          {foot, {1.7, 1, 2 / 0.7}, 0.7, passive_curve},
          {{-1, 0, 0}, slow, 0.58, speed_curve},
          {slow, rest, 0.58, speed_curve},
          {rest, fast, 0.82, speed_curve},
          {fast, {1, 1.4, 0}, 0.82, speed_curve}};
}

TEST(Muscle, CurvesAreBezierCurvesToRoundoff) {
  for (const Corner& corner : corners()) {
    for (int i = 0; i <= 1000; ++i) {
      const auto [x, y] = corner_point(corner.from, corner.to, corner.part, 0.001 * i);
      EXPECT_NEAR(corner.curve(x), y, kRoundoff) << x;
    }
  }
}

TEST(Muscle, CurvesAreMonotoneBetweenTheirKnots) {
  for (const Corner& corner : corners()) {
    const double sign = corner.to.y > corner.from.y ? 1.0 : -1.0;
    const double step = (corner.to.x - corner.from.x) / 2000;
    for (int i = 0; i < 2000; ++i) {
      const double x = corner.from.x + i * step;
      EXPECT_GE(sign * (corner.curve(x + step) - corner.curve(x)), -kRoundoff) << x;
    }
  }
}

// The curvature of every piece is 0 at its ends, which makes the curves twice differentiable.
TEST(Muscle, CurvesHaveNoCurvatureAtTheirKnots) {
  const double h = 1e-5;  // the curvature grows with less than 2e4 times the distance from a knot
  for (const Corner& corner : corners()) {
    for (const Knot& knot : {corner.from, corner.to}) {
      const double left = (corner.curve(knot.x) - corner.curve(knot.x - h)) / h;
      const double right = (corner.curve(knot.x + h) - corner.curve(knot.x)) / h;
      EXPECT_NEAR(left, knot.slope, 1e-5) << knot.x;
      EXPECT_NEAR(right, knot.slope, 1e-5) << knot.x;
    }
  }
}

void expect_derivatives(const Muscle& m, double a, double x, double v) {
  const double h = 1e-6, length = m.slack_length + x * m.optimal_length;
  const double fastest = m.optimal_length * m.max_speed, speed = v * fastest;
  const auto force = [&](double da, double dx, double dv) {
    return muscle_force(m, a + da, length + dx * m.optimal_length, speed + dv * fastest).force /
           m.max_force;
  };
  // Third derivatives below 1e6 give 1e6 h^2 / 6; the kinks of MuJoCo's slopes below 20 h.
  const double tolerance = 1e-4;
  const MuscleForce f = muscle_force(m, a, length, speed);
  EXPECT_NEAR((force(0, h, 0) - force(0, -h, 0)) / (2 * h),
              f.by_length * m.optimal_length / m.max_force, tolerance);
  EXPECT_NEAR((force(0, 0, h) - force(0, 0, -h)) / (2 * h), f.by_speed * fastest / m.max_force,
              tolerance);
  EXPECT_NEAR((force(h, 0, 0) - force(-h, 0, 0)) / (2 * h), f.by_activation / m.max_force,
              tolerance);
}

TEST(Muscle, DerivativesAgreeWithDifferences) {
  test::Random random(1);
  Muscle pennate = millard_muscle();
  pennate.pennation = 1.1;
  for (int i = 0; i < 2000; ++i) {
    const double a = random.uniform(0.01, 0.99), v = random.uniform(-1.3, 1.3);
    expect_derivatives(mujoco_muscle(), a, random.uniform(0.3, 2.0), v);
    for (const Muscle& m : {millard_muscle(), bare_muscle(0.0), pennate})
      expect_derivatives(m, a, random.uniform(-0.1, 2.0), v);
  }
}

// The step takes the force as linear in the speed, and is stable because it never falls with it.
TEST(Muscle, ForcePullsAndNeverFallsWithTheSpeed) {
  test::Random random(2);
  Muscle pennate = millard_muscle();
  pennate.pennation = 1.3;
  const double infinity = std::numeric_limits<double>::infinity();
  const double huge = std::numeric_limits<double>::max();
  for (const Muscle& m : {mujoco_muscle(), millard_muscle(), bare_muscle(0.0), pennate}) {
    const auto check = [&](double a, double length, double speed) {
      const MuscleForce f = muscle_force(m, a, length, speed);
      EXPECT_GE(f.force, 0.0);
      EXPECT_GE(f.by_speed, 0.0);
      for (const double number : {f.force, f.by_length, f.by_speed, f.by_activation})
        EXPECT_LT(std::abs(number), infinity) << length << " m, " << speed << " m/s";
    };
    for (int i = 0; i < 2000; ++i)
      check(random.uniform(-0.2, 1.2), random.uniform(-1.0, 3.0), random.uniform(-20.0, 20.0));
    for (const double length : {-huge, 0.0, m.slack_length, 0.3, huge})
      for (const double speed : {-huge, -1.0, 0.0, huge}) check(0.5, length, speed);
  }
}

TEST(Muscle, FibreKeepsItsWidth) {
  Muscle m = millard_muscle();
  m.damping = 0.2;
  m.pennation = std::numbers::pi / 6;
  const double cosine = std::cos(m.pennation);
  // At the optimal length of the fibre its force acts under the pennation.
  const double optimal = m.slack_length + m.optimal_length * cosine;
  EXPECT_NEAR(muscle_force(m, 0.7, optimal, 0.0).force, 0.7 * m.max_force * cosine, 1e-9);
  // Half an optimal length wide and one long: the fibre is sqrt(1.25) long.
  const double fibre = std::sqrt(1.25), speed = 0.3, shortening = -speed / fibre;
  const double expected = (0.6 * active_curve(fibre) * speed_curve(shortening) +
                           passive_curve(fibre) + m.damping * shortening) /
                          fibre;
  const MuscleForce f = muscle_force(m, 0.6, m.slack_length + m.optimal_length, -speed);
  EXPECT_NEAR(f.force, m.max_force * expected, 1e-9);
}

TEST(Muscle, ATendonThatIsLongerThanTheMuscleIsSlack) {
  for (const double pennation : {0.0, 1.2}) {
    Muscle m = millard_muscle();
    m.pennation = pennation;
    for (const double length : {-1.0, 0.0, 0.1999, 0.2}) {
      const MuscleForce f = muscle_force(m, 1.0, length, 2.0);
      EXPECT_EQ(f.force, 0.0);
      EXPECT_EQ(f.by_speed, 0.0);
    }
    EXPECT_NEAR(muscle_force(m, 1.0, 0.2 + 1e-6, 2.0).force, 0.0, 1e-6) << "no jump";
  }
}

TEST(Muscle, DampingDoesNotPush) {
  const Muscle m = millard_muscle();
  const double length = m.slack_length + 0.1;
  EXPECT_EQ(muscle_force(m, 0.0, length, -0.5).force, 0.0);
  // A fibre that lengthens at full speed resists with 0.1 of max_force.
  Muscle straight = m;
  straight.pennation = 0.0;
  EXPECT_NEAR(muscle_force(straight, 0.0, length, 1.0).force, 100.0, 1e-9);
}

/// Activation after a time t without excitation: a logistic curve.
double falling(double a0, double t) {
  const double k = a0 / (0.5 + 1.5 * a0) * std::exp(-0.5 * t / 0.04);
  return 0.5 * k / (1.0 - 1.5 * k);
}

TEST(Muscle, ActivationFallsAsTheLogisticCurve) {
  const Muscle m;
  const auto error = [&](double h) {
    double a = 0.9;
    for (int i = 0; i < std::lround(0.06 / h); ++i) a = next_activation(m, a, 0.0, h);
    return std::abs(a - falling(0.9, 0.06));
  };
  EXPECT_LT(error(0.0005), 3e-5);
  for (const double h : {0.004, 0.002, 0.001})
    EXPECT_NEAR(error(h) / error(0.5 * h), 4.0, 0.4) << "the order is two";
}

// (1 - a) tau has the integral t / activation_time = -1.5 a - 2 log(1 - a) + constant.
TEST(Muscle, ActivationRisesAsTheIntegralSays) {
  const Muscle m;
  const auto clock = [](double a) { return -1.5 * a - 2.0 * std::log(1.0 - a); };
  double a = 0.1;
  for (int i = 0; i < 3000; ++i) a = next_activation(m, a, 1.0, 1e-5);
  EXPECT_NEAR(clock(a) - clock(0.1), 0.03 / 0.01, 1e-5);
}

TEST(Muscle, ActivationStaysBetweenItselfAndTheExcitation) {
  test::Random random(3);
  for (const double smoothing : {0.0, 0.2}) {
    Muscle m;
    m.activation_smoothing = smoothing;
    for (int i = 0; i < 2000; ++i) {
      const double a = random.uniform(0.0, 1.0), u = random.uniform(0.0, 1.0);
      const double next = next_activation(m, a, u, std::pow(10.0, random.uniform(-9.0, 9.0)));
      EXPECT_GE(next, std::min(a, u));
      EXPECT_LE(next, std::max(a, u));
    }
    EXPECT_EQ(next_activation(m, 0.2, 0.7, 1e6), 0.7);
    EXPECT_EQ(next_activation(m, 0.4, 0.4, 0.01), 0.4);
    EXPECT_EQ(next_activation(m, 0.4, 0.9, 0.0), 0.4);
    EXPECT_EQ(next_activation(m, 3.0, 5.0, 0.01), 1.0) << "clamped";
    EXPECT_EQ(next_activation(m, 1.0, -2.0, 1e6), 0.0) << "clamped";
  }
}

TEST(Muscle, SmoothingJoinsTheTimeConstants) {
  Muscle m;
  m.activation_smoothing = 0.2;
  const double a = 0.5, h = 1e-9;
  const auto tau = [&](double u) { return (u - a) * h / (next_activation(m, a, u, h) - a); };
  const double up = 0.01 * 1.25, down = 0.04 / 1.25;
  EXPECT_NEAR(tau(0.61), up, 1e-6 * up);
  EXPECT_NEAR(tau(0.39), down, 1e-6 * down);
  EXPECT_NEAR(tau(0.501) + tau(0.499), up + down, 1e-5);
  // A quarter of the width above the middle the fifth-degree step has the value 0.896484375.
  EXPECT_NEAR(tau(0.55), down + 0.896484375 * (up - down), 1e-6 * down);
}

}  // namespace
}  // namespace counterpoint::muscle_test
