// Motions that tell parameters of a mechanism well: sums of sines that minimize the condition
// number of the joint forces' sensitivity (Swevers and others, "Optimal Robot Excitation and
// Identification", IEEE Trans. Robotics and Automation 1997).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "counterpoint/engine/estimate/estimate.h"

namespace counterpoint::estimation {

struct ExcitationOptions {
  double duration = 10.0;  ///< period of the motion [s]
  int harmonics = 5;       ///< number of sines of each joint, at multiples of 1 / duration
  double speed = 2.0;      ///< largest speed of a joint [rad/s, m/s], if its own limit is not less
  int random_starts = 100;
  int iterations = 60;  ///< most steps of the search from the best start
  std::uint64_t seed = 1;
  int threads = 0;                  ///< 0: one per core; the result does not depend on it
  std::function<bool()> stop = {};  ///< true ends the search with the best motion so far
};

/// A periodic motion within the limits of the joints, from time 0 to the duration, both included.
struct Excitation {
  std::vector<double> time;  ///< [s]
  MatrixX q, v;              ///< nv x rows [rad, m; rad/s, m/s]
  MatrixX force;             ///< nv x rows: applied forces along it [N m, N]
  /// Largest over smallest singular value of the sensitivity over the parameters' ranges, in the
  /// directions that any motion can tell; and that of the best random start.
  double condition = 0.0, random_condition = 0.0;
  int told = 0;  ///< number of these directions
  bool stopped = false;
};

/// Searches a motion. rate: rows a second of the result [1/s]. Parameters are those of fit_torques
/// without offsets, gains and delays; nothing touches, whatever the shapes do. @throws InputError
/// for other parameters, and for joints of several coordinates.
Excitation excite(const Scene& scene, const std::vector<Parameter>& parameters, double rate,
                  const ExcitationOptions& options);

}  // namespace counterpoint::estimation
