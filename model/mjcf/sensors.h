// <sensor>: the quantities of MuJoCo's sensors that sensors of the scene have too.
#pragma once

#include "counterpoint/model/mjcf/bodies/bodies.h"

namespace counterpoint::mjcf {

/// Adds the sensors that are supported to model.sensors, and notes the others
/// (docs/reference/mjcf.md). Call after read_inertias.
void read_sensors(Document& document, const Defaults& defaults, const Bodies& bodies,
                  MjcfModel& model);

}  // namespace counterpoint::mjcf
