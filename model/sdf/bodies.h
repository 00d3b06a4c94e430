// Links and joints of one SDF model, those of nested models included.
#pragma once

#include <map>
#include <sdf/Joint.hh>
#include <sdf/Link.hh>
#include <sdf/Model.hh>
#include <string>
#include <vector>

#include "counterpoint/model/sdf/sensors.h"
#include "counterpoint/model/sdf/shapes.h"

namespace counterpoint::sdf_file {

struct LinkNode {
  LinkSpec spec;  ///< includes the collision geometries
  sdf::ElementPtr element;
  Pose X_TL;  ///< pose in the frame of the outermost model
  bool self_collide = false;
  std::vector<CollisionRead> collisions;  ///< in the order of spec.collisions
};

struct JointNode {
  std::string name;
  sdf::ElementPtr element;
  int parent = -1, child = -1;  ///< indices of links; -1: the world
  Pose X_TJ;                    ///< pose of the joint frame in the frame of the outermost model
  /// Joints in series from parent to child: none if fixed, two if universal. Each has its type,
  /// axis in the joint frame, limits and forces.
  std::vector<JointSpec> motions;
  std::vector<WrenchSensor> sensors;
  bool loop = false;  ///< must_be_loop_joint: the preferred joint to close a loop
};

struct Bodies {
  std::vector<LinkNode> links;
  std::vector<LinkNode> fixed;  ///< links of static models, without inertia
  std::vector<JointNode> joints;
  std::vector<SensorSpec> sensors;  ///< sensors of links
  std::vector<ActuatorSpec> motors;
};

/// Reads a model with its nested models. Joints to links of static models attach to the world.
/// `prefix` precedes every name.
Bodies read_bodies(Document& document, ShapeReader& shapes, const sdf::Model& model,
                   const std::string& prefix);

}  // namespace counterpoint::sdf_file
