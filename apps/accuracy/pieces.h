// A motion in short pieces. Each piece starts from the reference, so that the error of the method
// is measured and not its amplification by chaos (Erez, Tassa, Todorov, ICRA 2015).
#pragma once

#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::apps::accuracy {

/// Start times and length of the pieces [s].
struct Plan {
  double time_step = 0.0;  ///< time step of the scene
  double length = 0.0;     ///< length of a piece, a whole number of the scene's time steps
  std::vector<double> starts;
  /// Largest number of times that the time step can be doubled and still divide `length`.
  int doublings = 0;
};

/// Plans `count` pieces, spread evenly over the duration. If length_wished is 0, each is as long as
/// possible, preferably a multiple of 16 time steps so that the time step can be varied. @throws
/// InputError if the duration cannot hold that many pieces of one time step, or if the wished
/// length is no multiple of the time step or does not fit.
Plan plan_pieces(const SimulationOptions& options, int count, double length_wished);

/// Distance of two configurations on the manifold: root mean square over the coordinates, lengths
/// in metres, angles in radians (rotation vectors for orientations).
struct Deviation {
  double all = 0.0;     ///< over all coordinates, with one radian counted as one metre
  double length = 0.0;  ///< over the lengths [m]
  double angle = 0.0;   ///< over the angles [rad]
};
Deviation deviation(const Model& model, const VectorX& q_reference, const VectorX& q);

/// Divisor of the piece's length closest to `near`: length / n with n whole.
double exact_step(const Plan& plan, double near);

}  // namespace counterpoint::apps::accuracy
