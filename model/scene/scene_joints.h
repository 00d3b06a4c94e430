// What a scene file says about the joints and links of a model beyond its own file: joint types,
// what acts in joints, drag. Private to scene_yaml.
#pragma once

#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

/// `joint_types: {JOINT: spherical}`: the joint becomes a ball joint at its origin. What else its
/// file says about it is dropped; that is noted.
void read_joint_types(const YamlValue& in, RobotSpec& robot);

/// `dynamics: {JOINT: {...}}`, over what the robot's file says; `all` is every joint to which a key
/// applies, joints named go before it.
void read_dynamics(const YamlValue& in, RobotSpec& robot);

/// `drag: {linear, quadratic, angular, angular_quadratic}` of one link.
Drag read_drag(const YamlValue& in);
/// `gravity_compensation: {LINK: share}`.
void read_link_compensations(const YamlValue& in, RobotSpec& robot);
/// `drag: {LINK: {...}}`.
void read_link_drags(const YamlValue& in, RobotSpec& robot);

}  // namespace counterpoint
