// `counterpoint accuracy`: errors against analytic solutions, convergence orders, recommendations.
// Costs come from fake engines, so that no result depends on the machine.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "accuracy/closed_forms.h"
#include "accuracy/measure.h"
#include "accuracy/recommendation.h"
#include "apps/command.h"
#include "counterpoint/model/spatial.h"
#include "support/small_scenes.h"

namespace counterpoint::apps::accuracy::accuracy_test {
namespace {

using test::CommandFolder;
using test::CommandResult;

constexpr double kGravity = 9.81;  // [m/s^2]

const nlohmann::json& family(const nlohmann::json& report, const std::string& name) {
  for (const auto& f : report.at("families"))
    if (f.at("name") == name) return f;
  throw std::runtime_error("no family " + name);
}

// ---- step control and another engine ------------------------------------------------------------

TEST(Accuracy, AnotherEngineStandsBesideAndIsNotRecommended) {
  const CommandFolder folder("accuracy_mujoco");
  const nlohmann::json report = folder.report(
      "accuracy data/scenes/accuracy/double_pendulum.yaml --vary integrator,adaptive,mujoco "
      "--duration 1 --pieces 2 --repeats 1 --want 1e-3");
  // The error follows the tolerance over six decades, within a factor of ten.
  const auto& adaptive = family(report, "adaptive runge_kutta_4").at("points");
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const auto& point : adaptive) {
    if (point.at("value") > 1e-2 || point.at("value") < 1e-8) continue;
    const double share = point.at("error").get<double>() / point.at("value").get<double>();
    least = std::min(least, share);
    most = std::max(most, share);
  }
  EXPECT_LT(most / least, 10.0);
  EXPECT_EQ(report.at("recommendations")[0].at("setting").get<std::string>().find("MuJoCo"),
            std::string::npos);
  if (!report.at("left_out").empty()) GTEST_SKIP() << report.at("left_out");
  for (const auto& f : report.at("families")) {
    if (!f.value("other_engine", false)) continue;
    for (const auto& point : f.at("points")) EXPECT_FALSE(point.at("front").get<bool>());
    // Without constraints both engines have the same limit, so one reference serves both.
    EXPECT_FALSE(f.contains("own_reference_apart"));
    if (f.at("name").get<std::string>().find("RK4") == std::string::npos) continue;
    // Both engines use the same classical Runge-Kutta method in joint angles.
    const auto& ours = family(report, "runge_kutta_4").at("points");
    for (size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(f.at("points")[k].at("error").get<double>() / ours[k].at("error").get<double>(),
                  1.0, 1e-2);
  }
  EXPECT_FALSE(report.at("comparisons").empty());
}

// ---- orders, on real scenes ---------------------------------------------------------------------

TEST(Accuracy, OrdersAreThoseOfTheIntegrators) {
  for (const char* scene : {"double_pendulum", "heavy_top"}) {
    const CommandFolder folder(std::string("accuracy_") + scene);
    folder.succeed(
        fmt::format("accuracy data/scenes/accuracy/{}.yaml --vary integrator --duration "
                    "1 --pieces 5 --repeats 1 --json {{}}/r.json",
                    scene));
    const nlohmann::json report = folder.json("r.json");
    // Slopes over a factor of eight in the step. The finest step is a thousandth of the motion's
    // time scale; terms of the next order change the slopes by less than kSlope.
    constexpr double kSlope = 0.1;
    EXPECT_NEAR(family(report, "semi_implicit_euler").at("order"), 1.0, kSlope) << scene;
    EXPECT_NEAR(family(report, "implicit_midpoint").at("order"), 2.0, kSlope) << scene;
    EXPECT_NEAR(family(report, "runge_kutta_4").at("order"), 4.0, 2 * kSlope) << scene;
    EXPECT_EQ(report.at("reference").at("kind"), "fine");
    EXPECT_LT(report.at("reference").at("error"), 1e-11);  // round-off of 64000 steps
  }
}

TEST(Accuracy, FirstOrderWithFrictionAndOrientationsOfOrderFour) {
  const CommandFolder folder("accuracy_known");
  CommandResult result = folder.run(
      "accuracy data/scenes/accuracy/slide_to_stop.yaml --vary integrator --repeats 1 --json "
      "{}/r.json --report {}/report");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  nlohmann::json report = folder.json("r.json");
  EXPECT_EQ(report.at("reference").at("kind"), "analytic");
  EXPECT_NEAR(family(report, "semi_implicit_euler").at("order"), 1.0, 0.02);
  // Semi-implicit Euler moves with the velocity at the end of each step, so the position lags by
  // h/2 times the loss of speed, mu g 0.032 s per piece. One of six coordinates is off: factor
  // sqrt(1/6) in the root mean square. Holds while the box slides during the whole piece.
  const auto& coarse = family(report, "semi_implicit_euler").at("points")[4];
  EXPECT_NEAR(coarse.at("error_worst_piece"), 0.5 * 0.002 * 0.5 * kGravity * 0.032 / std::sqrt(6.0),
              1e-9);
  EXPECT_EQ(family(report, "runge_kutta_4").at("status"), "not run");
  EXPECT_NE(result.output.find("runge_kutta_4 was not run"), std::string::npos);
  EXPECT_NE(folder.read("report/accuracy.html").find("<svg"), std::string::npos);
  EXPECT_NE(folder.read("report/accuracy.csv").find("runge"), 0u);

  result = folder.run(
      "accuracy data/scenes/accuracy/dzhanibekov.yaml --vary integrator --duration 5 --repeats 1 "
      "--json {}/r.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  report = folder.json("r.json");
  EXPECT_EQ(report.at("reference").at("kind"), "analytic");
  EXPECT_NEAR(family(report, "semi_implicit_euler").at("order"), 1.0, 0.05);
  EXPECT_NEAR(family(report, "implicit_midpoint").at("order"), 2.0, 0.05);
  EXPECT_NEAR(family(report, "runge_kutta_4").at("order"), 4.0, 0.1);
  // The closed form against order-4 steps of 31 us, which share no code with it but gravity.
  EXPECT_LT(report.at("reference").at("fine_deviation"), 1e-11);
}

// ---- references ---------------------------------------------------------------------------------

Scene sliding_box() {
  Scene scene = test::box_on_plane({});
  scene.v[0] = 2.0;
  scene.options.duration = 0.6;
  return scene;
}

TEST(Accuracy, KnowsASlidingBlock) {
  const Scene scene = sliding_box();
  const Recognized known = recognize(scene);
  ASSERT_TRUE(known.motion) << known.why_not;
  const double brake = 0.5 * kGravity, stop = 2.0 / brake;
  EXPECT_NEAR(known.motion(0.2).q[0], 2.0 * 0.2 - 0.5 * brake * 0.04, 1e-15);
  EXPECT_NEAR(known.motion(0.2).v[0], 2.0 - brake * 0.2, 1e-15);
  EXPECT_NEAR(known.motion(stop + 1.0).q[0], 4.0 / (2.0 * brake), 1e-15);
  EXPECT_EQ(known.motion(stop + 1.0).v[0], 0.0);
}

TEST(Accuracy, KnowsABlockThatSlidesBack) {
  test::BoxOnPlane box;
  const double slope = 0.8;  // tangent of the slope; friction 0.5 does not hold the block
  box.gravity = kGravity * Vector3(slope, 0, -1).normalized();
  Scene scene = test::box_on_plane(box);
  scene.v[0] = -1.0;  // uphill
  const Recognized known = recognize(scene);
  ASSERT_TRUE(known.motion) << known.why_not;
  const double cosine = 1.0 / std::hypot(1.0, slope), normal = kGravity * cosine;
  const double up = normal * (slope + 0.5), down = normal * (slope - 0.5), turn = 1.0 / up;
  EXPECT_NEAR(known.motion(turn + 0.3).v[0], down * 0.3, 1e-14);
  EXPECT_NEAR(known.motion(turn + 0.3).q[0], -0.5 / up + 0.5 * down * 0.09, 1e-14);
}

TEST(Accuracy, KnowsASphereThatRolls) {
  test::BallOnPlane ball;
  ball.material.friction = 0.3;
  Scene scene = test::ball_on_plane(ball);
  scene.v[1] = 2.0;
  const Recognized known = recognize(scene);
  ASSERT_TRUE(known.motion) << known.why_not;
  const double g = -scene.model.gravity().z(), rolls = 2.0 * 2.0 / (7.0 * 0.3 * g);
  const State before = known.motion(0.5 * rolls), after = known.motion(rolls + 0.1);
  EXPECT_NEAR(before.v[1], 2.0 - 0.15 * g * rolls, 1e-14);
  EXPECT_NEAR(after.v[1], 2.0 * 5.0 / 7.0, 1e-14);
  EXPECT_NEAR(after.v[3], -after.v[1] / 0.1,
              1e-12);  // about x; the same component in the body-fixed frame
  EXPECT_NEAR(after.q[1], 2.0 * rolls - 0.15 * g * rolls * rolls + after.v[1] * 0.1, 1e-14);
}

TEST(Accuracy, KnowsNoClosedFormWhereSomethingElseActs) {
  EXPECT_FALSE(recognize(test::pendulum({})).motion);
  Scene spinning = sliding_box();
  spinning.v[5] = 1.0;
  EXPECT_NE(recognize(spinning).why_not.find("it spins"), std::string::npos);
  test::BoxOnPlane tall;
  tall.half = Vector3(0.1, 0.1, 0.3);  // friction 0.5: the box tips over its edge
  Scene tipping = test::box_on_plane(tall);
  tipping.v[0] = 2.0;
  EXPECT_NE(recognize(tipping).why_not.find("friction may tip it"), std::string::npos);
  test::BoxOnPlane above;
  above.height = 0.01;
  EXPECT_NE(recognize(test::box_on_plane(above)).why_not.find("off the plane"), std::string::npos);
  test::BoxOnPlane bouncy;
  bouncy.restitution = 0.5;
  EXPECT_FALSE(recognize(test::box_on_plane(bouncy)).motion);
  Scene dragged = test::free_ball({.drag = {.linear = 1.0}});
  EXPECT_NE(recognize(dragged).why_not.find("drag"), std::string::npos);
  EXPECT_TRUE(recognize(test::free_ball({})).motion);
}

TEST(Accuracy, NoticesAWrongReference) {
  const Scene scene = sliding_box();
  const Plan plan = plan_pieces(scene.options, 5, 0.0);
  const ClosedForm right = recognize(scene).motion;
  EXPECT_EQ(analytic_reference(scene, plan, right, "right", 16).warning, "");
  // A friction coefficient 1 % too large displaces the box by 25 mm/s^2 t^2, to which no run
  // converges.
  Scene other = scene;
  const ClosedForm wrong = [&](double time) {
    State state = right(time);
    state.q[0] -= 0.5 * 0.01 * 0.5 * kGravity * time * time;
    return state;
  };
  const Reference noticed = analytic_reference(scene, plan, wrong, "wrong", 16);
  EXPECT_NE(noticed.warning.find("not what the engine converges to"), std::string::npos);
}

TEST(Accuracy, TellsHowFarAFineReferenceIsOff) {
  const CommandFolder folder("accuracy_coarse_reference");
  // A reference at half the scene's step is less accurate than points at an eighth of it; the
  // report must say so.
  const CommandResult result = folder.run(
      "accuracy data/scenes/accuracy/humanoid_drop.yaml --vary timestep --duration 0.2 --pieces 2 "
      "--finer 2 --repeats 1 --want 1e-9 --json {}/r.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json report = folder.json("r.json");
  EXPECT_GT(report.at("reference").at("error"), 1e-6);
  EXPECT_EQ(report.at("families")[0].at("points").back().at("above_reference"), false);
  EXPECT_FALSE(report.at("recommendations")[0].at("met"));
  EXPECT_NE(result.output.find("cannot be told from it"), std::string::npos);
}

TEST(Accuracy, DeviationIsTheRootMeanSquareOnTheManifold) {
  const Scene scene = test::box_on_plane({});
  VectorX q = scene.q;
  q[0] += 0.3;
  const Quaternion turn = quaternion_exp(Vector3(0.0, 0.4, 0.0));
  q.segment<4>(3) << turn.w(), turn.x(), turn.y(), turn.z();
  const Deviation d = deviation(scene.model, scene.q, q);
  EXPECT_NEAR(d.length, 0.3 / std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(d.angle, 0.4 / std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(d.all, 0.5 / std::sqrt(6.0), 1e-15);
  q.segment<4>(3) *= -1.0;  // the same orientation
  EXPECT_NEAR(deviation(scene.model, scene.q, q).all, 0.5 / std::sqrt(6.0), 1e-15);
}

// ---- physics of contact ---------------------------------------------------------------------

TEST(Accuracy, MeasuresPhysicsOfContact) {
  const Scene scene = sliding_box();
  const Plan plan = plan_pieces(scene.options, 2, 0.0);
  const Reference reference = make_reference(scene, plan, ReferenceKind::kAutomatic, 8);
  EngineSetting setting{scene.options, {}};
  const Physics exact = measure_physics(scene, setting, plan, reference.pieces, true);
  ASSERT_TRUE(exact.contact && exact.block);
  const double h = scene.options.time_step, eps = scene.options.contact.compliance;
  // docs/explanation/concepts.md: creep is about eps g h sin(theta) on a slope of tan(theta) = 0.4;
  // delta/h is 1e3 times smaller. Four corners share the load, which makes it less than for one
  // contact.
  const double creep = eps * kGravity * h * 0.4 / std::hypot(1.0, 0.4);
  EXPECT_LT(exact.block->creep, creep);
  EXPECT_GT(exact.block->creep, 0.1 * creep);
  EXPECT_LT(std::abs(exact.block->hover), 1e-9);
  EXPECT_LT(exact.contact->complementarity, 1e-5);  // [W]; friction dissipates 10 W at 2 m/s
  EXPECT_LT(exact.inverse_error, 1e-6);
  setting.options.contact.friction_model = FrictionModel::kConvex;
  const Physics convex = measure_physics(scene, setting, plan, reference.pieces, true);
  // The convex law lifts sliding contacts, so its forces do work where rigid contact does none.
  EXPECT_GT(convex.block->hover, 1e-3);
  EXPECT_GT(convex.contact->complementarity, 1.0);
}

// ---- the command --------------------------------------------------------------------------------

TEST(Accuracy, SaysWhatIsWrongWithACommandLine) {
  const CommandFolder folder("accuracy_bad");
  const auto expect = [&](const std::string& arguments, const std::string& part) {
    const CommandResult result = folder.run("accuracy " + arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_NE((result.errors + result.output).find(part), std::string::npos)
        << arguments << ": " << result.errors;
  };
  const std::string scene = "data/scenes/accuracy/double_pendulum.yaml ";
  expect(scene + "--vary speed", "--vary speed: expected one or more of timestep");
  expect(scene + "--reference analytic --vary timestep", "no closed form of this motion is known");
  expect(scene + "--want 0", "--want 0: expected an error");
  expect(scene + "--piece 0.0015", "expected a multiple of the scene's time step");
  expect(scene + "--piece 5", "do not fit");
  expect(scene + "--timestep -1", "time step -1 s: expected a positive number");
  expect(scene + "--duration 0", "expected more than 0");
  expect(scene + "--finer 1", "--finer");
  expect(scene + "--pieces 0", "--pieces");
  expect("nowhere.yaml", "nowhere.yaml");
}

TEST(Accuracy, BothContactLawsAreConvexAlike) {
  const CommandFolder folder("accuracy_law");
  const nlohmann::json report =
      folder.report("accuracy data/scenes/accuracy/slide_to_roll.yaml --vary law --repeats 1");
  const auto& spectral = family(report, "law spectral, convex").at("points");
  const auto& other = family(report, "law kinetic_energy, convex").at("points");
  ASSERT_EQ(spectral.size(), other.size());
  // Both settings approximate the same law, least kinetic energy with relaxed complementarity, over
  // pieces of one to four steps. Their forces at a distance differ by a few per cent.
  for (size_t i = 0; i < 3; ++i) {
    const double error = spectral[i].at("error");
    EXPECT_NEAR(other[i].at("error"), error, 0.1 * error);
    EXPECT_FALSE(other[i].contains("physics"));
  }
}

TEST(Accuracy, PresetsDifferAsTheirLawsDo) {
  const CommandFolder folder("accuracy_preset");
  const nlohmann::json report =
      folder.report("accuracy data/scenes/accuracy/slide_to_stop.yaml --vary preset --repeats 1");
  const auto physics = [&](const char* preset) {
    for (const auto& point : family(report, fmt::format("contact {}", preset)).at("points"))
      if (point.at("value") == report.at("time_step_s")) return point.at("physics");
    throw std::runtime_error("not measured at the scene's step");
  };
  // The convex law opens a contact that slides at speed v by h mu v per step, until gravity closes
  // it; the non-associated law does not. Creep is proportional to the compliance: 0.1, 1e-6, 1e-8.
  EXPECT_GT(physics("fast").at("hover_m").get<double>(), 1e-3);
  EXPECT_LT(std::abs(physics("default").at("hover_m").get<double>()), 1e-9);
  const double creep = physics("default").at("creep_m_s");
  EXPECT_GT(physics("fast").at("creep_m_s").get<double>(), 1e3 * creep);
  EXPECT_LT(physics("hard").at("creep_m_s").get<double>(), creep);
}

TEST(Accuracy, LeavesOutWhatSaysNothing) {
  const CommandFolder folder("accuracy_idle");
  const nlohmann::json report = folder.report(
      "accuracy data/scenes/accuracy/heavy_top.yaml --vary friction,timestep --duration 0.2 "
      "--repeats 1");
  EXPECT_EQ(report.at("families").size(), 1u);
  EXPECT_EQ(report.at("left_out")[0], "friction: nothing can touch with friction");
}

}  // namespace
}  // namespace counterpoint::apps::accuracy::accuracy_test
