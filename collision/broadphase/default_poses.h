#pragma once

#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::collision {

/// Pose X_WB of every body, the world first, at model.default_q(). Not computed with the engine's
/// kinematics, because collision must not depend on the engine.
std::vector<Pose> default_poses(const Model& model);

}  // namespace counterpoint::collision
