#include "counterpoint/model/model.h"

#include <algorithm>

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

}  // namespace counterpoint
