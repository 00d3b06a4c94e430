#include "counterpoint/engine/estimate/motion/motion_priors.h"

#include <cmath>
#include <cstdlib>
#include <cstdio>
#include <map>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/estimate/motion/motion_filter.h"
#include "counterpoint/engine/estimate/motion/variance_components.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

/// Contacts are looked for up to this gap [m], if the scene's margin is not larger.
constexpr double kMargin = 0.05;
/// A geometry is unsure that is near the world in more than this share of the frames.
constexpr double kOften = 0.1;

VectorX inverse(const VectorX& deviation) { return deviation.cwiseInverse(); }

/// Steps as an estimate does them: all forces of a step at one instant, contacts looked for as far
/// as they may be wrong, and laws that depend on nothing but the step.
SimulationOptions estimate_options(const Scene& scene, double h) {
  SimulationOptions options = scene.options;
  options.time_step = h;
  options.integrator = Integrator::kSemiImplicitEuler;
  options.mean_velocity_forces = false;
  options.contact.margin = std::max(options.contact.margin, kMargin);
  options.contact.reach_acceleration = 1e9;
  options.contact.slip_time = 1e9;
  options.effects.set(Effect::kSleeping, false);
  return options;
}

double env(const char* name, double otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::atof(text) : otherwise;
}

}  // namespace

MotionPriors choose_priors(const Scene& scene, const Recording& recording,
                           const std::vector<char>& recorded) {
  const Model& model = scene.model;
  const int nv = model.nv();
  std::vector<VectorX> frames;
  for (int t = 0; t < recording.num_rows(); ++t) frames.push_back(recording.q.col(t));
  MotionPriors priors;
  const VectorX white = white_noise(model, frames);
  priors.position = VectorX::Constant(nv, env("SP", 0.02));
  if (env("SP", 0.02) <= 0) priors.position = white;
  for (int i = 0; i < nv; ++i)
    if (!recorded[static_cast<std::size_t>(i)]) priors.position[i] = kInfinity;
  priors.cutoff = env("ACCT", 6.0);
  priors.acceleration = VectorX::Constant(nv, env("SAJ", 10.0));
  for (int b = 1; b < model.num_bodies(); ++b) {
    if (model.body(b).joint_type != JointType::kFloating) continue;
    priors.acceleration.segment<3>(model.body(b).v_index).setConstant(env("SAL", 0.1));
    priors.acceleration.segment<3>(model.body(b).v_index + 3).setConstant(env("SAR", 3.0));
  }
  priors.force = VectorX::Constant(nv, kInfinity);
  priors.unexplained = env("US", 0.02);
  priors.size = VectorX::Constant(nv, env("TQ", 0) > 0 ? env("TQ", 0) : kInfinity);
  priors.change = VectorX::Constant(nv, env("DU", 10.0));
  priors.place = env("PLACE", 0.02);
  priors.smoothing_start = env("S0", 3e-2);
  priors.smoothing_end = env("S1", 1e-2);
  if (priors.place > 0) {
    MotionProblem problem = motion_problem(scene, recording, priors);
    priors.geometries = unsure_geometries(problem, low_pass(model, frames, problem.h(), 6.0), 0.03);
  }
  return priors;
}

void update_priors(const Model& model, const MotionProblem& problem, MotionFit& fit,
                   MotionPriors& priors) {
  const VarianceComponents found = variance_components(problem, fit);
  const int what = static_cast<int>(env("WHAT", 15));
  std::map<int, std::vector<int>> groups;
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    for (int k = 0; k < joint_nv(body.joint_type); ++k) {
      const bool linear = k < joint_num_linear(body.joint_type);
      const int key = joint_nv(body.joint_type) > 1 ? 2 * b + linear : linear ? 1 : 0;
      groups[key].push_back(body.v_index + k);
    }
  }
  const bool verbose = std::getenv("VERB") != nullptr;
  for (const auto& [key, members] : groups) {
    double position = 0.0, acceleration = 0.0;
    int count = 0;
    for (const int i : members)
      if (problem.position_weight(i, 0) > 0.0) {
        position += found.position[i];
        acceleration += found.acceleration[i];
        ++count;
      }
    if (count == 0) continue;
    for (const int i : members) {
      if (problem.position_weight(i, 0) <= 0.0) continue;
      if (what & 1) priors.position[i] = std::sqrt(position / count);
      if (what & 2) priors.acceleration[i] = std::sqrt(acceleration / count);
    }
    if (verbose)
      std::fprintf(stderr, "group %d n %d position %.3g acceleration %.3g\n", key, count,
                   std::sqrt(position / count), std::sqrt(acceleration / count));
  }
  const std::vector<char> motors = optimization::motors_of(model);
  for (int i = 0; i < model.nv(); ++i) {
    if (!motors[static_cast<std::size_t>(i)]) continue;
    if (what & 4) priors.size[i] = std::sqrt(found.size[i]);
    if (what & 8) priors.change[i] = std::sqrt(found.change[i]);
    if (verbose) std::fprintf(stderr, "  %d size %.3g change %.3g\n", i, std::sqrt(found.size[i]), std::sqrt(found.change[i]));
  }
}

std::vector<VectorX> start_frames(const MotionProblem& problem, const MotionPriors& priors) {
  const Model& model = problem.model;
  const std::vector<VectorX> clean =
      without_spikes(model, problem.measured, 5.0 * priors.position);
  return low_pass(model, clean, problem.h(), priors.cutoff > 0.0 ? priors.cutoff : 10.0);
}

std::vector<char> recorded_coordinates(const Model& model, const ColumnMap& map) {
  std::vector<char> q(static_cast<std::size_t>(model.nq()), 0);
  std::vector<char> out(static_cast<std::size_t>(model.nv()), 0);
  for (const ColumnMap::Entry& entry : map.entries)
    if (entry.kind == ColumnMap::Entry::Kind::kPosition && !entry.source.column.empty())
      q[static_cast<std::size_t>(entry.index)] = 1;
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    const int positions = joint_nq(body.joint_type), velocities = joint_nv(body.joint_type);
    for (int k = 0; k < velocities; ++k) {
      // Of a quaternion, the last four of its joint's positions, any part stands for all.
      const int at = body.q_index + std::min(k, positions - 1);
      out[static_cast<std::size_t>(body.v_index + k)] = q[static_cast<std::size_t>(at)];
    }
  }
  return out;
}

std::vector<UnsureGeometry> unsure_geometries(const MotionProblem& problem,
                                              const std::vector<VectorX>& frames, double reach) {
  const Model& model = problem.model;
  const std::size_t count = model.geometries().size();
  std::vector<int> near(count, 0);
  std::vector<Vector3> direction(count, Vector3::Zero());
  MotionPoint point{frames, VectorX::Zero(static_cast<Eigen::Index>(problem.parameters.size()))};
  InstantModel instant(problem, model);
  Data data(model);
  const SimulationOptions options = stage_options(problem, reach);
  for (int t = 1; t + 1 < problem.frames(); ++t) {
    compute_poses(model, frames[static_cast<std::size_t>(t)], data);
    std::vector<char> seen(count, 0);
    for (const ContactForce& one : instant.invert(point, options, t).contacts) {
      const auto a = static_cast<std::size_t>(one.contact.geometry_a);
      const auto b = static_cast<std::size_t>(one.contact.geometry_b);
      const bool world_a = model.geometries()[a].body == 0;
      if (one.contact.gap > reach || world_a == (model.geometries()[b].body == 0)) continue;
      const std::size_t moving = world_a ? b : a;
      const Geometry& g = model.geometries()[moving];
      const Matrix3 R = data.X_WB[static_cast<std::size_t>(g.body)].rotation * g.X_BG.rotation;
      direction[moving] += R.transpose() * (world_a ? -one.contact.normal : one.contact.normal);
      near[moving] += seen[moving] ? 0 : 1;
      seen[moving] = 1;
    }
  }
  std::vector<UnsureGeometry> out;
  for (std::size_t g = 0; g < count; ++g)
    if (near[g] > kOften * problem.frames() && direction[g].norm() > 0.0)
      out.push_back({static_cast<int>(g), direction[g].normalized()});
  return out;
}

MotionProblem motion_problem(const Scene& scene, const Recording& recording,
                             const MotionPriors& priors) {
  const Model& model = scene.model;
  const int nv = model.nv(), rows = recording.num_rows();
  const double h = (recording.time.back() - recording.time.front()) / (rows - 1);
  MotionProblem problem{model, estimate_options(scene, h), {}, {}, env("OUTL", 3.0), {}, {}, {}, {}, {}, {}, {}, {}};
  for (int t = 0; t < rows; ++t) problem.measured.push_back(recording.q.col(t));
  problem.position_weight = inverse(priors.position).replicate(1, rows);
  problem.acceleration = MatrixX::Zero(nv, rows);
  problem.acceleration_weight = VectorX::Zero(nv);
  if (priors.cutoff > 0.0) {
    problem.acceleration =
        accelerations(model, low_pass(model, problem.measured, h, priors.cutoff), h);
    problem.acceleration_weight = inverse(priors.acceleration);
  }
  problem.force = recording.applied_force;
  problem.force_weight = inverse(priors.force);
  const std::vector<char> motors = optimization::motors_of(model);
  problem.size_weight = optimization::unactuated_weights(model, motors) / priors.unexplained;
  problem.change_weight = VectorX::Zero(nv);
  for (int i = 0; i < nv; ++i) {
    if (!motors[static_cast<std::size_t>(i)]) continue;
    problem.size_weight[i] = 1.0 / priors.size[i];
    problem.change_weight[i] = 1.0 / priors.change[i];
  }
  for (const UnsureGeometry& unsure : priors.geometries) {
    StepParameter& parameter = problem.parameters.emplace_back();
    parameter.kind = StepParameterKind::kHeight;
    parameter.targets = {unsure.geometry};
    parameter.directions = {unsure.direction};
  }
  problem.parameter_weight =
      VectorX::Constant(static_cast<Eigen::Index>(problem.parameters.size()), 1.0 / priors.place);
  return problem;
}

}  // namespace counterpoint::estimation
