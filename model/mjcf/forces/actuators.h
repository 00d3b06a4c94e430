// <actuator>: servos and inputs.
#pragma once

#include "counterpoint/model/mjcf/document/switches.h"
#include "counterpoint/model/mjcf/forces/equality.h"

namespace counterpoint::mjcf {

/// Fills model.actuators, the servos and effort limits of the robot's joints. After the equalities.
/// Those that the options switch off pull at nothing.
void read_actuators(Document& document, const Defaults& defaults, const Switches& switches,
                    const Bodies& bodies, const Tendons& tendons, const Couplings& couplings,
                    MjcfModel& model);  // Parameters: what it depends on, one by one

}  // namespace counterpoint::mjcf
