// MuJoCo's finite differences of its inverse and of its step, and their errors against extrapolated
// differences.
#pragma once

#include "mujoco.h"

namespace counterpoint::peers {

class MujocoDerivatives {
 public:
  /// `mujoco` must outlive it. @throws NotExpressible if MuJoCo is missing or older than 3.
  explicit MujocoDerivatives(Mujoco& mujoco);

  /// Calls mjd_inverseFD for all three matrices, with eps = 1e-6 as its documentation advises.
  void inverse(const MujocoMoment& moment);
  /// Calls mjd_transitionFD for the derivative of the state, with one-sided or central differences.
  /// Its solver starts from the moment's acceleration.
  void transition(const MujocoMoment& moment, bool centered);

  /// Largest error of an entry of inverse() against central differences of mj_inverse extrapolated
  /// from two steps, relative to the largest entry of its matrix.
  double inverse_error(const MujocoMoment& moment);
  /// The same for transition(), against extrapolated central differences with the solver's
  /// tolerance at 0.
  double transition_error(const MujocoMoment& moment, bool centered);

 private:
  void set(const MujocoMoment& moment);
  void differences(const MujocoMoment& moment, double eps, bool centered);
  double error(const std::vector<double>& reference, std::size_t blocks) const;

  mjModel_* m_;
  mjData_* d_;
  std::vector<double> out_;  ///< blocks of the last call
};

}  // namespace counterpoint::peers
