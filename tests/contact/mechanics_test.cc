// Known answers of mechanics on contact problems built without the engine.
#include <gtest/gtest.h>

#include "contact/scenes.h"
#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact::mechanics_test {
namespace {

using testing::add_body;
using testing::add_points;
using testing::box_inertia;
using testing::kGravity;
using testing::make_stack;
using testing::SceneOptions;
using testing::ScenePoint;
using testing::Vector3;

struct Motion {
  Vector3 position = Vector3::Zero();
  Vector3 velocity = Vector3::Zero();
  Report report;
};

// Advances a point mass of 1 kg above the plane z = 0 by one step under gravity and `force`.
void step_point(Motion& m, const Vector3& force, double mu, const SceneOptions& options,
                Solver& solver) {
  const double h = options.time_step;
  Problem problem;
  problem.add_block(3);
  problem.mass(0).setIdentity();
  problem.free_velocity() = m.velocity + h * (Vector3(0, 0, -kGravity) + force);
  Law law;
  law.type = LawType::kFrictionCone;
  law.rows = 3;
  law.coulomb = options.coulomb;
  law.friction[0] = law.friction[1] = mu;
  law.regularizer = options.compliance;
  law.smoothing = options.smoothing * 9.80665;
  law.bias[0] = m.position.z() / h * (m.position.z() > 0 ? 1.0 : 0.2);
  problem.add_constraint(law, 0);
  problem.jacobian(0, 0) << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  VectorX w = m.velocity, f;
  m.report = solver.solve(problem, Settings{}, w, f);
  ASSERT_TRUE(succeeded(m.report.status));
  m.velocity = w;
  m.position += h * m.velocity;
}

TEST(Mechanics, HeldOnASlopeCreepsByTheCompliance) {
  // Steady creep of a block inside its friction cone: r f_T = eps g sin(theta) h.
  Solver solver;
  const double theta = std::atan(0.4);
  for (const bool coulomb : {false, true}) {
    SceneOptions options;
    options.coulomb = coulomb;
    Motion m;
    // Rotates gravity by theta; step_point itself adds (0, 0, -g).
    const Vector3 force(kGravity * std::sin(theta), 0, kGravity * (1 - std::cos(theta)));
    for (int i = 0; i < 200; ++i) step_point(m, force, 0.5, options, solver);
    const double expected = options.compliance * kGravity * std::sin(theta) * options.time_step;
    EXPECT_LT(expected, 1e-8);  // 0.01 um/s at 2 ms
    EXPECT_NEAR(m.velocity.x(), expected, 1e-3 * expected);
  }
}

TEST(Mechanics, SmoothingMakesABlockOnASlopeCreepAsItsLawSays) {
  // At a share q of the cone, t = mu v = (k / n) q / (1 - q) for the Coulomb law and (k / n) q / (1
  // - q^2) for the convex law, with n = m g h cos(theta).
  Solver solver;
  const double theta = std::atan(0.4), mu = 0.5, q = 0.4 / mu;
  for (const bool coulomb : {false, true}) {
    SceneOptions options;
    options.coulomb = coulomb;
    options.smoothing = 1e-6;
    Motion m;
    const Vector3 force(kGravity * std::sin(theta), 0, kGravity * (1 - std::cos(theta)));
    for (int i = 0; i < 400; ++i) step_point(m, force, mu, options, solver);
    const double n = kGravity * options.time_step * std::cos(theta);
    const double k = options.smoothing * 9.80665;
    const double expected = k / (n * mu) * q / (coulomb ? 1 - q : 1 - q * q);
    EXPECT_NEAR(m.velocity.x(), expected, 1e-3 * expected);  // the compliance adds a relative 2e-6
  }
}

TEST(Mechanics, SlopeSteeperThanTheConeSlides) {
  Solver solver;
  const double theta = std::atan(0.7), mu = 0.5;
  SceneOptions options;
  options.coulomb = true;
  Motion m;
  const Vector3 force(kGravity * std::sin(theta), 0, kGravity * (1 - std::cos(theta)));
  constexpr int kSteps = 100;
  for (int i = 0; i < kSteps; ++i) step_point(m, force, mu, options, solver);
  const double expected = kGravity * (std::sin(theta) - mu * std::cos(theta));
  EXPECT_NEAR(m.velocity.x() / (kSteps * options.time_step), expected, 1e-6 * expected);
}

TEST(Mechanics, SlidingStopsAtTheDiscreteDistanceAndDoesNotHover) {
  Solver solver;
  const double v0 = 2.0, mu = 0.5, h = 0.002;
  SceneOptions options;
  options.coulomb = true;
  Motion m;
  m.velocity.x() = v0;
  double highest = 0.0;
  for (int i = 0; i < 400; ++i) {
    step_point(m, Vector3::Zero(), mu, options, solver);
    highest = std::max(highest, m.position.z());
  }
  // Discrete solution: each step reduces the speed by mu g h and moves x with the new speed.
  double x = 0.0;
  for (double v = v0 - mu * kGravity * h; v > 0; v -= mu * kGravity * h) x += h * v;
  EXPECT_NEAR(m.position.x(), x, 1e-6);
  EXPECT_NEAR(m.position.x(), v0 * v0 / (2 * mu * kGravity), 0.5 * h * v0 * 1.1);
  EXPECT_LT(highest, 1e-9);

  // The convex law requires v_N >= mu |v_T|: the block lifts to at least h mu |v_T| = 2 mm.
  options.coulomb = false;
  Motion convex;
  convex.velocity.x() = v0;
  highest = 0.0;
  for (int i = 0; i < 400; ++i) {
    step_point(convex, Vector3::Zero(), mu, options, solver);
    highest = std::max(highest, convex.position.z());
  }
  EXPECT_GT(highest, 0.9 * h * mu * v0);
}

TEST(Mechanics, TwelveHeadingsOneDeceleration) {
  Solver solver;
  for (const bool coulomb : {false, true}) {
    double first = 0.0;
    for (int heading = 0; heading < 12; ++heading) {
      SceneOptions options;
      options.coulomb = coulomb;
      const double angle = M_PI / 6 * heading;
      Motion m;
      m.velocity << 2 * std::cos(angle), 2 * std::sin(angle), 0;
      for (int i = 0; i < 100; ++i) step_point(m, Vector3::Zero(), 0.5, options, solver);
      const double speed = m.velocity.head<2>().norm();
      if (heading == 0) first = speed;
      EXPECT_NEAR(speed, first,
                  1e-9 * first);  // 100 steps, each with the solver's 1e-10 of an impulse
      EXPECT_NEAR(std::atan2(m.velocity.y(), m.velocity.x()),
                  std::atan2(std::sin(angle), std::cos(angle)), 1e-10);
    }
  }
}

TEST(Mechanics, StacksOfTenBoxesWithExtremeMassRatios) {
  Solver solver;
  int worst = 0;
  for (const bool coulomb : {false, true}) {
    for (const double ratio : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {  // bottom : top
      for (const double eps : {1e-2, 1e-4, 1e-6, 1e-8}) {
        SceneOptions options;
        options.compliance = eps;
        options.coulomb = coulomb;
        std::vector<double> masses;
        for (int i = 0; i < 10; ++i) masses.push_back(std::pow(ratio, 0.5 - i / 9.0));
        const Problem problem = make_stack(masses, 0.2, 0.5, options);
        VectorX w = VectorX::Zero(problem.num_velocities()), f;
        w = problem.free_velocity();  // cold start
        const Report& report = solver.solve(problem, Settings{}, w, f);
        EXPECT_TRUE(succeeded(report.status))
            << ratio << " " << eps << " " << status_name(report.status);
        EXPECT_LE(report.iterations, 15) << ratio << " eps " << eps << " coulomb " << coulomb;
        worst = std::max(worst, report.iterations);
        // The ground carries the total weight as far as the compliance transmits the load: a light
        // box under heavy ones yields by eps times the mass ratio.
        double ground = 0.0, weight = 0.0;
        for (int c = 0; c < 4; ++c) ground += f[3 * c];
        for (const double m : masses) weight += m * kGravity * options.time_step;
        if (eps * std::max(ratio, 1 / ratio) <= 1e-2) {
          EXPECT_NEAR(ground, weight, 0.05 * weight) << ratio << " " << eps;
        }
      }
    }
  }
  RecordProperty("worst_iterations", worst);
}

TEST(Mechanics, LoadInAStackGrowsDownwards) {
  Solver solver;
  SceneOptions options;
  const Problem problem = make_stack(std::vector<double>(10, 1.0), 0.2, 0.5, options);
  VectorX w = VectorX::Zero(problem.num_velocities()), f;
  ASSERT_TRUE(succeeded(solver.solve(problem, Settings{}, w, f).status));
  for (int level = 0; level < 10; ++level) {
    double force = 0.0;
    for (int c = 0; c < 4; ++c) force += f[3 * (4 * level + c)];
    const double expected = (10 - level) * kGravity * options.time_step;
    EXPECT_NEAR(force, expected,
                1e-4 * expected);  // the compliance reduces the force by about eps x load^2
  }
}

TEST(Mechanics, BoxOnManyPointsMovesAsOnFour) {
  Solver solver;
  VectorX reference;
  for (const int side : {2, 4, 10}) {
    SceneOptions options;
    Problem problem;
    const double mass = 2.0, half = 0.25;
    add_body(problem, mass, box_inertia(mass, Vector3::Constant(2 * half)),
             Vector3(0.3, 0, -kGravity * options.time_step), Vector3(0, 0, 1.0));
    std::vector<ScenePoint> points;
    for (int i = 0; i < side; ++i) {
      for (int j = 0; j < side; ++j) {
        const double x = -half + 2 * half * i / (side - 1), y = -half + 2 * half * j / (side - 1);
        points.push_back(
            {-1, 0, Vector3::Zero(), Vector3(x, y, -half), Vector3::UnitZ(), 0.0, 0.0});
      }
    }
    add_points(problem, points, options);
    VectorX w = VectorX::Zero(6), f;
    const Report& report = solver.solve(problem, Settings{}, w, f);
    ASSERT_TRUE(succeeded(report.status));
    double sum = 0.0;
    for (size_t c = 0; c < points.size(); ++c) sum += f[3 * c];
    EXPECT_NEAR(sum, mass * kGravity * options.time_step, 1e-5 * sum);
    if (side == 2) reference = w;
    EXPECT_LT((w - reference).norm(), 1e-6);  // only the compliance depends on the number of points
  }
}

TEST(Mechanics, WedgeSticksWithFiniteForces) {
  // A box between two walls that approach each other by 1 mm/s; friction 0.9 holds it.
  Solver solver;
  for (const bool coulomb : {false, true}) {
    SceneOptions options;
    options.coulomb = coulomb;
    Problem problem;
    add_body(problem, 1.0, box_inertia(1.0, Vector3::Constant(0.2)),
             Vector3(0, 0, -kGravity * options.time_step), Vector3::Zero());
    const double tilt = 0.3;  // each wall leans outwards by this angle; tan(0.3) < 0.9
    std::vector<ScenePoint> points;
    for (const double sign : {-1.0, 1.0}) {
      const Vector3 normal(-sign * std::cos(tilt), 0, std::sin(tilt));
      for (const double y : {-0.1, 0.1}) {
        for (const double z : {-0.1, 0.1}) {
          points.push_back({-1, 0, Vector3::Zero(), Vector3(sign * 0.1, y, z), normal, 0.9, 0.0});
        }
      }
    }
    add_points(problem, points, options);
    VectorX w = VectorX::Zero(6), f;
    ASSERT_TRUE(succeeded(solver.solve(problem, Settings{}, w, f).status));
    EXPECT_LT(w.norm(), 1e-6);
    EXPECT_LT(f.cwiseAbs().maxCoeff(), 10 * kGravity * options.time_step);
  }
}

TEST(Mechanics, PainleveRodComesToRest) {
  // Painleve's rod slides on its lower end, leaning such that mu > (1 + 3 cos^2) / (3 sin cos).
  // Rigid-body dynamics with Coulomb friction then has no finite contact force; time stepping has
  // an impulse.
  Solver solver;
  const double mass = 1.0, length = 1.0, theta = 1.0, mu = 2.0;
  ASSERT_GT(mu, (1 + 3 * std::pow(std::cos(theta), 2)) / (3 * std::sin(theta) * std::cos(theta)));
  for (const bool coulomb : {false, true}) {
    for (const double direction : {-1.0, 1.0}) {
      SceneOptions options;
      options.coulomb = coulomb;
      Problem problem;
      add_body(problem, mass, Vector3::Constant(mass * length * length / 12),
               Vector3(direction, 0, -kGravity * options.time_step), Vector3::Zero());
      const Vector3 arm(-0.5 * length * std::cos(theta), 0, -0.5 * length * std::sin(theta));
      add_points(problem, {{-1, 0, Vector3::Zero(), arm, Vector3::UnitZ(), mu, 0.0}}, options);
      VectorX w = problem.free_velocity(), f;
      const Report& report = solver.solve(problem, Settings{}, w, f);
      ASSERT_TRUE(succeeded(report.status)) << coulomb << direction << status_name(report.status);
      EXPECT_TRUE(f.allFinite());
      EXPECT_LE(f.norm(), 10 * mass);  // order of magnitude: momentum at 1 m/s
      const VectorX free = problem.free_velocity();
      const auto energy = [&](const VectorX& v) { return 0.5 * v.dot(problem.mass(0) * v); };
      EXPECT_LE(energy(w), energy(free) * (1 + 1e-9));
      const Residuals residuals = compute_residuals(problem, w, f);
      EXPECT_LT(residuals.primal, 1e-12);
      EXPECT_LT(residuals.dual, 1e-4);
    }
  }
}

TEST(Mechanics, SmoothingVanishesAtTheExpectedRate) {
  // A resting mass hovers about delta above the ground: v_N = k / f_N - rho f_N with f_N = m g h.
  Solver solver;
  for (double delta = 1e-5; delta > 1e-9; delta *= 0.1) {
    SceneOptions options;
    options.smoothing = delta;
    options.compliance = 1e-9;
    Motion m;
    for (int i = 0; i < 400; ++i) step_point(m, Vector3::Zero(), 0.0, options, solver);
    EXPECT_NEAR(m.position.z(), delta * 9.80665 / kGravity, 1e-2 * delta);
  }
}

}  // namespace
}  // namespace counterpoint::contact::mechanics_test
