// Exact derivatives of the residuals of identification, against differences of the residuals.
#include "counterpoint/engine/estimate/parameters/gradient.h"

#include <gtest/gtest.h>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/model_builder.h"
#include "support/paths.h"

namespace counterpoint::estimation::gradient_test {
namespace {

/// Relative error of extrapolated differences of a whole motion, some hundred steps.
constexpr double kTolerance = 1e-6;

Scene scene_of(const std::string& name) {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/" + name);
  // Smooth enough for differences to cross no kink.
  scene.options.contact.smoothing = 1e-3;
  scene.options.contact.compliance = 1e-2;
  scene.options.effects.set(Effect::kSleeping, false);
  return scene;
}

/// Records all coordinates of the scene's motion, every `substeps` steps.
Experiment experiment_of(const Scene& scene, int rows, int substeps) {
  Experiment e{scene, {}, {}, 1, {}, false, 0.01};
  Simulator simulator(scene);
  Recording recording;
  recording.q.resize(scene.model.nq(), rows);
  recording.v.resize(scene.model.nv(), rows);
  recording.applied_force = MatrixX::Zero(scene.model.nv(), rows);
  for (int row = 0; row < rows; ++row) {
    recording.time.push_back(simulator.state().time);
    recording.q.col(row) = simulator.state().q;
    recording.v.col(row) = simulator.state().v;
    for (int k = 0; k < substeps; ++k) EXPECT_TRUE(simulator.step().succeeded());
  }
  e.recordings.push_back(recording);
  e.prediction.substeps = substeps;
  e.prediction.scene_step = scene.options.time_step;
  return e;
}

/// Maps all joints' positions and (known) forces.
void map_joints(Experiment& e) {
  for (int i = 0; i < e.scene.model.nv(); ++i) {
    e.map.entries.push_back({ColumnMap::Entry::Kind::kPosition, i, "q", {}});
    e.map.entries.push_back({ColumnMap::Entry::Kind::kForce, i, "u", {}});
  }
}

void expect_exact(const Experiment& e, const std::string& names, double change, bool by_force) {
  const std::vector<Parameter> parameters = parse_parameters(names, e.scene);
  const std::vector<int> which{0};
  // Away from the recorded motion, where the norm of the deviation is not differentiable.
  const VectorX at = parameter_values(parameters, e.scene).cwiseMax(0.1) * (1.0 + change);
  const std::optional<LinearizedResiduals> exact = linearize(e, parameters, at, which, by_force);
  ASSERT_TRUE(exact);
  const auto residuals = [&](const VectorX& values) {
    return by_force ? force_residuals(e, parameters, values, which)[0]
                    : prediction_residuals(e, parameters, values, which)[0];
  };
  EXPECT_EQ(exact->residuals[0], residuals(at));
  const std::vector<char> known = exact_parameters(e, parameters, by_force);
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    ASSERT_TRUE(known[static_cast<std::size_t>(i)]) << parameters[static_cast<std::size_t>(i)].name;
    const auto moved = [&](double by) {
      VectorX values = at;
      values[i] += by;
      return residuals(values);
    };
    const double step = 1e-4 * std::max(std::abs(at[i]), 1e-2);
    const VectorX near = (moved(step) - moved(-step)) / (2.0 * step);
    const VectorX far = (moved(2.0 * step) - moved(-2.0 * step)) / (4.0 * step);
    const VectorX reference = (4.0 * near - far) / 3.0;
    const VectorX column = exact->jacobians[0].col(i);
    EXPECT_GT(reference.lpNorm<Eigen::Infinity>(), 0.0)
        << parameters[static_cast<std::size_t>(i)].name;
    EXPECT_LE((column - reference).lpNorm<Eigen::Infinity>(),
              kTolerance * reference.lpNorm<Eigen::Infinity>())
        << parameters[static_cast<std::size_t>(i)].name;
  }
}

TEST(Gradient, OfForcesOfAnArm) {
  Experiment e = experiment_of(scene_of("double_pendulum.yaml"), 60, 2);
  map_joints(e);
  expect_exact(e, "armature:shoulder,damping:elbow,mass:lower,inertia:upper,gravity", 0.1, true);
  // Each acts on what those before it leave of the inertia.
  expect_exact(e, "com_x:lower,mass:lower,shear_xz:lower,spread_x:lower,com_x:upper", 0.1, true);
}

TEST(Gradient, OfPredictionsOfAnArm) {
  for (const bool by_score : {false, true}) {
    Experiment e = experiment_of(scene_of("double_pendulum.yaml"), 40, 2);
    map_joints(e);
    e.by_score = by_score;
    e.prediction.horizon = 10;
    expect_exact(e, "damping:elbow,mass:lower,inertia:upper,gravity", 0.1, false);
  }
}

TEST(Gradient, OfTiedParameters) {
  const char* tied =
      "mass:upper+lower,inertia:upper+lower,com_x:upper+~lower,spread_x:lower+upper,"
      "damping:elbow+shoulder";
  Experiment e = experiment_of(scene_of("double_pendulum.yaml"), 40, 2);
  map_joints(e);
  expect_exact(e, tied, 0.1, true);
  e.prediction.horizon = 10;
  expect_exact(e, tied, 0.1, false);
}

/// A double pendulum whose joints have friction curves.
Scene with_curves() {
  return with_settings(scene_of("double_pendulum.yaml"),
                       "dry_friction=0.4,breakaway_friction=0.9,stribeck_speed=0.5");
}

TEST(Gradient, OfFrictionCurves) {
  for (const bool by_force : {false, true}) {
    Experiment e = experiment_of(with_curves(), 40, 2);
    map_joints(e);
    e.prediction.horizon = 10;
    expect_exact(e, "dry_friction:elbow,breakaway_friction:shoulder,stribeck_speed", 0.1, by_force);
  }
}

TEST(Gradient, FindsFrictionCurves) {
  Experiment e = experiment_of(with_curves(), 200, 2);
  map_joints(e);
  e.prediction.horizon = 1;  // one step of a row to the next
  e.scene = with_settings(e.scene, "dry_friction=1,breakaway_friction=1,stribeck_speed=0.1");
  const std::vector<Parameter> parameters =
      parse_parameters("dry_friction=0..3,breakaway_friction=0..3,stribeck_speed", e.scene);
  const Fit found = fit(fit_problem(e, parameters, {0}, false), FitOptions());
  // The motion has no noise; the search ends when changes are below 1e-4 of the ranges or so.
  EXPECT_NEAR(found.parameters[0].value, 0.4, 1e-3);
  EXPECT_NEAR(found.parameters[1].value, 0.9, 1e-3);
  EXPECT_NEAR(found.parameters[2].value, 0.5, 1e-3);
}

/// Removes restitution: a bounce also displaces the prediction within its step, and this
/// displacement has no derivative here (bounce.h).
Scene without_restitution(Scene scene) {
  for (int i = 0; i < static_cast<int>(scene.model.geometries().size()); ++i) {
    Material m = scene.model.geometries()[static_cast<std::size_t>(i)].material;
    m.restitution = 0.0;
    ModelEditor one(std::move(scene.model));
    one.set_material(i, m);
    scene.model = one.take();
  }
  return scene;
}

TEST(Gradient, OfPredictionsOfACubeThatIsTossed) {
  for (const bool by_score : {false, true}) {
    Scene scene = without_restitution(scene_of("cube_toss.yaml"));
    scene.q[2] = 0.11;  // near the ground and falling
    scene.v[2] = -0.6;
    Experiment e = experiment_of(scene, 50, 1);
    e.map.free_body = 1;
    e.by_score = by_score;
    e.prediction.horizon = 10;
    expect_exact(e, "friction,inertia,gravity", 0.05, false);
  }
}

TEST(Gradient, IsNotKnownOfSizes) {
  const Experiment e = experiment_of(scene_of("cube_toss.yaml"), 3, 1);
  const std::vector<Parameter> parameters = parse_parameters("friction,size", e.scene);
  EXPECT_EQ(exact_parameters(e, parameters, false), (std::vector<char>{1, 0}));
}

}  // namespace
}  // namespace counterpoint::estimation::gradient_test
