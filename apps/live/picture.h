// The view of a simulation at one time: poses, forces, and the values of the page's curves.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/step.h"
#include "live/inputs/hand.h"
#include "live/protocol.h"
#include "report/total_energy.h"
#include "view/curves.h"

namespace counterpoint::live {

/// Facts beside a state that a frame shows; null: unknown.
struct Shown {
  const Input* input = nullptr;     ///< input of the last step
  const Inverse* forces = nullptr;  ///< forces of the last step, for those of closures
  const State* before = nullptr;    ///< state before the last step; q and v only are read
  int newton_iterations = 0;        ///< Newton steps in the last step
  const Hand* hand = nullptr;
  const VectorX* sensors = nullptr;  ///< values of the last step, by sensor_columns
};

/// Most columns of sensors that have curves.
inline constexpr int kMostSensorCurves = 200;

/// Whether a scene has forces of closures, which Shown::forces gives.
inline bool has_closure_forces(const Model& model, const SimulationOptions& options) {
  return !model.closures().empty() && options.integrator != Integrator::kRungeKutta4;
}

class Picture {
 public:
  /// The model must outlive the picture.
  explicit Picture(const Model& model);

  /// Curves of the page, with their value at the start; frames have values in this order.
  std::vector<view::Curve> curves(const State& start);
  /// Sum of kinetic and potential energy, including springs, in the last frame [J].
  double energy() const { return energy_; }

  /// Returns the frame at a state, valid until the next call.
  const Frame& frame(const State& state, const Shown& shown = {});

 private:
  void add_contacts(const State& state, Frame& out);
  void add_closures(const Inverse& forces, Frame& out);
  void add_curves(const State& state, const Shown& shown, Frame& out);
  void add_coordinates(const State& state, const Input* input, std::vector<double>& out) const;

  const Model& model_;
  const int num_sensor_curves_;
  std::vector<int> frames_;  ///< index of the frame of each body's link; -1 for the world
  Dynamics dynamics_;
  apps::SurfaceSprings surfaces_;
  std::vector<Vector3> world_forces_;  ///< on bodies from the world, in the present frame [N]
  Frame frame_;
  double energy_ = 0.0;
};

/// Adds the flags of joints at a limit.
void add_limits(const Model& model, const VectorX& q, Frame& out);

}  // namespace counterpoint::live
