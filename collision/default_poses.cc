#include "counterpoint/collision/default_poses.h"

namespace counterpoint::collision {

std::vector<Pose> default_poses(const Model& model) {
  std::vector<Pose> X_WB(model.num_bodies());
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    X_WB[i] = X_WB[body.parent] * body.X_PJ *
              joint_pose(body.joint_type, model.default_q().data() + body.q_index);
  }
  return X_WB;
}

}  // namespace counterpoint::collision
