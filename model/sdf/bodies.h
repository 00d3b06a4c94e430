// Links and joints of one SDF model, those of models within it too.
#pragma once

#include <map>
#include <sdf/Joint.hh>
#include <sdf/Link.hh>
#include <sdf/Model.hh>
#include <string>
#include <vector>

#include "counterpoint/model/sdf/shapes.h"

namespace counterpoint::sdf_file {

struct LinkNode {
  LinkSpec spec;  ///< with collisions
  sdf::ElementPtr element;
  Pose X_TL;  ///< in the frame of the outermost model
  bool self_collide = false;
  std::vector<CollisionRead> collisions;  ///< those of spec
};

struct JointNode {
  std::string name;
  sdf::ElementPtr element;
  int parent = -1, child = -1;  ///< links; -1: the world
  Pose X_TJ;
  /// What moves, from parent to child, one after the other: none of a fixed joint, two of a
  /// universal one. Type, axis in the joint frame, limits and forces.
  std::vector<JointSpec> motions;
  bool loop = false;  ///< asks to be the one that closes a loop
};

struct Bodies {
  std::vector<LinkNode> links;
  std::vector<LinkNode> fixed;  ///< of static models, without inertia
  std::vector<JointNode> joints;
};

/// Joints to links of static models lead to the world. `prefix` goes before every name.
Bodies read_bodies(Document& document, ShapeReader& shapes, const sdf::Model& model,
                   const std::string& prefix);

}  // namespace counterpoint::sdf_file
