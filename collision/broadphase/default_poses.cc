#include "counterpoint/collision/broadphase/default_poses.h"

namespace counterpoint::collision {

std::vector<Pose> default_poses(const Model& model) { return body_poses(model, model.default_q()); }

}  // namespace counterpoint::collision
