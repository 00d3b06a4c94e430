// MuJoCo's own finite differences of its inverse and of its step, and how far they are from
// extrapolated ones.
#pragma once

#include "mujoco.h"

namespace counterpoint::peers {

class MujocoDerivatives {
 public:
  /// mujoco must live as long. @throws NotExpressible where MuJoCo is missing, or is older than 3.
  explicit MujocoDerivatives(Mujoco& mujoco);

  /// mjd_inverseFD, all three matrices, as its documentation advises (eps 1e-6).
  void inverse(const MujocoMoment& moment);
  /// mjd_transitionFD, the derivative of the state, by differences to one side or central ones.
  /// Its solver starts at the moment's acceleration.
  void transition(const MujocoMoment& moment, bool centered);

  /// Largest entry by which inverse() is off from central differences of mj_inverse extrapolated
  /// from two steps, over its matrix's largest.
  double inverse_error(const MujocoMoment& moment);
  /// That of transition() off from central differences extrapolated from two steps, with the
  /// solver's tolerance at 0.
  double transition_error(const MujocoMoment& moment, bool centered);

 private:
  void set(const MujocoMoment& moment);
  void differences(const MujocoMoment& moment, double eps, bool centered);
  double error(const std::vector<double>& reference, std::size_t blocks) const;

  mjModel_* m_;
  mjData_* d_;
  std::vector<double> out_;  ///< the blocks of the last call
};

}  // namespace counterpoint::peers
