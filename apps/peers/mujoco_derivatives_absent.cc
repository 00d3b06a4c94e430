// Definitions for builds without MuJoCo; never called, because no Mujoco object exists.
#include "mujoco_derivatives.h"

namespace counterpoint::peers {

MujocoDerivatives::MujocoDerivatives(Mujoco& mujoco)
    : m_(mujoco.own_model()), d_(mujoco.own_data()) {}
void MujocoDerivatives::inverse(const MujocoMoment&) {}
void MujocoDerivatives::transition(const MujocoMoment&, bool) {}
double MujocoDerivatives::inverse_error(const MujocoMoment&) { return 0.0; }
double MujocoDerivatives::transition_error(const MujocoMoment&, bool) { return 0.0; }

}  // namespace counterpoint::peers
