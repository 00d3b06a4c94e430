// Tendons in MJCF, and distance closures, which are tendons of fixed length there.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/model/export/mjcf_xml.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

/// Returns the name of the tendon that stands for a distance closure.
std::string mjcf_rod_name(const Model& model, const Closure& rod);

/// Writes what the tendons and distance closures need in <body>: sites at their points, and geoms
/// of group 3, without mass and contact, around which they run.
void write_mjcf_anchors(const Model& model, const std::vector<Closure>& closures, int body,
                        MjcfXml& xml);

/// Writes the element <tendon>: tendons, with their passive forces and limits where `forces` is
/// true, and distance closures, whose length an equality fixes. Appends to `lost`.
void write_mjcf_tendons(const Model& model, const std::vector<Closure>& closures, bool forces,
                        MjcfXml& xml, std::vector<Note>& lost);

}  // namespace counterpoint
