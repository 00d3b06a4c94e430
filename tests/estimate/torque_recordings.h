// Recordings of arms with the forces of their joints, and fits of these.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "counterpoint/engine/estimate/torque_fit.h"
#include "counterpoint/engine/step.h"
#include "support/paths.h"

namespace counterpoint::estimation::torque_recordings {

inline Scene scene_of(const std::string& name) {
  Scene scene = load_scene(test::source_dir() + "/data/scenes/" + name);
  for (const Effect effect : {Effect::kContacts, Effect::kLimits})
    scene.options.effects.set(effect, false);
  return scene;
}

/// A recording of joints that go through q (nv x rows + 2; the first column comes before the first
/// row), h [s] apart, with the forces of the scene.
inline Recording recorded(const Scene& scene, const MatrixX& q, double h) {
  const Model& model = scene.model;
  const Eigen::Index rows = q.cols() - 2;
  Recording out;
  out.file = "recorded";
  out.q = q.middleCols(1, rows);
  const MatrixX v = (q.rightCols(rows + 1) - q.leftCols(rows + 1)) / h;
  out.v = v.leftCols(rows);
  out.applied_force.resize(model.nv(), rows);
  SimulationOptions options = scene.options;
  options.time_step = h;
  Workspace workspace(model);
  Inverse inverse;
  for (Eigen::Index row = 0; row < rows; ++row) {
    out.time.push_back(static_cast<double>(row) * h);
    step_inverse(model, options, out.q.col(row), v.col(row), v.col(row + 1), workspace, inverse);
    out.applied_force.col(row) = inverse.applied_force;
  }
  return out;
}

/// A recording of sums of sines, `seconds` [s] long.
inline Recording moved(const Scene& scene, double seconds, double h, double amplitude,
                       unsigned seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  MatrixX q = MatrixX::Zero(scene.model.nv(), std::lround(seconds / h) + 2);
  for (auto joint : q.rowwise())
    for (int k = 1; k <= 5; ++k) {
      const double share = uniform(generator) / k, phase = std::numbers::pi * uniform(generator);
      for (Eigen::Index i = 0; i < q.cols(); ++i)
        joint[i] += amplitude * share *
                    std::sin(0.2 * std::numbers::pi * k * h * static_cast<double>(i - 1) + phase);
    }
  return recorded(scene, q, h);
}

/// Maps positions and forces of all joints; velocities are differences.
inline ColumnMap map_of(const Model& model) {
  ColumnMap map;
  for (int i = 0; i < model.nv(); ++i) {
    map.entries.push_back({ColumnMap::Entry::Kind::kPosition, i, "q", {}});
    map.entries.push_back({ColumnMap::Entry::Kind::kForce, i, "u", {}});
  }
  return map;
}

inline void add_noise(double position, double force, unsigned seed, Recording& recording) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  for (double& x : recording.q.reshaped()) x += position * normal(generator);
  for (double& x : recording.applied_force.reshaped()) x += force * normal(generator);
}

inline TorqueFit fitted(const Scene& scene, const ColumnMap& map, const Recording& recording,
                        const std::string& parameters, const TorqueFitOptions& options) {
  return fit_torques(scene, map, {&recording}, parse_parameters(parameters, scene), options);
}

/// Filters of this cutoff leave rows of 2 ms as they are.
inline constexpr double kUnfiltered = 120.0;

}  // namespace counterpoint::estimation::torque_recordings
