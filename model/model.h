// The multibody model of a scene: bodies in kinematic trees, joints, inertias, shapes. Immutable
// once built by a ModelBuilder; shared by const reference between any number of threads.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/joint.h"
#include "counterpoint/model/parts/actuator.h"
#include "counterpoint/model/parts/closure.h"
#include "counterpoint/model/parts/sensor.h"
#include "counterpoint/model/parts/tendon.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {

// ---- The model.

/// Data of a body that the dynamics algorithms need. Body 0 is the world; every other body is
/// connected by exactly one joint to a body of lower index (links held by fixed joints are merged).
/// The bodies of a tree, and of every subtree, are contiguous, and so are their velocity indices.
struct Body {
  int parent = 0;  ///< -1 for the world
  JointType joint_type = JointType::kFloating;
  int q_index = 0;      ///< first coordinate of the joint in q
  int v_index = 0;      ///< first coordinate of the joint in v
  int tree = -1;        ///< kinematic tree, 0-based; -1 for the world
  int subtree_end = 0;  ///< one past the last body of the subtree rooted here
  Pose X_PJ;            ///< joint frame in the parent body's frame; the body frame at q = 0
  /// Inertia of all links merged into the body, in the body frame; zero for the world.
  SpatialInertia inertia;
};

/// Ranges [begin, end) of a tree's bodies and velocity coordinates.
struct Tree {
  int body_begin = 0, body_end = 0;
  int v_begin = 0, v_end = 0;
};

/// Properties of the joint of body i + 1 (joint i).
struct JointInfo {
  std::string name;  ///< unique; "<instance>/`<joint>`" in scenes of several models
  std::string link;  ///< child link as named in the file, with the same prefix
  /// Position limits [rad or m]; of a ball joint `upper` bounds the angle of its rotation.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  /// Limit of the force in each coordinate [N m or N].
  double effort_limit = std::numeric_limits<double>::infinity();
  /// Limit of the speed in each coordinate [rad/s or m/s].
  double velocity_limit = std::numeric_limits<double>::infinity();
  /// False for a floating joint and for the joint of a base: forces there count as unactuated.
  bool actuated = true;
  /// Its motion is given (Input::prescribed): whatever force that takes acts on it.
  bool prescribed = false;
};

/// A spring in a joint of one coordinate: force -stiffness (q - reference).
struct JointSpring {
  int joint = 0;           ///< index into joints()
  double stiffness = 0.0;  ///< [N m/rad or N/m], > 0
  double reference = 0.0;  ///< [rad or m]
};

/// A PD servo in a joint of one coordinate: force stiffness (position - q) + damping (velocity -
/// w). Its sum with the applied force is bounded by the joint's effort limit.
struct JointServo {
  int joint = 0;           ///< index into joints()
  double stiffness = 0.0;  ///< gain kp [N m/rad or N/m]
  double damping = 0.0;    ///< gain kd [N m s/rad or N s/m]; at least one gain is positive
  double position = 0.0;   ///< target [rad or m]
  double velocity = 0.0;   ///< target [rad/s or m/s]
};

/// Isotropic drag of a link in still air: force -(linear + quadratic |v|) v at its centre of mass,
/// torque -(angular + angular_quadratic |omega|) omega.
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

/// A force that carries part of a link's weight (MJCF gravcomp): -mass gravity at its centre of
/// mass.
struct GravityCompensation {
  int body = 0;
  Vector3 center = Vector3::Zero();  ///< the link's centre of mass, in the body frame [m]
  double mass = 0.0;                 ///< carried mass: fraction times the link's mass [kg]
};

/// A frame fixed to a body; every link has one, merged or not.
struct Frame {
  std::string name;
  int body = 0;
  Pose X_BF;
  int parent = -1;  ///< frame of the link that this link hangs on, moving or fixed; -1: none
  /// Inertia of this link as given when it was added, in its frame; ModelEditor leaves it.
  SpatialInertia inertia = {};
};

/// A joint that follows another: q[joint] = multiplier q[master] + offset (URDF `<mimic>`).
struct Mimic {
  int joint = 0;   ///< index into joints()
  int master = 0;  ///< index into joints()
  double multiplier = 1.0;
  double offset = 0.0;  ///< [rad or m]
};

/// Surface values of one pair of geometries, which replace those of combine_materials.
struct PairMaterial {
  int geometry_a = 0, geometry_b = 0;  ///< a < b
  Material material;
};

/// A note for the user about something found while loading that was not an error.
struct Note {
  std::string where;    ///< file, element
  std::string message;  ///< the finding, and the action taken, if any
};

class Model {
 public:
  int num_bodies() const { return static_cast<int>(bodies_.size()); }  ///< including the world
  int num_joints() const { return num_bodies() - 1; }
  int num_trees() const { return static_cast<int>(trees_.size()); }
  int nq() const { return nq_; }
  int nv() const { return nv_; }
  /// Number of internal states (State::z): those of actuators, then of switched closures.
  int nz() const { return static_cast<int>(default_z_.size()); }

  const Body& body(int i) const { return bodies_[i]; }
  const std::vector<Body>& bodies() const { return bodies_; }
  const std::vector<Tree>& trees() const { return trees_; }
  /// joint(i) is the joint of body i + 1.
  const JointInfo& joint(int i) const { return joints_[i]; }
  const std::vector<JointInfo>& joints() const { return joints_; }
  const std::vector<Frame>& frames() const { return frames_; }
  const std::vector<Geometry>& geometries() const { return geometries_; }
  /// Surface values given for pairs, in ascending order of (geometry_a, geometry_b).
  const std::vector<PairMaterial>& pair_materials() const { return pair_materials_; }
  /// Returns the material of a pair: the one given for it, else combine_materials.
  Material pair_material(int geometry_a, int geometry_b) const {
    if (!pair_materials_.empty())
      if (const PairMaterial* given = find_pair_material(geometry_a, geometry_b))
        return given->material;
    const auto [lower, higher] = std::minmax(geometry_a, geometry_b);
    return combine_materials(geometries_[lower].material, geometries_[higher].material);
  }
  /// Returns the values given for a pair, in any order of the two; null if there are none.
  const PairMaterial* find_pair_material(int geometry_a, int geometry_b) const;
  const std::vector<Mimic>& mimics() const { return mimics_; }
  const std::vector<JointSpring>& springs() const { return springs_; }
  const std::vector<JointServo>& servos() const { return servos_; }
  /// Returns the index into servos() of a joint's servo; -1 if it has none.
  int find_servo(int joint) const;
  const std::vector<BodyDrag>& drags() const { return drags_; }
  const std::vector<GravityCompensation>& gravity_compensations() const {
    return gravity_compensations_;
  }
  const std::vector<Closure>& closures() const { return closures_; }
  const std::vector<Tendon>& tendons() const { return tendons_; }
  const std::vector<Actuator>& actuators() const { return actuators_; }
  const std::vector<Sensor>& sensors() const { return sensors_; }
  const std::vector<Note>& notes() const { return notes_; }

  const Vector3& gravity() const { return gravity_; }  ///< [m/s^2] in W
  /// Initial q (nq), with unit quaternions; joint limits are not enforced.
  const VectorX& default_q() const { return default_q_; }
  /// Initial internal states (nz): actuators at rest at their commands, closures as they begin.
  const VectorX& default_z() const { return default_z_; }
  const VectorX& damping() const { return damping_; }  ///< nv, viscous [N m s/rad or N s/m]
  /// Rotor inertia reflected to the joints (nv) [kg m^2 or kg].
  const VectorX& armature() const { return armature_; }
  const VectorX& dry_friction() const { return dry_friction_; }  ///< nv [N m or N]
  /// Dry friction at rest (nv) [N m or N], which counts where it is above dry_friction; and the
  /// speeds (nv) at which 1 / e of that excess is left [rad/s or m/s].
  const VectorX& breakaway_friction() const { return breakaway_friction_; }
  const VectorX& stribeck_speed() const { return stribeck_speed_; }
  /// Whether friction at rest is above that of motion.
  bool breaks_away(int v_index) const {
    return breakaway_friction_[v_index] > dry_friction_[v_index];
  }
  /// Returns the largest dry friction at any speed [N m or N].
  double friction_at_rest(int v_index) const {
    return std::max(dry_friction_[v_index], breakaway_friction_[v_index]);
  }

  /// Returns the tree of a velocity coordinate.
  int tree_of_velocity(int v_index) const;

  /// Return the index of the named joint, frame, tendon or actuator; -1 if there is none.
  int find_joint(const std::string& name) const;
  int find_frame(const std::string& name) const;
  int find_tendon(const std::string& name) const;
  int find_actuator(const std::string& name) const;
  /// Pairs of geometries (first < second), ascending, that never collide: named by the scene file
  /// or an SRDF, or connected by a closure.
  const std::vector<std::pair<int, int>>& excluded_geometry_pairs() const {
    return excluded_pairs_;
  }
  /// Reason of each of these exclusions; may be empty strings.
  const std::vector<std::string>& exclusion_reasons() const { return exclusion_reasons_; }
  /// Pairs of geometries (first < second), ascending, that may touch even if a joint connects their
  /// links or they overlap in the default pose (ModelBuilder::include_pair).
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
  std::vector<Tendon> tendons_;
  std::vector<Actuator> actuators_;
  std::vector<Sensor> sensors_;
  std::vector<Note> notes_;
  std::vector<std::pair<int, int>> excluded_pairs_, included_pairs_;
  std::vector<std::string> exclusion_reasons_;
  Vector3 gravity_ = Vector3(0, 0, -kStandardGravity);
  VectorX default_q_, default_z_, damping_, armature_, dry_friction_, breakaway_friction_,
      stribeck_speed_;
};

/// Bodies begin ... end - 1.
struct BodyRange {
  int begin = 0, end = 0;
};

/// Coordinates begin ... begin + size - 1 of q.
struct CoordinateRange {
  int begin = 0, size = 0;
};
/// Returns the range of q that belongs to a tree.
CoordinateRange coordinates(const Model& model, const Tree& tree);

/// Returns the range of all bodies except the world.
inline BodyRange moving_bodies(const Model& model) { return {1, model.num_bodies()}; }

/// Returns X_WB of every body at q (nq), the world first. It allocates: meant for loading and
/// tests; steps use engine/dynamics/kinematics.h.
std::vector<Pose> body_poses(const Model& model, const VectorX& q);

/// Returns the length of a tendon at q (nq) and the poses of all bodies [m, or rad].
double tendon_length(const Model& model, const Tendon& tendon, const VectorRef& q,
                     const std::vector<Pose>& X_WB);

/// Returns q[joint] - multiplier q[master] - offset at q (nq) [m or rad].
double mimic_error(const Model& model, const Mimic& mimic, const VectorRef& q);

// ---- Checks of inertia: is it physical, and does every joint of a tree move some inertia?

/// Returns the reason why no rigid body can have this inertia, or "" if one can: the principal
/// moments must be positive and none may exceed the sum of the other two (relative tolerance 1e-6,
/// for files printed with few digits). Zero moments (a point mass, a massless link) are accepted.
std::string inertia_defect(const SpatialInertia& inertia);

/// Principal moments, ascending [kg m^2], and principal axes as columns (right-handed).
struct PrincipalAxes {
  Vector3 moments;
  Matrix3 axes;
};
PrincipalAxes principal_axes(const Matrix3& inertia);

/// Returns an inertia with the same mass, centre and principal axes and physical principal moments:
/// moments are raised to at least 1/1000 of the largest, then the triangle inequality is met by the
/// smallest change (Frobenius norm) of the moments.
SpatialInertia nearest_physical(const SpatialInertia& inertia);

/// Returns the inertia about its centre of a solid of uniform density: sphere, box, cylinder or
/// capsule of the given mass [kg]. @throws std::logic_error for other shapes.
SpatialInertia solid_inertia(const Shape& shape, double mass);

/// Returns the volume [m^3] of a sphere, box, cylinder or capsule. @throws std::logic_error for
/// other shapes.
double solid_volume(const Shape& shape);

/// Returns the joint-space inertia matrix M [kg, kg m, kg m^2] of one tree at q (nq, of all trees),
/// with armature. A dense reference: composite rigid bodies in one common frame. `scale`, if given,
/// receives the magnitude of the terms that sum to each diagonal entry.
MatrixX reference_mass_matrix(const Model& model, int tree, const VectorX& q,
                              VectorX* scale = nullptr);

/// Returns the coordinate (0 ... nv of the tree - 1) that has no inertia at q, or -1 if M is
/// positive definite: where elimination of M from the leaves meets a pivot that is not positive
/// (the inertia felt at that joint with all later joints free), or where the least eigenvalue of
/// the scaled M is zero up to round-off.
int find_coordinate_without_inertia(const Model& model, int tree, const VectorX& q);

}  // namespace counterpoint
