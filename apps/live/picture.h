// The view of a simulation at one time: poses, forces, and the values of the page's curves.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/step.h"
#include "live/hand.h"
#include "live/protocol.h"
#include "report/total_energy.h"
#include "view/curves.h"

namespace counterpoint::live {

/// Facts beside a state that a frame shows; null: unknown.
struct Shown {
  const Input* input = nullptr;     ///< input of the last step
  const Inverse* forces = nullptr;  ///< forces of the last step
  const State* before = nullptr;    ///< state before the last step; q and v only are read
  int newton_iterations = 0;        ///< Newton steps in the last step
  const Hand* hand = nullptr;
};

class Picture {
 public:
  /// The model must outlive the picture.
  explicit Picture(const Model& model);

  /// Curves of the page, with their value at the start; frames have values in this order.
  std::vector<view::Curve> curves(const State& start);
  /// Sum of kinetic and potential energy, including springs, in the last frame [J].
  double energy() const { return energy_; }

  /// Returns the frame at a state.
  Frame frame(const State& state, const Shown& shown = {});

 private:
  void add_forces(const Inverse& forces, Frame& out);
  void add_curves(const State& state, const Shown& shown, Frame& out);
  void add_coordinates(const State& state, const Input* input, std::vector<double>& out) const;

  const Model& model_;
  Dynamics dynamics_;
  apps::SurfaceSprings surfaces_;
  std::vector<Vector3> world_forces_;  ///< on bodies from the world, in the present frame [N]
  double energy_ = 0.0;
};

/// Poses and joints at limits at a state.
void add_poses(const Model& model, const VectorX& q, Frame& out);

}  // namespace counterpoint::live
