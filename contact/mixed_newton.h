// Newton's method on a MixedSystem: few steps where the guess of who sticks, slides and is open is
// nearly right, and along a homotopy.
//
// On the way the smoothing follows the residual of the laws, center = theta * law_square a cone: a
// smoothing Newton method (Qi, Sun and Zhou, "A new look at smoothing Newton methods", 2000). Steps
// are halved a few times and then taken even if the residual rises: past a kink it falls again.
// Nothing makes that converge from afar for Coulomb laws; others take over soon.
#pragma once

#include <vector>

#include "counterpoint/contact/mixed_system.h"

namespace counterpoint::contact {

class MixedNewton {
 public:
  struct Result {
    bool solved = false;
    int iterations = 0;
  };

  /// At most `max_iterations` steps from `point` to the solution at the smoothing of the laws, to a
  /// relative residual of 1e-9. `point` is where it ended, solved or not.
  Result run(MixedSystem& system, int max_iterations, MixedSystem::Point& point);
  /// The same at the system's center and share as they are, until its residual's square is at most
  /// `square` [J].
  Result run_here(MixedSystem& system, int max_iterations, double square,
                  MixedSystem::Point& point);

  /// As MixedSystem::reserve.
  void reserve(const IslandSystem& system);

 private:
  bool advance(MixedSystem& system, int max_halvings, MixedSystem::Point& point, double& norm);
  MixedSystem::Point step_, trial_;
};

}  // namespace counterpoint::contact
