// ModelBuilder, the only way to create a Model: it validates links and joints and stores them in
// flat arrays. ModelEditor: copies of a model with other parameters.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// One link of a robot, or one free object, as a file describes it.
struct LinkSpec {
  std::string name;
  SpatialInertia inertia;  ///< in the link frame
  Drag drag;
  /// Fraction of the link's weight that a force carries (GravityCompensation).
  double gravity_compensation = 0.0;
  struct Collision {
    std::string name;  ///< empty: its index in `collisions`
    Pose X_LG;
    Shape shape;
    Material material;
  };
  std::vector<Collision> collisions;
  std::string where;  ///< file and line for messages; the same in the structs below
};

/// A servo as a file describes it (JointServo).
struct ServoSpec {
  double stiffness = 0.0, damping = 0.0;  ///< both zero: no servo
  std::optional<double> position;         ///< default: the joint's initial position
  double velocity = 0.0;
};

/// A joint between two links as a file describes it; fixed joints exist here only, the builder
/// merges their links.
struct JointSpec {
  std::string name;
  bool fixed = false;
  JointType type = JointType::kRevolute;
  std::string parent, child;  ///< link names
  Pose X_PJ;  ///< joint frame in the parent link's frame; the child link's frame at q = 0
  /// Axis of rotation or translation, or plane normal, in the joint frame; need not have unit
  /// length.
  Vector3 axis = Vector3::UnitX();
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double effort_limit = std::numeric_limits<double>::infinity();
  double velocity_limit = std::numeric_limits<double>::infinity();
  double damping = 0.0, dry_friction = 0.0, armature = 0.0;
  /// Dry friction at rest [N m or N], at least dry_friction, or 0: the same; and the speed at which
  /// 1 / e of its excess is left [rad/s or m/s].
  double breakaway_friction = 0.0, stribeck_speed = 0.01;
  double stiffness = 0.0, reference = 0.0;  ///< spring, for joints of one coordinate only
  ServoSpec servo;                          ///< for joints of one coordinate without mimic
  std::string mimic_master;                 ///< empty: no mimic
  double mimic_multiplier = 1.0, mimic_offset = 0.0;
  bool prescribed = false;  ///< JointInfo::prescribed
  std::string where;
};

/// A robot or object as read from one file, before it is placed in a scene.
struct RobotSpec {
  std::string name;
  std::vector<LinkSpec> links;
  std::vector<JointSpec> joints;  ///< must form one tree
  std::vector<Note> notes;        ///< findings while reading
  bool prescribed_base = false;   ///< JointInfo::prescribed of the joint of a base that moves
  std::string where;
};

/// A closure (loop constraint) between two links, as a file describes it. Values that are not given
/// are computed from the initial configuration so that the closure is satisfied there.
struct ClosureSpec {
  std::string name;  ///< empty: "closure0", "closure1" ...
  ClosureType type = ClosureType::kBall;
  /// Names with prefix; "world" is the world unless a link has this name.
  std::string link_a, link_b;
  std::optional<Vector3> anchor_a;  ///< in the frame of link a [m]; default: its origin
  /// In the frame of link b [m]; default: the initial position of anchor_a; for a distance, and in
  /// place, b's origin.
  std::optional<Vector3> anchor_b;
  std::optional<Matrix3> orientation;  ///< types that hold angles: rotation of link b in link a
  std::optional<double> length;        ///< kDistance: length [m]
  /// Direction of a hinge, slider, prismatic, cylindrical or screw closure in link a; default: z.
  std::optional<Vector3> axis;
  std::optional<double> pitch;  ///< kScrew: way along the axis per turn [m], not zero
  bool rope = false;            ///< kDistance: it only pulls
  /// Springs and dampers along the axes of link a, or of a frame whose z axis is `axis`, in place
  /// of rigid rows: [N/m], [N s/m] and, for types that hold angles, [N m/rad], [N m s/rad]. A zero
  /// in both leaves a direction free.
  std::optional<Vector3> stiffness, damping, rotational_stiffness, rotational_damping;
  bool collide = false;  ///< true: the two bodies may touch, as those of a switched closure do
  /// Closure::switched ... in_place
  bool switched = false, attached = true, in_place = false;
  double breaking_force = std::numeric_limits<double>::infinity();
  double breaking_torque = std::numeric_limits<double>::infinity();
  std::string where;
};

/// A tendon as a file describes it: fixed (`joints`) or spatial (`path`).
struct TendonSpec {
  std::string name;  ///< empty: "tendon0", "tendon1" ...
  /// Joints by name, with their coefficients; each has one coordinate.
  std::vector<std::pair<std::string, double>> joints;
  /// A place of a path. It starts and ends with points, and so do the branches between pulleys; a
  /// sphere or cylinder stands between two points.
  struct Place {
    enum class Kind { kPoint, kSphere, kCylinder, kPulley };
    Kind kind = Kind::kPoint;
    std::string link;  ///< name with prefix; "world" is the world unless a link has this name
    Pose X_LG;  ///< in the frame of the link: a point's position, the frame of a wrap (TendonWrap)
    double radius = 0.0;          ///< radius of a sphere or cylinder [m]
    std::optional<Vector3> side;  ///< TendonWrap::side, in the frame of the wrap [m]
    double divisor = 1.0;         ///< pulley: the next branch carries the force over this [-]
  };
  std::vector<Place> path;
  double stiffness = 0.0, damping = 0.0, dry_friction = 0.0;  ///< Tendon
  /// Lengths between which the spring is slack; default: the length in the initial configuration.
  std::optional<std::pair<double, double>> rest;
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  TendonServo servo;                   ///< its target is `target`
  std::optional<double> servo_target;  ///< default: the length in the initial configuration
  std::string where;
};

/// An actuator as a file describes it; names are with prefix.
struct ActuatorSpec {
  /// Its indices are found from the names below, `point` and `direction` are in the frame of the
  /// link.
  Actuator actuator;
  std::string joint, tendon, link;  ///< the place where it acts, as its transmission says
  std::string where;
};

/// A sensor as a file describes it; names are with prefix.
struct SensorSpec {
  Sensor sensor;     ///< its indices are found from the names below
  std::string link;  ///< link that carries it, or "world"; for momentum empty: the whole scene
  std::string joint, tendon, actuator;
  std::string relative_to;  ///< Sensor::reference
  std::string from;         ///< Sensor::others: a link or geometry
  std::string where;
};

/// Surface values of a pair of geometries; those not given follow from combine_materials.
struct PairSurface {
  std::optional<double> friction, restitution, torsional_friction, rolling_friction;
  std::optional<double> static_friction;  ///< default: `friction`, where that is given
  std::optional<double> stribeck_speed;
  std::optional<double> stiffness, damping, dissipation;       ///< both surfaces in series
  std::optional<double> stiffness_per_area, damping_per_area;  ///< the same [N/m^3, N s/m^3]
  /// Set with `friction`: Material::friction_axis in the frame of the first of the two geometries.
  std::optional<Vector3> friction_axis;
  double friction_across = 0.0;
};

/// Returns a free object of one shape [m], uniform density and the given mass [kg]: a link "body"
/// with a collision "shape". @throws InputError for a plane, terrain or mesh, which have no such
/// inertia.
RobotSpec object_of(const std::string& name, const Shape& shape, double mass,
                    const Material& material = {});

enum class Base {
  kFixed,
  kFloating,
  kSpherical,  ///< the root link is on a ball joint at its origin
};

/// Collects robots and environment geometry, then builds the Model. Must not be used after an
/// exception.
class ModelBuilder {
 public:
  explicit ModelBuilder(const Vector3& gravity = Vector3(0, 0, -kStandardGravity));

  /// Adds a robot. Its root link is welded to the world at X_WL (kFixed), floats (kFloating) or
  /// turns about its origin on a ball joint (kSpherical), starting at X_WL. `prefix` ("arm/", or
  /// empty) is put before every name. The joint of a base that is not fixed has the name of the
  /// root link. Links welded to the world add nothing to the world's inertia, which is zero.
  /// Returns the index of the instance.
  /// @throws InputError naming link or joint when the joints do not form one tree, a value is not
  /// finite or out of range, or a name is taken.
  int add_robot(const RobotSpec& robot, Base base, const Pose& X_WL,
                const std::string& prefix = "");

  /// Adds geometry fixed to the world, such as the ground, at pose X_WG. Returns the geometry
  /// index; of a mesh with pieces, that of the first.
  /// @throws InputError when the name is taken or shape, pose or material are invalid.
  int add_environment(const std::string& name, const Shape& shape, const Pose& X_WG,
                      const Material& material);

  /// Sets the default q (joint_nq numbers) of a joint; otherwise it is 0, or the nearest limit if 0
  /// violates the limits, which is noted. Quaternions are normalized. build() computes the joints
  /// that mimic another. @throws InputError when the joint is unknown, the size is not joint_nq, or
  /// a value is not finite.
  void set_default_position(const std::string& joint, const VectorX& q);

  /// Excludes contact between two geometries, or between all geometries of two links. `reason` is
  /// for the user; the first one given for a pair is kept. @throws InputError when a name is
  /// neither a geometry nor a link.
  void exclude_pair(const std::string& geometry_or_link_a, const std::string& geometry_or_link_b,
                    const std::string& reason = "");

  /// Allows contact between two geometries, or between all geometries of two links, even if a joint
  /// connects the links, they overlap in the default pose, or exclude_pair names them. @throws
  /// InputError when a name is neither a geometry nor a link.
  void include_pair(const std::string& geometry_or_link_a, const std::string& geometry_or_link_b);

  /// Sets surface values of a pair of geometries, or of all geometries of two links, in place of
  /// those of combine_materials; the last ones given for a pair count. @throws InputError when a
  /// name is neither a geometry nor a link, or a value is invalid.
  void set_pair_surface(const std::string& geometry_or_link_a,
                        const std::string& geometry_or_link_b, const PairSurface& surface);

  /// Makes build() add inertia where it would otherwise refuse a joint that moves none: a solid
  /// ball of this mass [kg] and the density of water (1000 kg/m^3) at the origin of the joint's
  /// link, from the outermost link inwards, until M is positive definite. Each is noted. @throws
  /// InputError unless the mass is within limits::kMinMass ... kMaxMass.
  void fill_inertia(double mass);

  /// Adds a closure between two links; call it after all robots with these links. @throws
  /// InputError when a link is unknown, both belong to one rigid body, or a value is invalid.
  void add_closure(const ClosureSpec& closure);

  /// Adds a tendon; call it after all robots with its joints and links. @throws InputError when a
  /// joint or link is unknown, the path is no path, it moves more than two trees, or a value is
  /// invalid.
  void add_tendon(const TendonSpec& tendon);

  /// Adds an actuator; call it after the joint, tendon or link that it acts on. @throws InputError
  /// when a name is unknown or taken, or a value is invalid.
  void add_actuator(const ActuatorSpec& actuator);

  /// Adds a sensor; call it after all robots and geometry that it names. @throws InputError when a
  /// name is unknown or taken, a value is invalid, or the sensor cannot be computed for this link
  /// (docs/reference/sensors.md).
  void add_sensor(const SensorSpec& sensor);

  /// Returns the geometries added so far that have this name, are pieces of the mesh of this name
  /// (themselves NAME#0, NAME#1 ...) or belong to the link of this name.
  /// @throws InputError if there is neither.
  std::vector<int> geometries_named(const std::string& name) const;

  int num_joints() const { return model_.num_joints(); }  ///< number of joints added so far
  /// Returns the name of a joint added so far, numbered as in Model::joint.
  const std::string& joint_name(int joint) const { return model_.joints_.at(joint).name; }

  /// Appends a note to Model::notes.
  void add_note(const Note& note) { model_.notes_.push_back(note); }

  /// Returns the model; the builder is empty afterwards. @throws InputError naming the joint when
  /// it moves no inertia in the default configuration, so that its motion would be undefined, or
  /// naming the closure when its anchors coincide initially and its length is not given.
  Model build();

 private:
  struct Placement;  // data of the robot that is being added
  int add_link(const LinkSpec& link, const Placement& placement, int body, const Pose& X_BL,
               int parent);
  void add_collisions(const LinkSpec& link, const Placement& placement, int body, const Pose& X_BL,
                      int frame);
  void append_geometry(Geometry geometry, const std::string& where);
  int add_base(const RobotSpec& robot, const LinkSpec& root, Base base, const Placement& placement,
               const Pose& X_WL);
  int add_body(const JointSpec& joint, const Placement& placement, int parent, const Pose& X_PJ);
  /// One side of a closure: a link, or the world (frame -1).
  struct Anchor {
    int frame, body;
    Pose X_BL;
  };
  Anchor find_anchor(const ClosureSpec& spec, const std::string& link) const;
  void place_closures();
  void place_tendons();
  int find_sensor_link(const SensorSpec& spec, const std::string& link) const;
  void find_sensed_part(const SensorSpec& spec, Sensor& sensor) const;
  void find_sensed_contacts(const SensorSpec& spec, Sensor& sensor) const;
  void find_sensed_link(const SensorSpec& spec, Sensor& sensor) const;
  void add_joint_forces(const JointSpec& joint, int index);
  void place_internal_states();
  void add_exclusion(int a, int b, const std::string& reason);
  void sort_pairs();
  void apply_mimics();
  void set_servo_targets();
  void check_inertias();
  bool fill_body(int body);
  void orient_terrains();

  using NameIndex = std::map<std::string, int>;
  Model model_;
  int num_instances_ = 0, num_assemblies_ = 0;
  double filled_mass_ = 0.0;  // mass of fill_inertia [kg]; 0: refuse
  NameIndex joint_names_, frame_names_, geometry_names_;
  std::vector<int> frame_geometries_;  // for each frame, its first geometry
  std::vector<double> default_q_, damping_, armature_, dry_friction_, breakaway_friction_,
      stribeck_speed_;
  // For each joint: its place in a file, and the first link of its body with a non-physical
  // inertia.
  std::vector<std::string> joint_where_, defective_link_;
  std::vector<char> position_given_;
  std::vector<std::optional<double>> servo_target_;  // targets of Model::servos, if given
  struct PlacedClosure {
    ClosureSpec spec;
    Anchor a, b;
  };
  std::vector<PlacedClosure> closure_specs_;  // in the order of Model::closures
  std::vector<TendonSpec> tendon_specs_;      // in the order of Model::tendons
};

// ---- Copies of a model with other parameters: same bodies, joints and names, so that a state of
// one is a state of the other. For identification and sensitivities.

/// Changes values in a built model; its structure stays. Every function @throws InputError for a
/// value that is not finite or not allowed in a model; the caller must pass valid indices.
class ModelEditor {
 public:
  explicit ModelEditor(Model model) : model_(std::move(model)) {}

  void set_gravity(const Vector3& gravity);  ///< [m/s^2] in W
  void set_material(int geometry, const Material& material);
  /// Sets the pose of a geometry in the frame of its body (for environment geometry, the world).
  void set_pose(int geometry, const Pose& X_BG);
  /// Sets the mass [kg] of a body. Its centre of mass and the carried weight (GravityCompensation)
  /// stay; its rotational inertia keeps its ratio to the mass.
  void set_mass(int body, double mass);
  /// Sets the inertia of a body, in the body frame. The mass must be positive; whether the
  /// rotational inertia is physical is not checked.
  void set_inertia(int body, const SpatialInertia& inertia);
  /// Multiplies the rotational inertia about the centre of mass by `factor`.
  void scale_inertia(int body, double factor);
  /// Multiplies all lengths of a body, measured from its origin, by `factor`: shapes and their
  /// positions, centre of mass, radii of gyration; the mass stays. @throws InputError where another
  /// joint or a closure is attached to the body.
  void scale_size(int body, double factor);
  void set_damping(int v_index, double value);       ///< [N m s/rad or N s/m]
  void set_dry_friction(int v_index, double value);  ///< [N m or N]
  /// Sets the dry friction at rest [N m or N]; no effect unless it is above dry friction.
  void set_breakaway_friction(int v_index, double value);
  void set_stribeck_speed(int v_index, double value);  ///< [rad/s or m/s], positive
  void set_armature(int v_index, double value);        ///< [kg m^2 or kg]
  /// Replace an element by one of the same joint, or of the same place and law.
  void set_spring(int index, const JointSpring& spring);
  void set_servo(int index, const JointServo& servo);
  void set_actuator(int index, const Actuator& actuator);
  /// Sets the pose of a body's joint frame in its parent.
  void set_joint_pose(int body, const Pose& X_PJ);

  /// Returns the model; the editor is empty afterwards.
  Model take() { return std::move(model_); }

 private:
  friend class ModelArchive;  // scene_archive.cc
  /// References to all members of a model.
  static auto parts(Model& m) {
    return std::tie(m.nq_, m.nv_, m.bodies_, m.trees_, m.joints_, m.frames_, m.geometries_,
                    m.pair_materials_, m.mimics_, m.springs_, m.servos_, m.drags_,
                    m.gravity_compensations_, m.closures_, m.tendons_, m.actuators_, m.sensors_,
                    m.notes_, m.excluded_pairs_, m.exclusion_reasons_, m.included_pairs_,
                    m.gravity_, m.default_q_, m.default_z_, m.damping_, m.armature_,
                    m.dry_friction_, m.breakaway_friction_, m.stribeck_speed_);
  }

  Model model_;
};

}  // namespace counterpoint
