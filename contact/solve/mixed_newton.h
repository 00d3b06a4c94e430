// Newton's method on the mixed system: without smoothing from a start near the solution, and by
// continuation in smoothing from any start.
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

  /// From a start that may be nearly right: no smoothing beyond that of the laws. Gives up when the
  /// first steps do not bring the residual down.
  Result run_near(MixedSystem& system, int max_iterations, MixedSystem::Point& point);

  /// From anywhere to the solution at the smoothing of the laws, from so much more smoothing [J] to
  /// less and less.
  Result run_path(MixedSystem& system, int max_iterations, double smoothing,
                  MixedSystem::Point& point);

  /// As MixedSystem::reserve.
  void reserve(const IslandSystem& system);

 private:
  bool advance(MixedSystem& system, int max_halvings, MixedSystem::Point& point, double& norm);

  MixedSystem::Point step_;
};

}  // namespace counterpoint::contact
