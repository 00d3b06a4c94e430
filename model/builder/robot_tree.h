// First half of the builder's work: checks a robot as a file describes it and finds its tree.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/model/model_builder.h"

namespace counterpoint {

/// Tree formed by the joints of a robot.
struct RobotTree {
  int root = 0;                            ///< index into links
  std::vector<std::vector<int>> children;  ///< for each link, the joints below it, in file order
  std::vector<int> joint_child;            ///< for each joint, its child link
};

/// Returns the tree of a robot. @throws InputError naming link or joint when the joints do not form
/// one tree, a value is not finite or out of range, a name is missing or repeated, or a mimic has
/// no valid master.
RobotTree check_robot(const RobotSpec& robot);

/// @throws InputError naming `where` when the size of the shape is invalid or the pose is not a
/// rigid transform.
void check_shape(const Shape& shape, const std::string& where);
void check_pose(const Pose& pose, const std::string& where);
/// @throws InputError naming `where` when a coefficient is negative or not finite, or restitution
/// > 1.
void check_material(const Material& material, const std::string& where);

}  // namespace counterpoint
