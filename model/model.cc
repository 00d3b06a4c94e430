#include "counterpoint/model/model.h"

#include <algorithm>

namespace counterpoint {

CoordinateRange coordinates(const Model& model, const Tree& tree) {
  const int begin = model.body(tree.body_begin).q_index;
  const Body& last = model.body(tree.body_end - 1);
  return {begin, last.q_index + joint_nq(last.joint_type) - begin};
}

std::vector<Pose> body_poses(const Model& model, const VectorX& q) {
  std::vector<Pose> X_WB(model.num_bodies());
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    X_WB[i] = joint_pose(X_WB[body.parent] * body.X_PJ, body.joint_type, q.data() + body.q_index);
  }
  return X_WB;
}

double mimic_error(const Model& model, const Mimic& mimic, const VectorRef& q) {
  return q[model.body(mimic.joint + 1).q_index] -
         mimic.multiplier * q[model.body(mimic.master + 1).q_index] - mimic.offset;
}

const PairMaterial* Model::find_pair_material(int geometry_a, int geometry_b) const {
  const std::pair wanted = std::minmax(geometry_a, geometry_b);
  const auto it = std::lower_bound(pair_materials_.begin(), pair_materials_.end(), wanted,
                                   [](const PairMaterial& p, const std::pair<int, int>& key) {
                                     return std::pair(p.geometry_a, p.geometry_b) < key;
                                   });
  const bool found = it != pair_materials_.end() && it->geometry_a == wanted.first &&
                     it->geometry_b == wanted.second;
  return found ? &*it : nullptr;
}

int Model::find_servo(int joint) const {
  const auto it = std::find_if(servos_.begin(), servos_.end(),
                               [&](const JointServo& servo) { return servo.joint == joint; });
  return it == servos_.end() ? -1 : static_cast<int>(it - servos_.begin());
}

int Model::tree_of_velocity(int v_index) const {
  const auto it = std::upper_bound(trees_.begin(), trees_.end(), v_index,
                                   [](int v, const Tree& t) { return v < t.v_end; });
  return static_cast<int>(it - trees_.begin());
}

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
