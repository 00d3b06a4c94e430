// Problems of mechanics with known answers, solved by the whole engine.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::known_answers_test {
namespace {

constexpr double kGravity = 9.81;

/// A free body of one or more shapes.
RobotSpec make_body(double mass, const SpatialInertia& inertia,
                    const std::vector<std::pair<Shape, Pose>>& shapes, double friction) {
  RobotSpec robot;
  robot.name = "body";
  LinkSpec link;
  link.name = "body";
  link.inertia = inertia;
  link.inertia.mass = mass;
  Material material;
  material.friction = friction;
  for (const auto& [shape, X_LG] : shapes) link.collisions.push_back({"", X_LG, shape, material});
  robot.links.push_back(link);
  return robot;
}

Scene finish(ModelBuilder& builder, FrictionModel friction) {
  Scene scene{"known answer", builder.build(), {}, {}, {}};
  scene.q = scene.model.default_q();
  scene.v = VectorX::Zero(scene.model.nv());
  scene.options.contact.friction_model = friction;
  return scene;
}

/// One body at X_WL over the plane z = 0.
Scene on_plane(const RobotSpec& robot, const Pose& X_WL, const Vector3& gravity, double friction,
               FrictionModel model) {
  ModelBuilder builder(gravity);
  builder.add_robot(robot, Base::kFloating, X_WL);
  Material material;
  material.friction = friction;
  builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), material);
  return finish(builder, model);
}

::testing::AssertionResult run(Simulator& sim, double duration) {
  const int steps = static_cast<int>(std::lround(duration / sim.options().time_step));
  for (int i = 0; i < steps; ++i) {
    const StepReport report = sim.step();
    if (!report.succeeded())
      return ::testing::AssertionFailure()
             << "step " << i << ": " << contact::status_name(report.status);
  }
  return ::testing::AssertionSuccess();
}

const FrictionModel kExactAndConvex[] = {FrictionModel::kCoulomb, FrictionModel::kConvex};

TEST(KnownAnswers, NothingCreepsOnASlope) {
  // tan(theta) = 0.4 < mu = 0.5; 2 ms, default settings.
  const double tangent = 0.4, cosine = 1.0 / std::hypot(1.0, tangent);
  const Vector3 gravity = kGravity * cosine * Vector3(tangent, 0, -1);
  struct Case {
    const char* name;
    Shape shape;
    Pose X_WL;
  };
  Pose lying;  // axis z of a rod along the slope
  lying.rotation = rotation_z_to(Vector3::UnitX());
  const auto above = [](Pose X, double height) {
    X.translation.z() = height;
    return X;
  };
  const Case cases[] = {
      {"box", {ShapeType::kBox, {0.1, 0.1, 0.1}, nullptr}, above({}, 0.1)},
      {"plate", {ShapeType::kBox, {0.3, 0.3, 0.005}, nullptr}, above({}, 0.005)},
      {"beam along", {ShapeType::kBox, {0.5, 0.01, 0.01}, nullptr}, above({}, 0.01)},
      {"beam across", {ShapeType::kBox, {0.01, 0.5, 0.01}, nullptr}, above({}, 0.01)},
      {"lying cylinder", {ShapeType::kCylinder, {0.01, 0.5, 0}, nullptr}, above(lying, 0.01)},
      {"lying capsule", {ShapeType::kCapsule, {0.005, 0.5, 0}, nullptr}, above(lying, 0.005)},
      {"standing cylinder", {ShapeType::kCylinder, {0.05, 0.1, 0}, nullptr}, above({}, 0.1)},
  };
  for (const Case& c : cases) {
    for (const FrictionModel friction : kExactAndConvex) {
      const RobotSpec robot = make_body(1.0, solid_inertia(c.shape, 1.0), {{c.shape, Pose()}}, 0.5);
      Simulator sim(on_plane(robot, c.X_WL, gravity, 0.5, friction));
      ASSERT_TRUE(run(sim, 0.4)) << c.name;
      const Vector3 before = sim.state().q.head<3>();
      ASSERT_TRUE(run(sim, 0.2)) << c.name;
      const double creep = (sim.state().q.head<3>() - before).norm() / 0.2;
      EXPECT_LT(creep, 0.01e-6) << c.name << " " << friction_model_name(friction);
    }
  }
}

TEST(KnownAnswers, SlidingBlockStopsWhereCoulombSaysWithoutHovering) {
  const double v0 = 2.0, mu = 0.5;
  Scene scene = test::box_on_plane({.friction = mu});
  scene.options.contact.friction_model = FrictionModel::kCoulomb;
  scene.options.contact.smoothing = 0.0;
  scene.v[0] = v0;
  Simulator sim(std::move(scene));
  const double h = sim.options().time_step;
  for (int i = 0; i < 400; ++i) {
    ASSERT_TRUE(sim.step().succeeded());
    ASSERT_LT(sim.state().q[2] - 0.1, 1e-9) << "step " << i;
    // It sinks by the yield of the regularizer, mu^2 eps g h^2 / 4 a contact, over beta = 0.2.
    ASSERT_GT(sim.state().q[2] - 0.1, -1e-10) << "step " << i;
  }
  // The scheme by hand: each step reduces the speed by mu g h, then moves with the new speed.
  // Against v0^2 / (2 mu g) this loses h v0 / 2, and up to h^2 mu g / 8 at the end. Beyond that:
  // creep by the regularizers in the last step (1e-8), and the slip that friction is allowed there,
  // h / slip_time of the speed at the start of the last step.
  const double left = 1e-8 + h * (h / sim.options().contact.slip_time) * mu * kGravity * h;
  double x = 0.0;
  for (double v = v0 - mu * kGravity * h; v > 0.0; v -= mu * kGravity * h) x += h * v;
  EXPECT_NEAR(sim.state().q[0], x, left);
  EXPECT_NEAR(sim.state().q[0], v0 * v0 / (2 * mu * kGravity) - 0.5 * h * v0,
              h * h * mu * kGravity / 8 + left);
}

TEST(KnownAnswers, TwelveHeadingsOneDeceleration) {
  for (const FrictionModel friction : kExactAndConvex) {
    double first = 0.0, spread = 0.0, turned = 0.0;
    for (int heading = 0; heading < 12; ++heading) {
      const double angle = M_PI / 6.0 * heading;
      Scene scene = test::box_on_plane({.half = Vector3(0.1, 0.1, 0.01)});
      scene.options.contact.friction_model = friction;
      scene.v.head<2>() << 2.0 * std::cos(angle), 2.0 * std::sin(angle);
      Simulator sim(std::move(scene));
      ASSERT_TRUE(run(sim, 0.3));
      const Vector3 v = sim.state().v.head<3>();
      const double speed = v.head<2>().norm();
      if (heading == 0) first = speed;
      spread = std::max(spread, std::abs(speed - first));
      turned = std::max(turned, std::abs(v.x() * std::sin(angle) - v.y() * std::cos(angle)));
    }
    // The solver's 1e-10 per impulse, over 150 steps.
    EXPECT_LT(spread, 1e-9) << friction_model_name(friction);
    EXPECT_LT(turned, 1e-9) << friction_model_name(friction);
    // The convex law hops; its deceleration equals Coulomb's only on average.
    EXPECT_NEAR(first, 2.0 - 0.5 * kGravity * 0.3,
                friction == FrictionModel::kCoulomb ? 1e-8 : 0.005);
  }
}

TEST(KnownAnswers, BoxSlidesAndRestsOnAHundredFeetAsOnFour) {
  const Shape foot{ShapeType::kSphere, {0.01, 0, 0}, nullptr};
  const Shape box{ShapeType::kBox, {0.2, 0.2, 0.05}, nullptr};
  VectorX reference;
  for (const int side : {2, 4, 10}) {
    std::vector<std::pair<Shape, Pose>> feet;
    for (int i = 0; i < side; ++i) {
      for (int j = 0; j < side; ++j) {
        Pose X;
        X.translation << -0.2 + 0.4 * i / (side - 1), -0.2 + 0.4 * j / (side - 1), -0.05;
        feet.emplace_back(foot, X);
      }
    }
    Pose X_WL;
    X_WL.translation.z() = 0.06;
    Scene scene = on_plane(make_body(2.0, solid_inertia(box, 2.0), feet, 0.5), X_WL,
                           Vector3(0, 0, -kGravity), 0.5, FrictionModel::kCoulomb);
    scene.v.head<2>() << 1.0, 0.3;
    Simulator sim(std::move(scene));
    ASSERT_TRUE(run(sim, 0.5));  // it has stopped after 0.21 s
    const VectorX q = sim.state().q, v = sim.state().v;
    ASSERT_TRUE(sim.step().succeeded());
    const Inverse& inverse = sim.inverse(q, v, sim.state().v);
    EXPECT_EQ(static_cast<int>(inverse.contacts.size()), side * side);
    double weight = 0.0;
    for (const ContactForce& c : inverse.contacts) weight -= c.force.z();
    EXPECT_NEAR(weight, 2.0 * kGravity, 1e-8) << side;  // the solver's relative 1e-10
    if (side == 2) reference = q;
    // Only the compliance depends on the number of feet: mu^2 eps g h over n, for 250 steps.
    EXPECT_LT((q - reference).norm(), 1e-8) << side;
  }
}

/// A wedge of 1 kg whose sides open upwards by `half_angle` each, `height` [m] above its seat
/// between two planes of the same inclination.
Scene wedge(double half_angle, double mu, double height) {
  std::vector<Vector3> corners;
  for (const double y : {-0.1, 0.1}) {
    for (const double x : {-1.0, 1.0}) {
      corners.emplace_back(x * 0.05, y, -0.1);
      corners.emplace_back(x * (0.05 + 0.2 * std::tan(half_angle)), y, 0.1);
    }
  }
  const Shape hull{ShapeType::kConvexMesh, {}, make_convex_hull(corners)};
  const SpatialInertia inertia = solid_inertia({ShapeType::kBox, {0.1, 0.1, 0.1}, nullptr}, 1.0);
  ModelBuilder builder(Vector3(0, 0, -kGravity));
  Pose X_WL;
  X_WL.translation.z() = height;
  builder.add_robot(make_body(1.0, inertia, {{hull, Pose()}}, mu), Base::kFloating, X_WL);
  Material material;
  material.friction = mu;
  for (const double side : {-1.0, 1.0}) {
    Pose X_WG;
    X_WG.rotation = rotation_z_to(Vector3(-side * std::cos(half_angle), 0, std::sin(half_angle)));
    X_WG.translation << side * 0.05, 0, -0.1;
    builder.add_environment(side < 0 ? "left" : "right", {ShapeType::kPlane, {}, nullptr}, X_WG,
                            material);
  }
  return finish(builder, FrictionModel::kCoulomb);
}

TEST(KnownAnswers, WedgeSeatsBelowAndAboveTheSelfLockingAngle) {
  // Sides of half-angle a carry the weight by N sin(a) + T cos(a) = m g / 2, |T| <= mu N. For mu
  // below tan(a), N lies between m g / (2 (sin(a) +- mu cos(a))); above it the wedge locks and any
  // larger N is possible. It must seat, stay, and press no harder than the impact justifies.
  for (const double half_angle : {0.2, 0.4}) {
    for (const double mu : {0.05, 0.1, 0.3, 0.9}) {
      for (const double height : {0.0, 0.05}) {
        SCOPED_TRACE(::testing::Message() << half_angle << " mu " << mu << " from " << height);
        Simulator sim(wedge(half_angle, mu, height));
        ASSERT_TRUE(run(sim, 0.6));
        const double seated = sim.state().q[2];
        // Within 1 nm of its seat; sin(a) of that is across the wall.
        EXPECT_NEAR(seated, 0.0, 1e-9);
        const double s = std::sin(half_angle), c = std::cos(half_angle);
        const double low = kGravity / (2.0 * (s + mu * c));
        const double high = mu < s / c ? kGravity / (2.0 * (s - mu * c)) : 10.0 * kGravity;
        for (int i = 0; i < 200; ++i) {
          const VectorX q = sim.state().q, v = sim.state().v;
          ASSERT_TRUE(sim.step().succeeded());
          double normal = 0.0;
          for (const ContactForce& f : sim.inverse(q, v, sim.state().v).contacts)
            normal += 0.5 * std::abs(f.force.dot(f.contact.normal));
          EXPECT_GT(normal, low * (1.0 - 1e-6));
          EXPECT_LT(normal, high * (1.0 + 1e-6));
        }
        EXPECT_NEAR(sim.state().q[2], seated, 1e-9);
      }
    }
  }
}

TEST(KnownAnswers, PainlevesRodComesToRest) {
  // A leaning rod slides on its lower end. Above mu = (1 + 3 cos^2) / (3 sin cos), 1.37 here, rigid
  // Coulomb friction in one direction has no finite force, or two; time stepping has an impulse.
  const double length = 1.0, radius = 0.01, theta = 1.0;
  const Shape rod{ShapeType::kCapsule, {radius, 0.5 * length, 0}, nullptr};
  for (const FrictionModel friction : kExactAndConvex) {
    for (const double mu : {0.3, 1.0, 1.4, 1.5, 1.7, 2.0, 3.0}) {
      for (const double direction : {-1.0, 1.0}) {
        SCOPED_TRACE(::testing::Message()
                     << friction_model_name(friction) << " mu " << mu << " " << direction);
        Pose X_WL;
        X_WL.rotation = rotation_z_to(Vector3(std::cos(theta), 0, std::sin(theta)));
        X_WL.translation.z() = radius + 0.5 * length * std::sin(theta);
        Scene scene = on_plane(make_body(1.0, solid_inertia(rod, 1.0), {{rod, Pose()}}, mu), X_WL,
                               Vector3(0, 0, -kGravity), mu, friction);
        scene.v[0] = 2.0 * direction;
        Simulator sim(std::move(scene));
        // Bound of the centre's speed: all energy of 2 m/s and of a fall from its initial height.
        const double fastest = std::sqrt(4.0 + 2.0 * kGravity * X_WL.translation.z());
        for (int i = 0; i < 1500; ++i) {
          const StepReport report = sim.step();
          ASSERT_TRUE(report.succeeded()) << "step " << i << contact::status_name(report.status);
          // The laws are not softened, and the iterations stay below those that lead to softening.
          ASSERT_FALSE(report.softening.any()) << "step " << i;
          ASSERT_LT(report.newton_iterations, contact::Settings().soften_after) << "step " << i;
          // An impact of 3 m/s in one step yields r f = eps v, 3e-6 m/s, or 6 nm over h; rotation
          // adds terms of second order.
          ASSERT_LT(report.max_penetration, 1e-6) << "step " << i;
          ASSERT_LT(sim.state().v.head<3>().norm(), fastest) << "step " << i;
        }
        EXPECT_LT(sim.state().v.norm(), 1e-9);
        EXPECT_NEAR(sim.state().q[2], radius, 1e-9);
      }
    }
  }
}

TEST(KnownAnswers, StacksOfTenBoxesWithExtremeMassRatiosStand) {
  constexpr int kMostSteps = 15;
  for (const FrictionModel friction : kExactAndConvex) {
    for (const double ratio : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {  // bottom : top
      SCOPED_TRACE(::testing::Message() << friction_model_name(friction) << " " << ratio);
      ModelBuilder builder(Vector3(0, 0, -kGravity));
      const Shape box{ShapeType::kBox, {0.1, 0.1, 0.1}, nullptr};
      double total = 0.0, load = 0.0;  // largest weight on a box over its own
      for (int i = 9; i >= 0; --i) {
        const double mass = std::pow(ratio, 0.5 - i / 9.0);
        total += mass;
        load = std::max(load, total / mass);
        Pose X_WL;
        X_WL.translation.z() = 0.1 + 0.2 * i;
        builder.add_robot(make_body(mass, solid_inertia(box, mass), {{box, Pose()}}, 0.5),
                          Base::kFloating, X_WL, std::to_string(i) + "/");
      }
      Material material;
      material.friction = 0.5;
      builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), material);
      Simulator sim(finish(builder, friction));
      const VectorX start = sim.state().q;
      for (int i = 0; i < 500; ++i) {
        const StepReport report = sim.step();
        ASSERT_TRUE(report.succeeded()) << "step " << i << contact::status_name(report.status);
        // The first step is a cold start.
        EXPECT_LE(report.newton_iterations, kMostSteps) << "step " << i;
      }
      EXPECT_LT(sim.state().v.cwiseAbs().maxCoeff(), 1e-9);
      // A contact yields mu^2 r f h / beta with four contacts to a face, alpha about 1 / m of the
      // lighter box, and ten faces above each other; 1 nm of smoothing and rounding.
      const ContactOptions& options = sim.options().contact;
      const double h = sim.options().time_step;
      const double give =
          0.25 * options.compliance * load * kGravity * h * h / 4.0 / options.stabilization;
      EXPECT_LT((sim.state().q - start).cwiseAbs().maxCoeff(), 10.0 * give + 1e-9);
    }
  }
}

// Impulses are equal and opposite to the bit; the resulting velocities are accurate to the rounding
// of velocities, 1.1e-16 of 1 m/s, over the compliance, at each of four impacts.
TEST(Momentum, OfImpactsIsKeptToRoundOffOverTheCompliance) {
  for (const double compliance : {1e-6, 1e-4, 1e-2}) {
    Simulator sim(load_scene(test::source_dir() + "/data/scenes/hard/cradle_apart.yaml"));
    sim.options().contact.compliance = compliance;
    sim.settings().tolerance = 1e-16;  // only rounding ends a solve
    ASSERT_TRUE(run(sim, 0.1));
    double momentum = 0.0;
    for (int ball = 0; ball < 5; ++ball) momentum += sim.state().v[6 * ball];
    EXPECT_NEAR(momentum, 1.0, 4.0 * 1.1e-16 / compliance + 1e-15) << compliance;
    EXPECT_GT(sim.state().v[24], 0.9);  // four impacts
  }
}

// Poses move by the velocity at the end of each step: a block that accelerates at a from rest gets
// a h t / 2 further than a t^2 / 2 (docs/explanation/concepts.md, "Sliding is of first order").
TEST(SlidingRamp, IsTooFarByHalfAStepOfItsSpeed) {
  const double slope = 0.6, friction = 0.5, cosine = 1.0 / std::hypot(1.0, slope), t = 1.0;
  const double a = kGravity * cosine * (slope - friction);
  for (const double h : {4e-3, 2e-3, 1e-3}) {
    Simulator sim(test::box_on_plane(
        {.friction = friction, .gravity = kGravity * cosine * Vector3(slope, 0, -1)}));
    sim.options().time_step = h;
    const double start = sim.state().q[0];
    ASSERT_TRUE(run(sim, t));
    // The law's compliance, 1e-6, and its smoothing take a thousandth of the error at 1 ms.
    EXPECT_NEAR(sim.state().q[0] - start - 0.5 * a * t * t, 0.5 * a * h * t, 5e-7) << h;
  }
}

}  // namespace
}  // namespace counterpoint::known_answers_test
