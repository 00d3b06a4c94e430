// The kinematic tree: <body>, <joint>, <freejoint>, <inertial>, <frame>, <site>.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "counterpoint/model/mjcf/bodies/geoms.h"
#include "counterpoint/model/mjcf/bodies/joints.h"

namespace counterpoint::mjcf {

struct Joint {
  const Element* element = nullptr;
  std::string name;  ///< name in its JointSpec
  int spec = 0;      ///< index into RobotSpec::joints
  int body = 0;
  double reference = 0.0;  ///< coordinate in the reference pose [rad or m]
  std::optional<SpringDamper> spring_damper = std::nullopt;
};

struct BodyNode {
  const Element* element = nullptr;
  std::string link;    ///< name of its link
  int link_index = 0;  ///< index into RobotSpec::links
  int parent = -1;
  int weld = 0;        ///< nearest body with joints, itself or above; 0: fixed to the world
  bool mocap = false;  ///< its motion is prescribed; that of a mocap body
  Pose X_WB;           ///< world pose in the reference configuration
  const Element* inertial = nullptr;
};

struct Site {
  int body = 0;
  Pose X_BS;
};

struct Bodies {
  std::vector<BodyNode> bodies;  ///< the world first, then depth first as in MuJoCo
  std::vector<Joint> joints;     ///< in MuJoCo's order
  std::vector<Geom> geoms;
  std::map<std::string, int> body_names, joint_names, geom_names;  ///< keys: names in the file
  std::map<std::string, Site> sites;

  int body(const Document& document, const Element& user, const std::string& name) const;
};

/// Reads all <worldbody> sections. Fills the links (without inertia) and joints of the robot, and
/// the coordinates of the model.
Bodies read_bodies(Document& document, const Defaults& defaults, MjcfModel& model);

/// Sets the inertias of the links from <inertial>, or from their geoms.
void read_inertias(Document& document, Assets& assets, const Bodies& bodies, MjcfModel& model);

/// Sets the drag of the links in the air of <option>. Call after read_inertias.
void read_air(Document& document, const Bodies& bodies, MjcfModel& model);

}  // namespace counterpoint::mjcf
