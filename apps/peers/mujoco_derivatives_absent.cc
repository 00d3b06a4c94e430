// Definitions for builds without MuJoCo 3.
#include "mujoco_derivatives.h"

namespace counterpoint::peers {

MujocoDerivatives::MujocoDerivatives(Mujoco& mujoco)
    : m_(mujoco.own_model()), d_(mujoco.own_data()) {
  throw NotExpressible("MuJoCo is older than 3: it has no mjd_inverseFD");
}

// These are never called, because no object can be constructed.
void MujocoDerivatives::inverse(const MujocoMoment&) {}
void MujocoDerivatives::transition(const MujocoMoment&, bool) {}
double MujocoDerivatives::inverse_error(const MujocoMoment&) { return 0.0; }
double MujocoDerivatives::transition_error(const MujocoMoment&, bool) { return 0.0; }

}  // namespace counterpoint::peers
