// Sensors in MJCF.
#pragma once

#include <vector>

#include "counterpoint/model/export/mjcf_xml.h"
#include "counterpoint/model/model.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Writes the sites on a body at which sensors are.
void write_mjcf_sensor_sites(const Model& model, int body, MjcfXml& xml);

/// Writes the element <sensor>: one element for each kind of a sensor, with the effects that are
/// on. `written`: MjcfControls::written. Appends to `lost`.
void write_mjcf_sensors(const Model& model, EffectSet on, const std::vector<char>& written,
                        MjcfXml& xml, std::vector<Note>& lost);

}  // namespace counterpoint
