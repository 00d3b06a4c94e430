// <body>, <joint>, <freejoint>, <inertial>, <frame>, <site>: the tree.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "counterpoint/model/mjcf/bodies/geoms.h"

namespace counterpoint::mjcf {

struct Joint {
  const Element* element = nullptr;
  std::string name;  ///< of its JointSpec
  int spec = 0;      ///< index into RobotSpec::joints
  int body = 0;
  double reference = 0.0;  ///< its coordinate in the reference pose [rad or m]
};

struct BodyNode {
  const Element* element = nullptr;
  std::string link;    ///< its link's name
  int link_index = 0;  ///< into RobotSpec::links
  int parent = -1;
  int weld = 0;  ///< the body, itself or one above, whose joints move it; 0: fixed to the world
  Pose X_WB;     ///< in the reference pose
  const Element* inertial = nullptr;
};

struct Site {
  int body = 0;
  Pose X_BS;
};

struct Bodies {
  std::vector<BodyNode> bodies;  ///< the world first; depth first, as MuJoCo numbers them
  std::vector<Joint> joints;     ///< in MuJoCo's order
  std::vector<Geom> geoms;
  std::map<std::string, int> body_names, joint_names, geom_names;  ///< as in the file
  std::map<std::string, Site> sites;

  int body(const Document& document, const Element& user, const std::string& name) const;
};

/// Reads all <worldbody> sections; fills links (without inertia) and joints of the robot, and the
/// coordinates of the model.
Bodies read_bodies(Document& document, const Defaults& defaults, MjcfModel& model);

/// Gives the links their inertia: from <inertial>, or from geoms.
void read_inertias(Document& document, Assets& assets, const Bodies& bodies, MjcfModel& model);

/// Gives the links the drag of the air of <option>. Needs their inertia.
void read_air(Document& document, const Bodies& bodies, MjcfModel& model);

}  // namespace counterpoint::mjcf
