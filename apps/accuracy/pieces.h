// A motion in short pieces: each starts anew from the reference, so that what is measured is the
// error of a method and not how chaos amplifies it (Erez, Tassa, Todorov, ICRA 2015).
#pragma once

#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::apps::accuracy {

/// When pieces start, and how long they are [s].
struct Plan {
  double time_step = 0.0;  ///< the scene's
  double length = 0.0;     ///< of a piece, a whole number of the scene's time steps
  std::vector<double> starts;
  /// Largest number of times that the time step can be doubled and still divide `length`.
  int doublings = 0;
};

/// `count` pieces spread evenly over the duration. Without a wish for their length each is as long
/// as there is room for, if possible a multiple of 16 time steps so that these can be varied.
/// @throws InputError where the duration does not hold that many pieces of one time step, or the
/// length wished for is no multiple of the time step or does not fit.
Plan plan_pieces(const SimulationOptions& options, int count, double length_wished);

/// How far two configurations are apart: the manifold difference, lengths in metres, angles in
/// radians (rotation vectors for orientations), root of the mean square over the coordinates.
struct Deviation {
  double all = 0.0;     ///< over all coordinates, a radian counted as a metre
  double length = 0.0;  ///< over the lengths [m]
  double angle = 0.0;   ///< over the angles [rad]
};
Deviation deviation(const Model& model, const VectorX& q_reference, const VectorX& q);

/// The time step as a divisor of a piece: length / n, n whole.
double exact_step(const Plan& plan, double near);

}  // namespace counterpoint::apps::accuracy
