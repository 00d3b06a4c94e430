// Guarded calls of MuJoCo: by default it ends the program on errors and writes files on warnings.
#pragma once

#include <string>

#include "mujoco.h"

namespace counterpoint::peers {

/// Installs handlers: errors are returned by guarded_steps, warnings are read from mjData.
void keep_quiet();

/// Calls mj_step `count` times. Returns MuJoCo's error message, or ""; after an error the data must
/// not be stepped again.
std::string guarded_steps(const mjModel_* m, mjData_* d, long count);

/// Sets the options and the softness of all constraints, which depends on the model's time step.
void apply_settings(const MujocoSettings& settings, mjModel_* m);

/// Returns the poses X_WB of all bodies, the world first, at the coordinates in the data.
std::vector<Pose> poses_of(const mjModel_* m, mjData_* d);

/// Compiles MJCF from memory; the caller deletes the model. @throws NotExpressible
mjModel_* compile(const std::string& document);

}  // namespace counterpoint::peers
