#include "counterpoint/model/model.h"

#include <algorithm>
#include <cmath>

namespace counterpoint {

int Model::find_joint(const std::string& name) const {
  const auto it = std::find_if(joints_.begin(), joints_.end(),
                               [&](const JointInfo& j) { return j.name == name; });
  return it == joints_.end() ? -1 : static_cast<int>(it - joints_.begin());
}

int Model::find_frame(const std::string& name) const {
  const auto it =
      std::find_if(frames_.begin(), frames_.end(), [&](const Frame& f) { return f.name == name; });
  return it == frames_.end() ? -1 : static_cast<int>(it - frames_.begin());
}

Material combine_materials(const Material& a, const Material& b) {
  Material m;
  m.friction = std::sqrt(a.friction * b.friction);
  m.restitution = std::max(a.restitution, b.restitution);
  m.torsional_friction = std::sqrt(a.torsional_friction * b.torsional_friction);
  m.rolling_friction = std::sqrt(a.rolling_friction * b.rolling_friction);
  return m;
}

}  // namespace counterpoint
