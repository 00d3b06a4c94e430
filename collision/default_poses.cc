#include "counterpoint/collision/default_poses.h"

namespace counterpoint::collision {
namespace {

Pose joint_pose(JointType type, const double* q) {
  Pose X;
  const auto turned = [](const double* c) {
    return Quaternion(c[0], c[1], c[2], c[3]).normalized().toRotationMatrix();
  };
  switch (type) {
    case JointType::kRevolute:
      X.rotation = Eigen::AngleAxisd(q[0], Vector3::UnitZ()).toRotationMatrix();
      break;
    case JointType::kPrismatic: X.translation.z() = q[0]; break;
    case JointType::kPlanar:
      X.translation << q[0], q[1], 0.0;
      X.rotation = Eigen::AngleAxisd(q[2], Vector3::UnitZ()).toRotationMatrix();
      break;
    case JointType::kSpherical: X.rotation = turned(q); break;
    case JointType::kFloating:
      X.translation << q[0], q[1], q[2];
      X.rotation = turned(q + 3);
      break;
  }
  return X;
}

}  // namespace

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
