// <option>, <keyframe>, and elements that are ignored.
#pragma once

#include "counterpoint/model/mjcf/bodies/bodies.h"
#include "counterpoint/model/mjcf/document/switches.h"

namespace counterpoint::mjcf {

Switches read_options(Document& document, MjcfModel& model);
/// Takes limits, friction, springs and dampers of joints, and bounds of controls, from a model that
/// was read to its end.
void switch_off(const Switches& switches, MjcfModel& model);
void read_keyframes(Document& document, const Bodies& bodies, MjcfModel& model);
/// Sections that this engine has no use for are noted; unknown ones refused.
void check_sections(Document& document);

}  // namespace counterpoint::mjcf
