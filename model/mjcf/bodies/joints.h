// One <joint> or <freejoint>.
#pragma once

#include <optional>
#include <string>

#include "counterpoint/model/mjcf/document/compiler.h"
#include "counterpoint/model/mjcf/document/defaults.h"

namespace counterpoint::mjcf {

/// A spring and damper given by the motion that they lead to (`springdamper`).
struct SpringDamper {
  double time_constant = 0.0;  ///< [s]
  double ratio = 0.0;          ///< share of critical damping [-]
};

struct JointRead {
  JointSpec spec;                    ///< without name, parent, child and pose
  Vector3 anchor = Vector3::Zero();  ///< position in the body frame [m]
  Pose before;                       ///< motion by -reference, appended to the joint frame
  double reference = 0.0;            ///< coordinate in the reference pose [rad or m]
  std::optional<SpringDamper> spring_damper;
};

JointRead read_joint(Document& document, const Defaults& defaults, const Element& element,
                     const std::string& childclass);

}  // namespace counterpoint::mjcf
