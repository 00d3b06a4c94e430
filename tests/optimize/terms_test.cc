// Derivatives of every cost term: the gradient of the cost against its central differences.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/newton/newton.h"
#include "counterpoint/engine/optimize/reference.h"
#include "counterpoint/engine/optimize/terms/kinematic_terms.h"
#include "support/paths.h"
#include "support/random_model.h"

namespace counterpoint::optimization::terms_test {
namespace {

/// Differences of a cost of order one over 2e-6 have a round-off of 1e-10 times the stiffness of
/// the term. Relative to the largest entry of the gradient.
constexpr double kStep = 1e-6, kTolerance = 1e-6;

struct Start {
  Problem problem;
  std::vector<VectorX> frames;
};

/// Frames of a model near each other.
Start start_of(const Model& model, const SimulationOptions& options, int steps, bool periodic) {
  Start start;
  start.problem.model = &model;
  start.problem.options = options;
  start.problem.options.time_step = 0.05;
  start.problem.steps = steps;
  start.problem.periodic = periodic;
  start.problem.motors = motors_of(model);
  VectorX q = model.default_q();
  for (int t = 0; t <= steps; ++t) {
    integrate_configuration(
        model, q, test::random_vector(model.nv(), static_cast<std::uint64_t>(t + 1)), 0.05, q);
    start.frames.push_back(q);
  }
  start.problem.start_q = start.frames[0];
  start.problem.start_v = VectorX::Zero(model.nv());
  return start;
}

Term term_of(const Model& model, Quantity quantity, std::uint64_t seed) {
  Term term;
  term.quantity = quantity;
  term.name = quantity_name(quantity);
  const int rows = rows_of(model, quantity);
  term.weight = test::random_vector(rows, seed).cwiseAbs();
  if (quantity == Quantity::kAppliedForce || quantity == Quantity::kUnactuatedForce ||
      quantity == Quantity::kContactForce)
    term.weight *= 0.01;
  term.target = test::random_vector(rows, seed + 1);
  if (quantity == Quantity::kConfiguration) term.target = model.default_q();
  if (quantity == Quantity::kClearance) term.target.setConstant(100.0);
  term.body = model.num_bodies() - 1;
  term.point = Vector3(0.1, -0.2, 0.05);
  term.axis = Vector3(0.6, 0.0, 0.8);
  term.radius = -2.0;  // heights are positive, so sliding and tilt fade
  term.length = quantity == Quantity::kJointLimits ? 10.0 : 2.0;
  return term;
}

/// Gives each frame a target of its own.
void set_random_targets(const Start& start, Term& term) {
  const Model& model = *start.problem.model;
  for (int t = 0; t <= start.problem.steps; ++t) {
    const auto seed = static_cast<std::uint64_t>(100 + t);
    term.targets.push_back(test::random_vector(target_size(model, term.quantity), seed));
    if (term.quantity == Quantity::kOrientation) term.targets.back().normalize();
    if (term.quantity == Quantity::kConfiguration)
      term.targets.back() = start.frames[static_cast<std::size_t>(5 - t)];
    if (term.quantity == Quantity::kClearance) term.targets.back().array() += 100.0;
  }
}

/// Checks the derivatives by log h, with the duration free. Multipliers shift the residuals of
/// conditions: a shift by dr/ds changes J'r by J' dr/ds.
void expect_time_derivatives(Start start, const Stage& stage, const std::string& what) {
  start.problem.duration = {1e-3, 1e3};
  for (Term& term : start.problem.terms) {
    term.condition = true;
    if (term.targets.empty() || term.quantity == Quantity::kOrientation) continue;
    term.target = term.targets[0];
    term.targets.clear();
  }
  Newton newton(start.problem, start.frames, 1);
  newton.begin(stage);
  newton.linearize();
  const double found = newton.time_gradient(), found_gram = newton.time_gram();
  const MatrixX gradient = newton.gradient(), border = newton.border();
  const Variables kept = newton.frames().variables();
  const MatrixX nothing = MatrixX::Zero(gradient.rows(), gradient.cols());
  constexpr double kTimeStep = 1e-5;
  double cost[2];
  std::vector<VectorX> change = newton.multipliers();
  for (const int side : {0, 1}) {
    newton.frames().set_variables(kept);
    newton.frames().move(nothing, side == 0 ? -kTimeStep : kTimeStep);
    newton.begin(stage);
    cost[side] = newton.cost();
    for (std::size_t t = 0; t < change.size(); ++t)
      change[t] += (side == 0 ? -0.5 : 0.5) / kTimeStep * newton.values()[t].violation;
  }
  newton.frames().set_variables(kept);
  newton.set_multipliers(change);
  newton.linearize();
  const double expected = (cost[1] - cost[0]) / (2.0 * kTimeStep);
  const double scale = std::max(1.0, std::abs(expected));
  EXPECT_NEAR(found, expected, kTolerance * scale) << what;
  EXPECT_NEAR(found_gram, newton.time_gradient() - found, kTolerance * std::max(1.0, found_gram))
      << what;
  const MatrixX expected_border = newton.gradient() - gradient;
  EXPECT_LT((border - expected_border).cwiseAbs().maxCoeff(),
            kTolerance * std::max(1.0, expected_border.cwiseAbs().maxCoeff()))
      << what;
}

double cost_of(const Start& start, const Stage& stage, const MatrixX& step) {
  Newton newton(start.problem, start.frames, 1);
  newton.frames().move(step);
  newton.begin(stage);
  return newton.cost();
}

void expect_gradient(const Start& start, const Stage& stage, const std::string& what) {
  Newton newton(start.problem, start.frames, 1);
  newton.begin(stage);
  newton.linearize();
  const MatrixX& found = newton.gradient();
  MatrixX expected(found.rows(), found.cols()), step = MatrixX::Zero(found.rows(), found.cols());
  for (Eigen::Index k = 0; k < step.size(); ++k) {
    step(k) = kStep;
    const double high = cost_of(start, stage, step);
    step(k) = -kStep;
    const double low = cost_of(start, stage, step);
    step(k) = 0.0;
    expected(k) = (high - low) / (2.0 * kStep);
  }
  const double scale = expected.cwiseAbs().maxCoeff();
  EXPECT_GT(scale, 0.0) << what;
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), kTolerance * std::max(scale, 1.0)) << what;
  expect_time_derivatives(start, stage, what);
}

TEST(Terms, GradientsOfEveryQuantityOnARandomTree) {
  test::RandomModelOptions shape;
  shape.links = 5;
  shape.fixed_share = 0.0;
  const Model model = test::make_random_model(4, shape);
  SimulationOptions options;
  options.mean_velocity_forces = false;
  for (const auto& [periodic, free_start] :
       {std::pair(false, false), {true, false}, {false, true}}) {
    for (int q = 0; q <= static_cast<int>(Quantity::kContactForce); ++q) {
      const auto quantity = static_cast<Quantity>(q);
      // This tree has no limits, and touches nothing.
      if (quantity == Quantity::kContactForce || quantity == Quantity::kJointLimits ||
          quantity == Quantity::kEffortLimits)
        continue;
      Start start = start_of(model, options, 5, periodic);
      start.problem.terms = {term_of(model, quantity, 11)};
      start.problem.terms[0].condition = q % 2 == 0;
      start.problem.free_start = free_start;
      if (free_start && may_follow(quantity)) set_random_targets(start, start.problem.terms[0]);
      Stage stage;
      stage.options = start.problem.options;
      stage.penalty = 3.0;
      expect_gradient(start, stage, quantity_name(quantity));
    }
  }
}

TEST(Terms, GradientsThroughContactAndItsMirror) {
  const std::filesystem::path scenes =
      std::filesystem::path(test::source_dir()) / "data/scenes/optimize/scenes";
  const Scene scene = load_scene(scenes / "humanoid.yaml");
  const Model& model = scene.model;
  Start start;
  start.problem.model = &model;
  start.problem.options = scene.options;
  start.problem.options.time_step = 0.03;
  start.problem.options.contact.smoothing = 1e-2;
  start.problem.options.contact.compliance = 0.1;
  start.problem.steps = 4;
  start.problem.periodic = true;
  start.problem.displacement = Vector3(0.1, 0, 0);
  start.problem.mirror = make_mirror(model, "left_", "right_");
  start.problem.motors = motors_of(model);
  VectorX q = scene.q;
  q[2] = 0.83;
  for (int t = 0; t <= 4; ++t) {
    VectorX frame = q;
    frame[0] = 0.025 * t;
    integrate_configuration(
        model, frame, test::random_vector(model.nv(), static_cast<std::uint64_t>(t)), 0.02, frame);
    start.frames.push_back(frame);
  }
  Stage stage;
  stage.options = start.problem.options;
  stage.options.effects.set(Effect::kLimits, false);
  for (const Quantity quantity : {Quantity::kAppliedForce, Quantity::kEffortLimits}) {
    start.problem.terms = {unactuated_condition(model, start.problem.motors),
                           term_of(model, quantity, 3)};
    expect_gradient(start, stage, quantity_name(quantity));
  }
  Term force = term_of(model, Quantity::kContactForce, 5);
  for (const char* foot : {"left_foot", "right_foot"}) {
    force.body = model.frames()[static_cast<std::size_t>(model.find_frame(foot))].body;
    start.problem.terms = {force};
    expect_gradient(start, stage, foot);
  }
}

// A rolling ball does not slide although its centre moves; without rotation it slides at that
// speed.
TEST(Terms, RollingIsNoSliding) {
  const std::filesystem::path scenes =
      std::filesystem::path(test::source_dir()) / "data/scenes/optimize/scenes";
  const Scene scene = load_scene(scenes / "roll_ball.yaml");
  const Model& model = scene.model;
  Term term;
  term.quantity = Quantity::kSliding;
  term.body = model.num_bodies() - 1;
  ASSERT_EQ(model.joint(term.body - 1).link, "ball/body");
  term.radius = 0.1;
  term.length = 10.0;  // fading with height is weak
  const double h = 0.01, way = 1e-3;
  const int first = model.body(term.body).v_index;
  KinematicScratch scratch(model);
  Data before(model), at(model);
  compute_poses(model, scene.q, before);
  for (const bool rolls : {false, true}) {
    VectorX change = VectorX::Zero(model.nv()), q = scene.q, value(2);
    change[first] = way;
    if (rolls) change[first + 4] = way / term.radius;
    integrate_configuration(model, scene.q, change, 1.0, q);
    compute_poses(model, q, at);
    evaluate_kinematic({model, h, before, at}, term, scratch, {value});
    // A rotation by 0.01 rad leaves a sixth of its cube. The value at height 0 fades by at most
    // 0.12 at a length of 10 m.
    EXPECT_NEAR(value[0], rolls ? 0.0 : way / h, rolls ? 1e-5 : 0.13 * way / h) << rolls;
  }
}

// A finger pushes a box over the floor: near the floor, in contact and sliding fast.
TEST(Terms, ContactForceOfABoxThatAFingerPushes) {
  const std::filesystem::path scenes =
      std::filesystem::path(test::source_dir()) / "data/scenes/optimize/scenes";
  const Scene scene = load_scene(scenes / "push_box.yaml");
  const Model& model = scene.model;
  for (const double slide : {0.0, 0.02}) {
    for (const double height : {-1e-3, 0.0, 5e-3}) {
      Start start = start_of(model, scene.options, 4, false);
      start.problem.options.contact.smoothing = 1e-2;
      start.problem.options.contact.compliance = 0.1;
      Term term = term_of(model, Quantity::kContactForce, 5);
      term.body = model.frames()[static_cast<std::size_t>(model.find_frame("box/body"))].body;
      const Body& box = model.body(term.body);
      for (std::size_t t = 0; t < start.frames.size(); ++t) {
        start.frames[t] = scene.q;
        VectorX change = test::random_vector(model.nv(), 30 + t, 2e-3);
        change[box.v_index] += slide * static_cast<double>(t);
        change[box.v_index + 2] += height;
        integrate_configuration(model, start.frames[t], change, 1.0, start.frames[t]);
      }
      start.problem.terms = {term};
      Stage stage;
      stage.options = start.problem.options;
      expect_gradient(start, stage, std::to_string(slide) + " " + std::to_string(height));
    }
  }
}

// Damping by contacts is the sum of squared relative changes of normal forces with the next frame.
TEST(Terms, ContactDampingIsTheRelativeChangeOfForces) {
  const std::filesystem::path scenes =
      std::filesystem::path(test::source_dir()) / "data/scenes/control/scenes";
  const Scene scene = load_scene(scenes / "push_box.yaml");
  const Model& model = scene.model;
  Start start = start_of(model, scene.options, 4, false);
  for (std::size_t t = 0; t < start.frames.size(); ++t) {
    start.frames[t] = scene.q;
    start.frames[t][2] += 0.5;    // the finger is far above the floor
    start.frames[t][5] += 0.002;  // the gap of the box
    integrate_configuration(model, start.frames[t], test::random_vector(model.nv(), t), 1e-4,
                            start.frames[t]);
  }
  start.problem.terms = {unactuated_condition(model, start.problem.motors)};
  Stage stage;
  stage.options = start.problem.options;
  stage.options.contact.smoothing = 1e-3;
  stage.options.contact.compliance = 1e-6;
  stage.penalty = 30.0;
  stage.contact_damping = 5.0;
  const Layout layout(start.problem);
  const Frames frames(start.problem, start.frames);
  Evaluator evaluator(start.problem);
  InstantValues values;
  NormalEquations normal;
  evaluator.evaluate(layout, frames, stage, 2, VectorX::Zero(layout.rows(2)), values, &normal);

  const double h = start.problem.h(), step = 1e-6;
  VectorX v(model.nv()), w(model.nv());
  configuration_difference(model, frames.at(1), frames.at(2), v);
  configuration_difference(model, frames.at(2), frames.at(3), w);
  Workspace workspace(model);
  const auto inverse_at = [&](Eigen::Index j, double change) {
    VectorX w_changed = w / h;
    w_changed[j] += change;
    Inverse inverse;
    step_inverse(model, stage.options, frames.at(2), v / h, w_changed, workspace, inverse);
    return inverse.contacts;
  };
  const std::size_t contacts = inverse_at(0, 0.0).size();
  EXPECT_EQ(contacts, 4u);
  MatrixX slopes(contacts, model.nv());
  for (Eigen::Index j = 0; j < model.nv(); ++j) {
    const auto low = inverse_at(j, -step), high = inverse_at(j, step);
    for (std::size_t i = 0; i < contacts; ++i)
      slopes(static_cast<Eigen::Index>(i), j) = std::log(high[i].force.dot(high[i].contact.normal) /
                                                         low[i].force.dot(low[i].contact.normal)) /
                                                (2.0 * step * h);
  }
  const MatrixX expected = stage.contact_damping * stage.penalty * slopes.transpose() * slopes;
  // The compliance changes slopes by 2 k r / y^2, 1e-5.
  EXPECT_LT((normal.metric - expected).cwiseAbs().maxCoeff(),
            1e-4 * expected.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace counterpoint::optimization::terms_test
