// The bodies of a file in the reference pose, for what MuJoCo scales by their inertia there.
#pragma once

#include "counterpoint/model/model.h"
#include "counterpoint/model/robot_files.h"

namespace counterpoint::mjcf {

/// Returns the links and joints of a file without shapes and couplings; default_q is the reference
/// pose. @throws InputError naming the joint that moves no inertia.
Model reference_model(const MjcfModel& model);

/// Returns the inverse mass of a link that can move [1/kg]: the mean over directions of the
/// acceleration of its centre of mass per force there, in the reference pose with all joints free
/// (body_invweight0 of MuJoCo). `model`: reference_model(file).
double inverse_mass(const MjcfModel& file, const Model& model, int link);

}  // namespace counterpoint::mjcf
