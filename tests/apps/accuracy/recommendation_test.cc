// Convergence orders, Pareto fronts and recommendations from synthetic errors and costs; pieces of
// a motion; a fake engine.
#include "accuracy/recommendation.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "accuracy/measure.h"
#include "support/small_scenes.h"

namespace counterpoint::apps::accuracy::recommendation_test {
namespace {

constexpr double kGravity = 9.81;  // [m/s^2]
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

MeasuredFamily made_up(const std::vector<double>& errors, const std::vector<double>& costs) {
  MeasuredFamily measured{{"timestep", "made up", "time_step_s", {}}, {}, {}, {}};
  double step = 0.01;
  for (size_t i = 0; i < errors.size(); ++i, step /= 2) {
    Point point;
    point.setting = {fmt::format("made up {}", i), step, "", {}};
    point.error.all = errors[i];
    point.cost = costs[i];
    point.failed = std::isnan(errors[i]) ? 1 : 0;
    measured.points.push_back(point);
  }
  return measured;
}

TEST(Accuracy, FitsTheOrderWhereItShows) {
  std::vector<double> steps, errors;
  for (int k = 0; k < 8; ++k) {
    steps.push_back(std::ldexp(0.1, -k));
    errors.push_back(3.0 * std::pow(steps.back(), 2));
  }
  errors[0] = errors[1] = 0.5;  // not yet asymptotic
  errors[7] = 4e-7;             // at the error of the reference
  const auto order = fit_order(steps, errors, 1e-7);
  ASSERT_TRUE(order);
  EXPECT_NEAR(order->slope, 2.0, 1e-12);
  EXPECT_EQ(order->points, 4);
  EXPECT_NEAR(order->to, steps[6], 1e-12);
  EXPECT_FALSE(fit_order(steps, errors, 1e-2));           // only two points exceed ten times 1e-2
  EXPECT_FALSE(fit_order({0.1, 0.05}, {1.0, 0.5}, 0.0));  // two points do not determine a slope
  errors[5] = kNaN;                                       // failed points are left out
  EXPECT_NEAR(fit_order(steps, errors, 1e-7)->slope, 2.0, 1e-12);
}

TEST(Accuracy, RecommendsTheCheapestThatIsGoodEnough) {
  const std::vector<MeasuredFamily> measured = {made_up({1e-1, 1e-2, 1e-3, 1e-4}, {1, 2, 4, 8}),
                                                made_up({kNaN, 5e-4, 2e-4}, {kNaN, 3, 9})};
  EXPECT_EQ(recommend(measured, 1e-2, 0.0).place, (Place{0, 1}));
  EXPECT_EQ(recommend(measured, 1e-3, 0.0).place, (Place{1, 1}));
  EXPECT_EQ(recommend(measured, 1e-3, 6e-4).place, (Place{0, 3}));  // 5e-4 +- 6e-4 may be 1.1e-3
  EXPECT_EQ(recommend(measured, 1e-4, 0.0).place, (Place{0, 3}));
  EXPECT_TRUE(recommend(measured, 1e-4, 0.0).met);
  const Recommendation none = recommend(measured, 1e-5, 0.0);
  EXPECT_FALSE(none.met);
  EXPECT_EQ(none.place, (Place{0, 3}));
  EXPECT_NE(none.words.find("no setting measured"), std::string::npos);
  EXPECT_NE(recommend(measured, 1e-3, 2e-4).words.find("cannot be told"), std::string::npos);
  EXPECT_FALSE(recommend({made_up({kNaN}, {kNaN})}, 1.0, 0.0).place);
}

TEST(Accuracy, FrontHoldsWhatNothingBeats) {
  std::vector<MeasuredFamily> measured = {made_up({1e-1, 1e-2, 1e-3, 1e-4}, {1, 2, 4, 8}),
                                          made_up({kNaN, 5e-4, 2e-4}, {kNaN, 3, 9})};
  const std::vector<Place> front = {{0, 0}, {0, 1}, {1, 1}, {0, 3}};
  EXPECT_EQ(pareto_front(measured), front);
  measured[1].same_as = "made up";
  EXPECT_EQ(pareto_front(measured).size(), 4u);
  EXPECT_EQ(pareto_front(measured)[2], (Place{0, 2}));
}

/// A fake engine with a given position error, a synthetic cost and an optional failure.
class MadeUpAdapter : public EngineAdapter {
 public:
  MadeUpAdapter(double off, bool fails) : off_(off), fails_(fails) {}
  Passage advance(const State& start, double duration) override {
    Passage out{start, 0.0, 1, {}};
    out.end.q[0] += start.v[0] * duration + off_;
    // One warm-up piece, then rounds of two pieces that cost 1, 2 and 3 s per simulated second.
    out.seconds = duration * static_cast<double>((1 + calls_++) / 2);
    if (fails_ && calls_ == 2) out.failure = "made up to fail";
    return out;
  }

 private:
  double off_;
  bool fails_;
  int calls_ = 0;
};

TEST(Accuracy, MeasuresAnyEngine) {
  Scene scene = test::box_on_plane({.ground = false});
  const Plan plan = plan_pieces(scene.options, 2, 0.1);
  Reference reference;
  for (const double start : plan.starts) {
    State from{start, scene.q, scene.v}, to = from;
    from.v[0] = 1.0;
    to.q[0] += 0.1;
    reference.pieces.push_back({from, to});
  }
  const auto family = [](const std::string& name, auto make) {
    return Family{"peer", name, "effort", {{name, 1.0, "", make}}};
  };
  const auto measured = measure(
      scene, plan, reference,
      {family("off", [] { return std::make_unique<MadeUpAdapter>(0.6, false); }),
       family("fails", [] { return std::make_unique<MadeUpAdapter>(0.0, true); }),
       family("refuses",
              []() -> std::unique_ptr<EngineAdapter> { throw InputError("it knows no boxes"); })},
      {.repeats = 3, .physics = true, .contacts = false});
  ASSERT_EQ(measured.size(), 3u);
  EXPECT_NEAR(measured[0].points[0].error.all, 0.6 / std::sqrt(6.0), 1e-12);
  EXPECT_NEAR(measured[0].points[0].cost, 2.0, 1e-12);  // the median of 1, 2, 3
  EXPECT_NEAR(measured[0].points[0].cost_high, 3.0, 1e-12);
  EXPECT_EQ(measured[1].points[0].failed, 1);
  EXPECT_EQ(measured[1].points[0].failure, "made up to fail");
  EXPECT_TRUE(std::isnan(measured[1].points[0].error.all));
  EXPECT_EQ(measured[2].refused, "it knows no boxes");
  EXPECT_TRUE(measured[2].points.empty());
}

TEST(Accuracy, PiecesFitTheMotionAndItsSteps) {
  SimulationOptions options;  // 2 ms, 2 s
  Plan plan = plan_pieces(options, 10, 0.0);
  EXPECT_NEAR(plan.length, 0.192,
              1e-15);  // 96 steps, the largest multiple of 16 that fits into 100
  EXPECT_EQ(plan.doublings, 5);
  EXPECT_NEAR(plan.starts[3], 0.6, 1e-15);
  plan = plan_pieces(options, 10, 0.1);
  EXPECT_NEAR(plan.length, 0.1, 1e-15);
  EXPECT_EQ(plan.doublings, 1);  // 50 steps
  EXPECT_THROW(plan_pieces(options, 10, 0.3), InputError);
  EXPECT_THROW(plan_pieces(options, 10, 0.0013), InputError);
  EXPECT_THROW(plan_pieces(options, 2000, 0.0), InputError);
}

}  // namespace
}  // namespace counterpoint::apps::accuracy::recommendation_test
