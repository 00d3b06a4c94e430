// <option>, <keyframe>, and elements that are ignored.
#pragma once

#include "counterpoint/model/mjcf/bodies/bodies.h"
#include "counterpoint/model/mjcf/document/switches.h"

namespace counterpoint::mjcf {

Switches read_options(Document& document, MjcfModel& model);
/// Applies the switches to a fully read model: removes joint limits, friction, springs and dampers,
/// and control bounds.
void switch_off(const Switches& switches, MjcfModel& model);
void read_keyframes(Document& document, const Bodies& bodies, MjcfModel& model);
/// Notes the sections that have no effect on the motion; refuses unknown ones.
void check_sections(Document& document);

}  // namespace counterpoint::mjcf
