// Settings in a scene file for the joints and links of a model: joint types, forces in joints,
// drag, gravity compensation. Private to scene_yaml.
#pragma once

#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

/// Reads `joint_types: {JOINT: spherical}`: the joint becomes a ball joint at its origin. Its other
/// properties in the model file are dropped, which is noted.
void read_joint_types(const YamlValue& in, RobotSpec& robot);

/// Reads `dynamics: {JOINT: {...}}`, which overrides the robot's file; `all` means every joint to
/// which a key applies, and entries of named joints override it.
void read_dynamics(const YamlValue& in, RobotSpec& robot);

/// Reads `drag: {linear, quadratic, angular, angular_quadratic}` of one link.
Drag read_drag(const YamlValue& in);
/// Reads `gravity_compensation: {LINK: fraction}`.
void read_link_compensations(const YamlValue& in, RobotSpec& robot);
/// Reads `drag: {LINK: {...}}`.
void read_link_drags(const YamlValue& in, RobotSpec& robot);

}  // namespace counterpoint
