// Newton's method on the mixed system: without added smoothing from a start near the solution, and
// by continuation in smoothing from any start.
#pragma once

#include "counterpoint/contact/solve/mixed_system.h"

namespace counterpoint::contact {

class MixedNewton {
 public:
  struct Result {
    bool solved = false;
    int iterations = 0;
    double residual = 0.0;  ///< relative
  };

  /// Starts from a point that may be nearly right, without smoothing beyond that of the laws. Gives
  /// up if the first steps do not reduce the residual.
  Result run_near(MixedSystem& system, int max_iterations, MixedSystem::Point& point);

  /// Runs from any start to the solution at the smoothing of the laws: a continuation that begins
  /// with `smoothing` [J] added to each law and decreases it.
  Result run_path(MixedSystem& system, int max_iterations, double smoothing,
                  MixedSystem::Point& point);

  /// Same as MixedSystem::reserve.
  void reserve(const IslandSystem& system);

 private:
  bool advance(MixedSystem& system, MixedSystem::Point& point, double& norm);

  MixedSystem::Point step_;
};

}  // namespace counterpoint::contact
