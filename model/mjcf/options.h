// <option>, <keyframe>, and what is passed over.
#pragma once

#include "counterpoint/model/mjcf/bodies/bodies.h"

namespace counterpoint::mjcf {

void read_options(Document& document, MjcfModel& model);
void read_keyframes(Document& document, MjcfModel& model);
/// Sections that this engine has no use for are noted; unknown ones refused.
void check_sections(Document& document);

}  // namespace counterpoint::mjcf
