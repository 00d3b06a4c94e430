// <actuator>: servos and control inputs.
#pragma once

#include "counterpoint/model/mjcf/document/switches.h"
#include "counterpoint/model/mjcf/forces/equality.h"

namespace counterpoint::mjcf {

/// Fills model.actuators and the servos and effort limits of the robot's joints. Call after
/// read_equalities. Actuators that <option> switches off apply no force.
void read_actuators(Document& document, const Defaults& defaults, const Switches& switches,
                    const Bodies& bodies, const Tendons& tendons, const Couplings& couplings,
                    MjcfModel& model);

}  // namespace counterpoint::mjcf
