// Checks a robot as a file described it, and finds its tree: the first half of the builder's work.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/model/model_builder.h"

namespace counterpoint {

/// The tree that the joints of a robot form.
struct RobotTree {
  int root = 0;                            ///< index into links
  std::vector<std::vector<int>> children;  ///< of every link: the joints below it, in file order
  std::vector<int> joint_child;            ///< of every joint: its child link
};

/// @throws InputError naming link or joint when the links and joints form no single tree, a value
/// is not finite or out of range, a name is missing or given twice, a mimic follows nothing.
RobotTree check_robot(const RobotSpec& robot);

/// @throws InputError naming `where` when the shape has no valid size or the pose is no rigid
/// motion.
void check_shape(const Shape& shape, const std::string& where);
void check_pose(const Pose& pose, const std::string& where);
/// @throws InputError naming `where` when a coefficient is negative or not finite, or restitution
/// > 1.
void check_material(const Material& material, const std::string& where);

}  // namespace counterpoint
