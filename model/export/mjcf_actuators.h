// Servos of joints and tendons, and actuators, in MJCF.
#pragma once

#include <vector>

#include "counterpoint/model/export/mjcf_xml.h"
#include "counterpoint/model/model.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Whether something other than servos of joints drives them. MuJoCo's limit of a joint's actuator
/// forces would cut these forces too; so the limits are then those of the servos.
bool has_drives_in_mjcf(const Model& model, EffectSet on);

/// Writes the sites on a body at which actuators act.
void write_mjcf_actuator_sites(const Model& model, EffectSet on, int body, MjcfXml& xml);

/// Numbers of a keyframe, in the order of <actuator>.
struct MjcfControls {
  std::vector<double> control;
  std::vector<double> activation;  ///< states of filters and muscles, at rest
  std::vector<char> written;       ///< for each of Model::actuators, whether the file has it
};

/// Writes the element <actuator>, with the effects that are on. Returns the values at the start;
/// appends to `lost`.
MjcfControls write_mjcf_actuators(const Model& model, EffectSet on, MjcfXml& xml,
                                  std::vector<Note>& lost);

}  // namespace counterpoint
