// One <joint> or <freejoint>.
#pragma once

#include <string>

#include "counterpoint/model/mjcf/document/compiler.h"
#include "counterpoint/model/mjcf/document/defaults.h"

namespace counterpoint::mjcf {

struct JointRead {
  JointSpec spec;                    ///< without name, parent, child and pose
  Vector3 anchor = Vector3::Zero();  ///< in the body's frame [m]
  Pose before;                       ///< of the joint frame: back by the reference
  double reference = 0.0;
};

JointRead read_joint(Document& document, const Defaults& defaults, const Element& element,
                     const std::string& childclass);

}  // namespace counterpoint::mjcf
