#include "counterpoint/engine/estimate/motion/motion_priors.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/estimate/motion/motion_continuation.h"
#include "counterpoint/engine/estimate/sensors/motion_filter.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

/// Margin of the contact search [m], unless the scene's is larger.
constexpr double kMargin = 0.05;
/// Motor forces as a fraction of weight times radius of gyration, for rows 10 ms apart; and their
/// change in 10 ms as a fraction of that.
constexpr double kForce = 0.12, kChange = 0.15;
/// Unexplained forces [weights of the tree].
constexpr double kUnexplainedWhite = 0.03, kUnexplainedSlow = 0.02;
/// Smoothing of the contact law for white errors, in standard deviations of the positions: at the
/// end, and at two starts, of which the one with the lower final cost is kept.
constexpr double kSmoothingEnd = 0.1, kNearStart = 3.0, kFarStart = 10.0;
/// Slow errors, such as of markers on skin: standard deviation of positions [m, rad]; half-power
/// frequency of the low-pass [Hz]; accelerations of floating links [m/s^2], [rad/s^2] and of joints
/// [rad/s^2].
constexpr double kSlowPosition = 0.02, kCutoff = 6.0;
constexpr double kSlowLinear = 0.1, kSlowAngular = 3.0, kSlowJoint = 10.0;
/// Scale of the robust loss of accelerations and positions [standard deviations]: slow errors jump
/// now and then.
constexpr double kLossScale = 3.0;
/// Smoothing for slow errors [m]; its end is the uncertainty of soles and their positions.
constexpr double kSlowStart = 0.03, kSlowEnd = 0.01;
/// Position of world-touching geometries in their links, and its drift as soles give way [m]. A
/// geometry is uncertain if it is nearer than `kNear` [m] in more than a fraction `kOften` of the
/// rows.
constexpr double kPlace = 0.01, kPlaceDrift = 0.008, kNear = 0.03, kOften = 0.1;

/// Options of the estimated steps: all forces of a step at one instant, a contact search wide
/// enough for recording errors, and laws that depend on this step only.
SimulationOptions estimate_options(const Scene& scene, double h) {
  SimulationOptions options = scene.options;
  options.time_step = h;
  options.integrator = Integrator::kSemiImplicitEuler;
  options.mean_velocity_forces = false;
  options.contact.margin = std::max(options.contact.margin, kMargin);
  options.contact.reach_acceleration = 1e9;
  options.contact.slip_time = 1e9;
  options.effects.set(Effect::kSleeping, false);
  // A row interval with a bounce has a mean velocity that no restitution law allows.
  options.effects.set(Effect::kRestitution, false);
  return options;
}

/// Total weight times radius of gyration at a configuration [N m].
double weight_times_gyration(const Model& model, const VectorX& q) {
  Data data(model);
  compute_poses(model, q, data);
  double mass = 0.0, second = 0.0;
  Vector3 first = Vector3::Zero();
  for (int i = 1; i < model.num_bodies(); ++i) {
    const SpatialInertia& inertia = model.body(i).inertia;
    const Vector3 center = data.X_WB[static_cast<std::size_t>(i)] * inertia.center;
    mass += inertia.mass;
    first += inertia.mass * center;
    second += inertia.mass * center.squaredNorm();
    second += 0.5 * inertia.rotational.trace();
  }
  if (mass <= 0.0) return 0.0;
  const double variance = second / mass - (first / mass).squaredNorm();
  return optimization::scene_weight(model) * std::sqrt(std::max(variance, 0.0));
}

VectorX where_recorded(const VectorX& deviation, const RecordedMotion& recorded) {
  VectorX out = deviation;
  for (int i = 0; i < out.size(); ++i)
    if (recorded.measured.row(i).maxCoeff() == 0.0) out[i] = kInfinity;
  return out;
}

/// Priors that both kinds of errors have in common.
MotionPriors common_priors(const Scene& scene, const ColumnMap& map,
                           const RecordedMotion& recorded) {
  const int nv = scene.model.nv();
  MotionPriors priors;
  priors.acceleration = VectorX::Constant(nv, kInfinity);
  priors.force = given(map.force_deviation, nv);
  const double force = kForce * weight_times_gyration(scene.model, recorded.frames.front());
  priors.size = VectorX::Constant(nv, force * std::sqrt(0.01 / recorded.h()));
  priors.change = VectorX::Constant(nv, kChange * force * std::sqrt(recorded.h() / 0.01));
  return priors;
}

/// Geometries that are often near the world.
std::vector<UnsureGeometry> unsure_geometries(const MotionProblem& problem,
                                              const std::vector<VectorX>& frames) {
  const Model& model = problem.model;
  const std::size_t count = model.geometries().size();
  std::vector<int> near(count, 0);
  std::vector<Vector3> direction(count, Vector3::Zero());
  const MotionPoint point{frames, VectorX()};
  InstantModel instant(problem, model);
  Data data(model);
  const SimulationOptions options = stage_options(problem, kNear);
  for (int t = 1; t + 1 < problem.frames(); ++t) {
    compute_poses(model, frames[static_cast<std::size_t>(t)], data);
    std::vector<char> seen(count, 0);
    for (const ContactForce& one : instant.invert(point, options, t).contacts) {
      const auto a = static_cast<std::size_t>(one.contact.geometry_a);
      const auto b = static_cast<std::size_t>(one.contact.geometry_b);
      const bool world_a = model.geometries()[a].body == 0;
      if (one.contact.gap > kNear || world_a == (model.geometries()[b].body == 0)) continue;
      const std::size_t moving = world_a ? b : a;
      const Geometry& g = model.geometries()[moving];
      const Matrix3 R = data.X_WB[static_cast<std::size_t>(g.body)].rotation * g.X_BG.rotation;
      direction[moving] += R.transpose() * (world_a ? one.contact.normal : -one.contact.normal);
      near[moving] += seen[moving] != 0 ? 0 : 1;
      seen[moving] = 1;
    }
  }
  std::vector<UnsureGeometry> out;
  for (std::size_t g = 0; g < count; ++g)
    if (near[g] > kOften * problem.frames() && direction[g].norm() > 0.0)
      out.push_back({static_cast<int>(g), direction[g].normalized()});
  return out;
}

/// Median standard deviation of the recorded coordinates.
double typical(const VectorX& deviation) {
  std::vector<double> finite;
  for (const double d : deviation)
    if (std::isfinite(d)) finite.push_back(d);
  return median(finite);
}

/// Removes the priors on size and change of a joint force that is measured.
void measured(int coordinate, MotionProblem& problem) {
  problem.size_weight[coordinate] = problem.change_weight[coordinate] = 0.0;
}

}  // namespace

MotionPriors white_priors(const Scene& scene, const ColumnMap& map,
                          const RecordedMotion& recorded) {
  MotionPriors priors = common_priors(scene, map, recorded);
  priors.position = where_recorded(recorded.noise, recorded);
  priors.unexplained = kUnexplainedWhite;
  double noise = typical(priors.position);
  for (const SensorTerm& term : recorded.sensors.terms)  // points determine where contacts are
    if (term.sensor.kind == SensorKind::kPoint) noise = std::min(noise, 1.0 / term.weight);
  for (int i = 0; i < recorded.by_sensors.size(); ++i)  // these sensors are measurements of their
                                                        // own
    if (recorded.by_sensors[i] != 0.0) priors.position[i] = kInfinity;
  priors.smoothing_starts = {kNearStart * noise, kFarStart * noise};
  priors.smoothing_end = kSmoothingEnd * noise;
  return priors;
}

MotionPriors slow_priors(const Scene& scene, const ColumnMap& map, const RecordedMotion& recorded) {
  const Model& model = scene.model;
  MotionPriors priors = common_priors(scene, map, recorded);
  priors.position = where_recorded(VectorX::Constant(model.nv(), kSlowPosition), recorded);
  const VectorX known = given(map.position_deviation, model.nv());
  for (int i = 0; i < model.nv(); ++i)
    if (std::isfinite(known[i])) priors.position[i] = known[i];
  priors.cutoff = kCutoff;
  priors.loss_scale = kLossScale;
  priors.acceleration.setConstant(kSlowJoint);
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    if (body.joint_type != JointType::kFloating) continue;
    priors.acceleration.segment<3>(body.v_index).setConstant(kSlowLinear);
    priors.acceleration.segment<3>(body.v_index + 3).setConstant(kSlowAngular);
  }
  priors.acceleration = where_recorded(priors.acceleration, recorded);
  priors.unexplained = kUnexplainedSlow;
  priors.smoothing_starts = {kSlowStart};
  priors.smoothing_end = kSlowEnd;
  priors.place = kPlace;
  priors.place_drift = kPlaceDrift;
  const MotionProblem problem = motion_problem(scene, recorded, priors);
  priors.geometries =
      unsure_geometries(problem, low_pass(model, recorded.frames, recorded.h(), priors.cutoff));
  return priors;
}

MotionProblem motion_problem(const Scene& scene, const RecordedMotion& recorded,
                             const MotionPriors& priors) {
  const Model& model = scene.model;
  const int nv = model.nv(), rows = recorded.rows();
  const double h = recorded.h();
  MotionProblem problem{.model = model, .options = estimate_options(scene, h)};
  problem.measured = recorded.frames;
  problem.position_weight = priors.position.cwiseInverse().asDiagonal() * recorded.measured;
  problem.acceleration = MatrixX::Zero(nv, rows);
  problem.acceleration_weight = priors.acceleration.cwiseInverse();
  if (priors.cutoff > 0.0)
    problem.acceleration =
        accelerations(model, low_pass(model, recorded.frames, h, priors.cutoff), h);
  problem.loss_scale = priors.loss_scale;
  problem.force = recorded.force;
  problem.force_weight = priors.force.cwiseInverse();
  const std::vector<char> motors = optimization::motors_of(model);
  problem.size_weight = optimization::unactuated_weights(model, motors) / priors.unexplained;
  problem.change_weight = VectorX::Zero(nv);
  for (int i = 0; i < nv; ++i) {
    if (!motors[static_cast<std::size_t>(i)]) continue;
    problem.size_weight[i] = 1.0 / priors.size[i];
    problem.change_weight[i] = 1.0 / priors.change[i];
    if (problem.force_weight[i] > 0.0) measured(i, problem);
  }
  for (const UnsureGeometry& unsure : priors.geometries) {
    StepParameter& parameter = problem.parameters.emplace_back();
    parameter.kind = StepParameterKind::kHeight;
    parameter.targets = {unsure.geometry};
    parameter.directions = {unsure.direction};
  }
  problem.parameter_drift = priors.place_drift;
  const SensorTerms sensors =
      priors.cutoff > 0.0 ? without_positions(recorded.sensors) : recorded.sensors;
  problem.start = recorded.time.front();
  problem.sensors = sensors.terms;
  problem.sensor_loss_scale = kLossScale;
  problem.constants = sensors.constants;
  for (const SensorTerm& term : problem.sensors)
    if (term.sensor.kind == SensorKind::kJointForce) measured(term.sensor.coordinate, problem);
  problem.parameter_weight = VectorX::Constant(problem.num_parameters(), 1.0 / priors.place);
  for (std::size_t k = 0; k < problem.constants.size(); ++k)
    problem.parameter_weight[static_cast<Eigen::Index>(problem.parameters.size() + k)] =
        1.0 / problem.constants[k].deviation;
  return problem;
}

}  // namespace counterpoint::estimation
