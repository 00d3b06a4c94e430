// <option>, <keyframe>, and what is passed over.
#pragma once

#include "counterpoint/model/mjcf/bodies/bodies.h"

namespace counterpoint::mjcf {

void read_options(Document& document, MjcfModel& model);
void read_keyframes(Document& document, MjcfModel& model);
/// Gravity compensation: of all bodies that can move it means no gravity; of some it is refused.
void read_compensation(Document& document, const Bodies& bodies, MjcfModel& model);
/// Sections that this engine has no use for are noted; unknown ones refused.
void check_sections(Document& document);

}  // namespace counterpoint::mjcf
