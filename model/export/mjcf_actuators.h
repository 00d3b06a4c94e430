// Servos of joints and tendons, and actuators, in MJCF.
#pragma once

#include <vector>

#include "counterpoint/model/export/mjcf_xml.h"
#include "counterpoint/model/model.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Writes the element <actuator>, of the effects that are on. Returns the controls at the start, in
/// its order.
std::vector<double> write_mjcf_actuators(const Model& model, EffectSet on, MjcfXml& xml);

}  // namespace counterpoint
