#include "counterpoint/model/model.h"

#include <algorithm>
#include <cmath>

namespace counterpoint {
namespace {

/// Returns the index of the part with this name; -1 if there is none.
template <class Part>
int index_of(const std::vector<Part>& parts, const std::string& name) {
  const auto it =
      std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == name; });
  return it == parts.end() ? -1 : static_cast<int>(it - parts.begin());
}

}  // namespace

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

double tendon_length(const Model& model, const Tendon& tendon, const VectorRef& q,
                     const std::vector<Pose>& X_WB) {
  double length = 0.0;
  for (const TendonJoint& term : tendon.joints)
    length += term.coefficient * q[model.body(term.joint + 1).q_index];
  for (const TendonSegment& segment : tendon.path)
    length += segment.share * place_segment(tendon, segment, X_WB, false).length.length;
  return length;
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

int Model::find_joint(const std::string& name) const { return index_of(joints_, name); }
int Model::find_frame(const std::string& name) const { return index_of(frames_, name); }
int Model::find_tendon(const std::string& name) const { return index_of(tendons_, name); }
int Model::find_actuator(const std::string& name) const { return index_of(actuators_, name); }

// ---- Closures.

const char* closure_type_name(ClosureType type) {
  constexpr const char* kNames[kNumClosureTypes] = {"ball",   "weld",      "distance",    "hinge",
                                                    "slider", "prismatic", "cylindrical", "screw"};
  return kNames[static_cast<int>(type)];
}

bool holds_angles(ClosureType type) {
  return type == ClosureType::kWeld || type == ClosureType::kHinge ||
         type == ClosureType::kPrismatic || type == ClosureType::kCylindrical ||
         type == ClosureType::kScrew;
}

int num_rows(const Closure& closure) {
  const auto held = [](const ClosureSpring& spring, int most) {
    if (!spring.acts) return most;
    int rows = 0;
    for (int i = 0; i < most; ++i) rows += spring.stiffness[i] > 0.0 || spring.damping[i] > 0.0;
    return rows;
  };
  switch (closure.type) {
    case ClosureType::kBall:
      return held(closure.linear, 3);
    case ClosureType::kWeld:
      return held(closure.linear, 3) + held(closure.angular, 3);
    case ClosureType::kDistance:
      return 1;
    case ClosureType::kHinge:
      return held(closure.linear, 3) + held(closure.angular, 2);
    case ClosureType::kSlider:
      return held(closure.linear, 2);
    case ClosureType::kPrismatic:
      return held(closure.linear, 2) + held(closure.angular, 3);
    case ClosureType::kCylindrical:
      return held(closure.linear, 2) + held(closure.angular, 2);
    case ClosureType::kScrew:
      return 5;
  }
  return 0;
}

namespace {

bool slides(ClosureType type) {
  return type == ClosureType::kSlider || type == ClosureType::kPrismatic ||
         type == ClosureType::kCylindrical || type == ClosureType::kScrew;
}

/// Whether the closure leaves rotation about the z axes free.
bool turns_about_z(ClosureType type) {
  return type == ClosureType::kHinge || type == ClosureType::kCylindrical ||
         type == ClosureType::kScrew;
}

/// Pose in A's anchor frame of the frame X_BC in body B.
Pose anchor_pose(const Closure& closure, const Pose& X_BC, const Pose& X_WA, const Pose& X_WB) {
  return (X_WA * closure.X_AC).inverse() * (X_WB * X_BC);
}
Pose anchor_pose(const Closure& closure, const Pose& X_BC, const std::vector<Pose>& X_WB) {
  return anchor_pose(closure, X_BC, X_WB[closure.body_a], X_WB[closure.body_b]);
}

}  // namespace

Pose Closure::anchor_b(const VectorRef& z) const {
  if (!in_place) return X_BC;
  const auto held = z.segment<7>(z_index + 1);
  const Quaternion turn(held[3], held[4], held[5], held[6]);
  return X_BC * Pose{turn.toRotationMatrix(), held.head<3>()}.inverse();
}

Eigen::Matrix<double, 7, 1> pose_in_place(const Closure& closure, const Pose& X_WA,
                                          const Pose& X_WB) {
  const Pose X_AB = anchor_pose(closure, closure.X_BC, X_WA, X_WB);
  const Quaternion turn = Quaternion(X_AB.rotation).normalized();
  Eigen::Matrix<double, 7, 1> held;
  held << X_AB.translation, turn.w(), turn.x(), turn.y(), turn.z();
  return held;
}

double thread_error(const Closure& closure, const Pose& X_AB) {
  const Matrix3& R = X_AB.rotation;
  const double turn = std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1)) / (2.0 * M_PI);
  return std::remainder(X_AB.translation.z() - closure.pitch * turn, closure.pitch);
}

namespace {

ClosureGap gap_at(const Closure& closure, const Pose& X_AB) {
  const Vector3& apart = X_AB.translation;
  ClosureGap gap;
  if (!closure.linear.acts) {
    gap.distance = slides(closure.type) ? apart.head<2>().norm() : apart.norm();
    if (closure.type == ClosureType::kDistance) gap.distance -= closure.length;
    if (closure.type == ClosureType::kScrew)
      gap.distance = std::hypot(gap.distance, thread_error(closure, X_AB));
    if (closure.rope) gap.distance = std::max(gap.distance, 0.0);
  }
  if (closure.angular.acts) return gap;
  const Vector3 z = X_AB.rotation.col(2);
  if (turns_about_z(closure.type)) {
    gap.angle = std::atan2(z.head<2>().norm(), z.z());
  } else if (holds_angles(closure.type)) {
    gap.angle = Quaternion(X_AB.rotation).angularDistance(Quaternion::Identity());
  }
  return gap;
}

double spring_energy_at(const Closure& closure, const Pose& X_AB) {
  const auto energy = [](const ClosureSpring& spring, const Vector3& error, int rows) {
    return 0.5 * spring.stiffness.head(rows).dot(error.cwiseAbs2().head(rows));
  };
  if (!closure.linear.acts && !closure.angular.acts) return 0.0;
  double sum = 0.0;
  if (closure.type == ClosureType::kDistance) {
    const double longer = X_AB.translation.norm() - closure.length;
    return closure.rope && longer < 0.0 ? 0.0 : energy(closure.linear, {longer, 0.0, 0.0}, 1);
  }
  if (closure.linear.acts)
    sum += energy(closure.linear, X_AB.translation, slides(closure.type) ? 2 : 3);
  if (!closure.angular.acts) return sum;
  if (!turns_about_z(closure.type))
    return sum + energy(closure.angular, quaternion_log(Quaternion(X_AB.rotation)), 3);
  // The torque grows with the sine of the angle between the axes.
  const Vector3 z = X_AB.rotation.col(2);
  return sum + 2.0 / (1.0 + z.z()) * energy(closure.angular, Vector3::UnitZ().cross(z), 2);
}

}  // namespace

ClosureGap closure_gap(const Closure& closure, const std::vector<Pose>& X_WB) {
  return gap_at(closure, anchor_pose(closure, closure.X_BC, X_WB));
}

ClosureGap closure_gap(const Closure& closure, const std::vector<Pose>& X_WB, const VectorRef& z) {
  if (!closure.acts(z)) return {};
  return gap_at(closure, anchor_pose(closure, closure.anchor_b(z), X_WB));
}

double spring_energy(const Closure& closure, const std::vector<Pose>& X_WB) {
  return spring_energy_at(closure, anchor_pose(closure, closure.X_BC, X_WB));
}

double spring_energy(const Closure& closure, const std::vector<Pose>& X_WB, const VectorRef& z) {
  if (!closure.acts(z)) return 0.0;
  return spring_energy_at(closure, anchor_pose(closure, closure.anchor_b(z), X_WB));
}

}  // namespace counterpoint
