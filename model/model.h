// What a scene is made of: bodies in kinematic trees, joints, inertias, shapes. Immutable once
// built (model_builder.h is the only way to make one); shared by const reference between any number
// of threads.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {

// ---- Joint types and how each turns (q, v) into a relative pose and velocity.
//
// Every joint's axis is the z axis of its joint frame J: the builder turns body frames so that this
// holds, and hot loops then know one revolute and one prismatic joint only.
//
//   type        nq nv  q                       v
//   kRevolute    1  1  angle [rad]             rate [rad/s], about z
//   kPrismatic   1  1  displacement [m]        rate [m/s], along z
//   kPlanar      3  3  x, y [m], angle [rad]   rates, x and y in the axes of J (not turning with
//   the body) kSpherical   4  3  qw qx qy qz             angular velocity [rad/s], in the axes of
//   the body kFloating    7  6  x y z [m] qw qx qy qz   linear [m/s] in the axes of J, angular
//   [rad/s] in the axes of the body
//
// Velocities of planar and floating joints are kept in the parent's axes so that a free body's
// centre flies straight in discrete time as well.

enum class JointType : unsigned char { kRevolute, kPrismatic, kPlanar, kSpherical, kFloating };

constexpr int joint_nq(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kPrismatic:
      return 1;
    case JointType::kPlanar:
      return 3;
    case JointType::kSpherical:
      return 4;
    case JointType::kFloating:
      return 7;
  }
  return 0;
}

constexpr int joint_nv(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kPrismatic:
      return 1;
    case JointType::kPlanar:
    case JointType::kSpherical:
      return 3;
    case JointType::kFloating:
      return 6;
  }
  return 0;
}

/// How many of a joint's velocities are along axes; they come first, then those about axes.
constexpr int joint_num_linear(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kSpherical:
      return 0;
    case JointType::kPrismatic:
      return 1;
    case JointType::kPlanar:
      return 2;
    case JointType::kFloating:
      return 3;
  }
  return 0;
}

/// Turns frame J about its z axis.
inline Matrix3 turned_about_z(const Matrix3& R, double angle) {
  const double s = std::sin(angle), c = std::cos(angle);
  Matrix3 out;
  out.col(0) = c * R.col(0) + s * R.col(1);
  out.col(1) = c * R.col(1) - s * R.col(0);
  out.col(2) = R.col(2);
  return out;
}

/// Pose X_WB of a body from that of its joint frame, X_WJ, and the joint's coordinates q [rad, m,
/// quaternion of unit length] as above, joint_nq long.
inline Pose joint_pose(const Pose& X_WJ, JointType type, const double* q) {
  const Matrix3& R = X_WJ.rotation;
  switch (type) {
    case JointType::kRevolute:
      return {turned_about_z(R, q[0]), X_WJ.translation};
    case JointType::kPrismatic:
      return {R, X_WJ.translation + q[0] * R.col(2)};
    case JointType::kPlanar:
      return {turned_about_z(R, q[2]), X_WJ.translation + q[0] * R.col(0) + q[1] * R.col(1)};
    case JointType::kSpherical:
      return {R * Quaternion(q[0], q[1], q[2], q[3]).toRotationMatrix(), X_WJ.translation};
    case JointType::kFloating:
      return {R * Quaternion(q[3], q[4], q[5], q[6]).toRotationMatrix(),
              X_WJ * Vector3(q[0], q[1], q[2])};
  }
  return X_WJ;
}

/// "revolute", "prismatic", "planar", "spherical", "floating".
const char* joint_type_name(JointType type);

// ---- The model.

/// What the algorithms read of a body, in one place. Body 0 is the world; every other body hangs by
/// exactly one joint on a body of lower index (links held by fixed joints are merged). Bodies of a
/// tree, and of every subtree, are contiguous, and so are their velocity indices.
struct Body {
  int parent = 0;  ///< -1 for the world
  JointType joint_type = JointType::kFloating;
  int q_index = 0;      ///< first coordinate of the joint in q
  int v_index = 0;      ///< first coordinate of the joint in v
  int tree = -1;        ///< kinematic tree, 0-based; -1 for the world
  int subtree_end = 0;  ///< one past the last body of the subtree rooted here
  Pose X_PJ;            ///< joint frame at q = 0 in the parent body's frame
  SpatialInertia
      inertia;  ///< of all links merged into the body, in the body frame; the world's is zero
};

/// A tree's range of bodies and velocities.
struct Tree {
  int body_begin = 0, body_end = 0;
  int v_begin = 0, v_end = 0;
};

/// What is said about the joint of body i + 1 (joints and moving bodies are numbered alike).
struct JointInfo {
  std::string name;  ///< unique; "<instance>/<joint>" in scenes of several models
  std::string link;  ///< child link as named in the URDF, with the same prefix
  double lower =
      -std::numeric_limits<double>::infinity();  ///< [rad or m], joints of one coordinate only
  double upper = std::numeric_limits<double>::infinity();
  double effort_limit = std::numeric_limits<double>::infinity();  ///< [N m or N] in each coordinate
  double velocity_limit =
      std::numeric_limits<double>::infinity();  ///< [rad/s or m/s] in each coordinate
  bool actuated = true;  ///< false: a floating joint, or one that holds a base; forces there count
                         ///< as unactuated
};

/// A spring in a joint of one coordinate: force -stiffness (q - reference).
struct JointSpring {
  int joint = 0;           ///< index into joints()
  double stiffness = 0.0;  ///< [N m/rad or N/m], > 0
  double reference = 0.0;  ///< [rad or m]
};

/// A position and velocity controlled motor in a joint of one coordinate: force
/// stiffness (position - q) + damping (velocity - w), together with the applied force no more than
/// the joint's effort limit.
struct JointServo {
  int joint = 0;           ///< index into joints()
  double stiffness = 0.0;  ///< kp [N m/rad or N/m]
  double damping = 0.0;    ///< kd [N m s/rad or N s/m]; one of the two is positive
  double position = 0.0;   ///< target [rad or m]
  double velocity = 0.0;   ///< target [rad/s or m/s]
};

/// How still air resists a link: force -(linear + quadratic |v|) v at its centre of mass, torque
/// -(angular + angular_quadratic |omega|) omega. The same in all directions.
struct Drag {
  double linear = 0.0;             ///< [N s/m]
  double quadratic = 0.0;          ///< [N s^2/m^2]
  double angular = 0.0;            ///< [N m s]
  double angular_quadratic = 0.0;  ///< [N m s^2]
  bool any() const {
    return linear > 0.0 || quadratic > 0.0 || angular > 0.0 || angular_quadratic > 0.0;
  }
};

/// The drag of one link of a body.
struct BodyDrag {
  int body = 0;
  Vector3 center = Vector3::Zero();  ///< the link's centre of mass, in the body frame [m]
  Drag drag;
};

/// A force that carries a share of a link's weight (MJCF gravcomp): -mass gravity at its centre of
/// mass.
struct GravityCompensation {
  int body = 0;
  Vector3 center = Vector3::Zero();  ///< the link's centre of mass, in the body frame [m]
  double mass = 0.0;                 ///< carried: the share times the link's mass [kg]
};

/// A frame fixed to a body: every URDF link has one, merged or not.
struct Frame {
  std::string name;
  int body = 0;
  Pose X_BF;
};

/// A joint that follows another: q[joint] = multiplier q[master] + offset (URDF <mimic>).
struct Mimic {
  int joint = 0;   ///< index into joints()
  int master = 0;  ///< index into joints()
  double multiplier = 1.0;
  double offset = 0.0;  ///< [rad or m]
};

/// Surface values of one pair of geometries, in place of what their materials combine to.
struct PairMaterial {
  int geometry_a = 0, geometry_b = 0;  ///< a < b
  Material material;
};

enum class ClosureType : unsigned char {
  kBall,      ///< the anchors coincide (3 rows)
  kWeld,      ///< the anchor frames coincide (6 rows)
  kDistance,  ///< the anchors keep their distance, as on a massless rod (1 row)
};
/// "ball", "weld", "distance".
const char* closure_type_name(ClosureType type);

/// What holds two bodies together beyond the joints of the trees, so that loops close.
struct Closure {
  std::string name;  ///< unique
  ClosureType type = ClosureType::kBall;
  int body_a = 0, body_b = 0;  ///< either may be the world
  Pose X_AC, X_BC;      ///< anchor frame in the body's frame; orientation matters to kWeld only
  double length = 0.0;  ///< [m], kDistance
};

/// Something the reader of a model must know and that did not stop it from loading.
struct Note {
  std::string where;    ///< file, element
  std::string message;  ///< what was found, what was done or was not done about it
};

class Model {
 public:
  int num_bodies() const { return static_cast<int>(bodies_.size()); }  ///< the world included
  int num_joints() const { return num_bodies() - 1; }
  int num_trees() const { return static_cast<int>(trees_.size()); }
  int nq() const { return nq_; }
  int nv() const { return nv_; }

  const Body& body(int i) const { return bodies_[i]; }
  const std::vector<Body>& bodies() const { return bodies_; }
  const std::vector<Tree>& trees() const { return trees_; }
  /// joint(i) is the joint of body i + 1.
  const JointInfo& joint(int i) const { return joints_[i]; }
  const std::vector<JointInfo>& joints() const { return joints_; }
  const std::vector<Frame>& frames() const { return frames_; }
  const std::vector<Geometry>& geometries() const { return geometries_; }
  /// Surface values given for pairs, ascending by geometry_a, then geometry_b.
  const std::vector<PairMaterial>& pair_materials() const { return pair_materials_; }
  /// Those of two geometries: what is given for the pair, else combine_materials of both.
  Material pair_material(int geometry_a, int geometry_b) const {
    if (!pair_materials_.empty())
      if (const PairMaterial* given = find_pair_material(geometry_a, geometry_b))
        return given->material;
    return combine_materials(geometries_[geometry_a].material, geometries_[geometry_b].material);
  }
  /// What is given for a pair, or null.
  const PairMaterial* find_pair_material(int geometry_a, int geometry_b) const;
  const std::vector<Mimic>& mimics() const { return mimics_; }
  const std::vector<JointSpring>& springs() const { return springs_; }
  const std::vector<JointServo>& servos() const { return servos_; }
  /// Index into servos() of a joint; -1 if it has none.
  int find_servo(int joint) const;
  const std::vector<BodyDrag>& drags() const { return drags_; }
  const std::vector<GravityCompensation>& gravity_compensations() const {
    return gravity_compensations_;
  }
  const std::vector<Closure>& closures() const { return closures_; }
  const std::vector<Note>& notes() const { return notes_; }

  const Vector3& gravity() const { return gravity_; }  ///< [m/s^2] in W
  const VectorX& default_q() const {
    return default_q_;
  }  ///< nq; valid quaternions, within limits not enforced
  const VectorX& damping() const { return damping_; }  ///< nv, viscous [N m s/rad or N s/m]
  const VectorX& armature() const {
    return armature_;
  }  ///< nv, rotor inertia seen at the joint [kg m^2 or kg]
  const VectorX& dry_friction() const { return dry_friction_; }  ///< nv [N m or N]

  /// The tree that a coordinate of v belongs to.
  int tree_of_velocity(int v_index) const;

  /// Index of the named joint, frame, geometry; -1 if there is none.
  int find_joint(const std::string& name) const;
  int find_frame(const std::string& name) const;
  /// Pairs of geometries (first < second) excluded from collision by name: scene file, SRDF,
  /// closures.
  const std::vector<std::pair<int, int>>& excluded_geometry_pairs() const {
    return excluded_pairs_;
  }
  /// Why, one for each of these pairs; may be empty.
  const std::vector<std::string>& exclusion_reasons() const { return exclusion_reasons_; }
  /// Pairs of geometries (first < second), ascending, that touch even if a joint joins their links
  /// or they overlap in the default pose: <pair> of MJCF, `collide: true` in `pairs` of a scene
  /// file.
  const std::vector<std::pair<int, int>>& included_geometry_pairs() const {
    return included_pairs_;
  }

 private:
  friend class ModelBuilder;
  friend class ModelEditor;
  Model() = default;

  int nq_ = 0, nv_ = 0;
  std::vector<Body> bodies_;
  std::vector<Tree> trees_;
  std::vector<JointInfo> joints_;
  std::vector<Frame> frames_;
  std::vector<Geometry> geometries_;
  std::vector<PairMaterial> pair_materials_;
  std::vector<Mimic> mimics_;
  std::vector<JointSpring> springs_;
  std::vector<JointServo> servos_;
  std::vector<BodyDrag> drags_;
  std::vector<GravityCompensation> gravity_compensations_;
  std::vector<Closure> closures_;
  std::vector<Note> notes_;
  std::vector<std::pair<int, int>> excluded_pairs_, included_pairs_;
  std::vector<std::string> exclusion_reasons_;
  Vector3 gravity_ = Vector3(0, 0, -kStandardGravity);
  VectorX default_q_, damping_, armature_, dry_friction_;
};

/// Bodies begin ... end - 1.
struct BodyRange {
  int begin = 0, end = 0;
};

/// Coordinates begin ... begin + size - 1 of q.
struct CoordinateRange {
  int begin = 0, size = 0;
};
/// Those of a tree.
CoordinateRange coordinates(const Model& model, const Tree& tree);

/// All but the world.
inline BodyRange moving_bodies(const Model& model) { return {1, model.num_bodies()}; }

/// X_WB of every body at q (nq), the world first. For loading and for tests: it allocates; steps
/// use engine/dynamics/kinematics.h.
std::vector<Pose> body_poses(const Model& model, const VectorX& q);

/// How far a closure is from closed at these poses: distance of the anchors, for kDistance less the
/// length [m]; and for kWeld the angle between the frames, else zero [rad].
struct ClosureGap {
  double distance = 0.0, angle = 0.0;
  /// The larger of both, as they are [m or rad].
  double largest() const { return std::max(std::abs(distance), angle); }
};
ClosureGap closure_gap(const Closure& closure, const std::vector<Pose>& X_WB);

/// q[joint] - multiplier q[master] - offset, at q (nq) [m or rad].
double mimic_error(const Model& model, const Mimic& mimic, const VectorRef& q);

// ---- Checks of inertia: is it that of a real body, and does every joint of a tree move some?

/// Why no rigid body can have this inertia, or "" if one can: principal moments must be positive
/// and none larger than the sum of the other two (relative tolerance 1e-6, for files printed to few
/// digits). A point mass (all moments zero) and a massless link (all zero) are let pass.
std::string inertia_defect(const SpatialInertia& inertia);

/// Principal moments of an inertia, ascending [kg m^2], and axes, in columns, right-handed.
struct PrincipalAxes {
  Vector3 moments;
  Matrix3 axes;
};
PrincipalAxes principal_axes(const Matrix3& inertia);

/// A near inertia with the same mass, centre and principal axes whose principal moments are
/// those of a body: negative moments are raised to 1/1000 of the largest, then the triangle
/// inequality is met by the least change (Frobenius norm) of the moments.
SpatialInertia nearest_physical(const SpatialInertia& inertia);

/// Inertia of a solid of uniform density about its centre: sphere, box, cylinder or capsule of the
/// given mass [kg].
SpatialInertia solid_inertia(const Shape& shape, double mass);

/// Joint-space inertia matrix M [kg, kg m, kg m^2] of one tree at q (nq, all trees), with armature.
/// A plain reference: composite inertias in one common frame, dense. `scale`, if given, receives
/// for each coordinate the size of the terms that its diagonal entry was summed from.
MatrixX reference_mass_matrix(const Model& model, int tree, const VectorX& q,
                              VectorX* scale = nullptr);

/// The coordinate (0 ... nv of the tree - 1) at which elimination of M from the leaves meets a
/// pivot that is not positive, or -1 if M is positive definite at q. The pivot is the inertia felt
/// at that joint with all later joints free.
int find_coordinate_without_inertia(const Model& model, int tree, const VectorX& q);

}  // namespace counterpoint
