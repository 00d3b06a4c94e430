// The only way to make a Model: links and joints in, validated flat arrays out; and copies of one
// with other parameters.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// One link of a robot or one free object, as a file describes it.
struct LinkSpec {
  std::string name;
  SpatialInertia inertia;  ///< in the link frame
  Drag drag;
  double gravity_compensation =
      0.0;  ///< share of the link's weight that a force carries: GravityCompensation
  struct Collision {
    std::string name;  ///< empty: numbered
    Pose X_LG;
    Shape shape;
    Material material;
  };
  std::vector<Collision> collisions;
  std::string where;  ///< file and line, for messages
};

/// A servo as a file describes it: JointServo.
struct ServoSpec {
  double stiffness = 0.0, damping = 0.0;  ///< both zero: no servo
  std::optional<double> position;         ///< else where the joint starts
  double velocity = 0.0;
};

/// What joins two links, before merging: fixed joints exist here only.
struct JointSpec {
  std::string name;
  bool fixed = false;
  JointType type = JointType::kRevolute;
  std::string parent, child;  ///< link names
  Pose X_PJ;  ///< joint frame in the parent link frame; the child link frame at q = 0
  Vector3 axis =
      Vector3::UnitX();  ///< unit, in the joint frame; rotation, translation, or plane normal
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double effort_limit = std::numeric_limits<double>::infinity();
  double velocity_limit = std::numeric_limits<double>::infinity();
  double damping = 0.0, dry_friction = 0.0, armature = 0.0;
  double stiffness = 0.0, reference = 0.0;  ///< of a spring, joints of one coordinate only
  ServoSpec servo;                          ///< joints of one coordinate that mimic none
  std::string mimic_master;                 ///< empty: none
  double mimic_multiplier = 1.0, mimic_offset = 0.0;
  std::string where;
};

/// A robot or object as read from one file, before it is placed in a scene.
struct RobotSpec {
  std::string name;
  std::vector<LinkSpec> links;
  std::vector<JointSpec> joints;  ///< form one tree
  std::vector<Note> notes;        ///< found while reading
  std::string where;
};

/// A closure between two links, as a file describes it. What is left open follows from the start:
/// the closure is then closed there.
struct ClosureSpec {
  std::string name;  ///< empty: numbered
  ClosureType type = ClosureType::kBall;
  std::string link_a, link_b;       ///< with prefix; "world" is the world unless a link is named so
  std::optional<Vector3> anchor_a;  ///< in the frame of link a [m]; else its origin
  /// In the frame of link b [m]; else where anchor_a is at the start, for a distance b's origin.
  std::optional<Vector3> anchor_b;
  std::optional<Matrix3> orientation;  ///< kWeld: of link b in link a
  std::optional<double> length;        ///< kDistance [m]
  bool collide = false;                ///< may the two bodies touch?
  std::string where;
};

/// Surface values of a pair of surfaces, as far as a file gives them; the rest is combined.
struct PairSurface {
  std::optional<double> friction, restitution, torsional_friction, rolling_friction;
};

/// A free object of one shape and uniform density: a link "body" with a collision "shape".
/// @throws InputError for a shape without a volume of its own (plane, terrain, mesh).
RobotSpec object_of(const std::string& name, const Shape& shape, double mass,
                    const Material& material = {});

enum class Base {
  kFixed,
  kFloating,
  kSpherical,  ///< the root link hangs on a ball joint at its origin
};

/// Collects robots and environment, then makes the Model. After an exception the builder is not to
/// be used any further.
class ModelBuilder {
 public:
  explicit ModelBuilder(const Vector3& gravity = Vector3(0, 0, -kStandardGravity));

  /// Adds a robot whose root link is welded to the world at X_WL, or floats or turns about its
  /// origin, starting there. `prefix` ("arm/" say, or empty) goes before every name. Returns the
  /// instance index. The joint of a base that is not fixed is named after the root link. Links
  /// welded to the world add nothing to the world's inertia, which is zero.
  /// @throws InputError naming link or joint when the spec is no tree, a value is not finite or out
  /// of range, a name is taken.
  int add_robot(const RobotSpec& robot, Base base, const Pose& X_WL,
                const std::string& prefix = "");

  /// Adds geometry fixed to the world, such as the ground. Returns the geometry index.
  /// @throws InputError when the name is taken or shape, pose or material are invalid.
  int add_environment(const std::string& name, const Shape& shape, const Pose& X_WG,
                      const Material& material);

  /// The coordinate of a joint in the default configuration (otherwise 0, moved to the nearest
  /// limit if 0 lies outside the limits; that is noted). Quaternions are normalised. Joints that
  /// mimic another are set from it by build(). @throws InputError when the joint is unknown, the
  /// size is not joint_nq, or a value is not finite.
  void set_default_position(const std::string& joint, const VectorX& q);

  /// No contact between two geometries, or all geometries of links. `reason`: for the reader of the
  /// model; of several for one pair the first is kept. @throws InputError when a name is neither.
  void exclude_pair(const std::string& geometry_or_link_a, const std::string& geometry_or_link_b,
                    const std::string& reason = "");

  /// Contact between two geometries, or all geometries of links, even if a joint joins the links,
  /// they overlap in the default pose, or exclude_pair names them. @throws InputError when a name
  /// is neither.
  void include_pair(const std::string& geometry_or_link_a, const std::string& geometry_or_link_b);

  /// Surface values of a pair of geometries, or of all geometries of links, in place of what their
  /// materials combine to (combine_materials); of several for one pair the last counts. @throws
  /// InputError when a name is neither, or a value makes no sense.
  void set_pair_surface(const std::string& geometry_or_link_a,
                        const std::string& geometry_or_link_b, const PairSurface& surface);

  /// Gives inertia to what build() would refuse for moving none: the link of the joint gets a ball
  /// of this mass [kg] and the density of water (1000 kg/m^3) about its origin, from the outermost
  /// link on, until motion is defined. Each is noted. @throws InputError unless positive and
  /// finite.
  void fill_inertia(double mass);

  /// Ties two links together. To be called after all robots with these links. @throws InputError
  /// when a link is unknown, both are one rigid body, or a value makes no sense.
  void add_closure(const ClosureSpec& closure);

  /// Geometries added so far that have this name, or are a link's. @throws InputError if there is
  /// neither.
  std::vector<int> geometries_named(const std::string& name) const;

  int num_joints() const { return model_.num_joints(); }  ///< added so far
  /// Name of a joint added so far, numbered as in Model::joint.
  const std::string& joint_name(int joint) const { return model_.joints_.at(joint).name; }

  /// Adds to Model::notes.
  void add_note(const Note& note) { model_.notes_.push_back(note); }

  /// The model; the builder is empty afterwards. @throws InputError naming the joint when a part
  /// that can move has no inertia in the default configuration, so that its motion would be
  /// undefined, or a closure's anchors start at one point and its length is not given.
  Model build();

 private:
  struct Placement;  // of one robot, while it is added
  void add_link(const LinkSpec& link, const Placement& placement, int body, const Pose& X_BL);
  void add_collisions(const LinkSpec& link, const Placement& placement, int body, const Pose& X_BL,
                      int frame);
  int add_base(const RobotSpec& robot, const LinkSpec& root, Base base, const Placement& placement,
               const Pose& X_WL);
  int add_body(const JointSpec& joint, const Placement& placement, int parent, const Pose& X_PJ);
  /// A link, or the world, as one side of a closure.
  struct Anchor {
    int frame, body;
    Pose X_BL;
  };
  Anchor find_anchor(const ClosureSpec& spec, const std::string& link) const;
  void place_closures();
  void add_joint_forces(const JointSpec& joint, int index);
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
  double filled_mass_ = 0.0;  // [kg]; 0: refuse
  NameIndex joint_names_, frame_names_, geometry_names_;
  std::vector<int> frame_geometries_;  // where those of each frame begin
  std::vector<double> default_q_, damping_, armature_, dry_friction_;
  // By joint: where it was read, and the first link of its body whose inertia is not physical.
  std::vector<std::string> joint_where_, defective_link_;
  std::vector<char> position_given_;
  std::vector<std::optional<double>> servo_target_;  // of Model::servos
  struct PlacedClosure {
    ClosureSpec spec;
    Anchor a, b;
  };
  std::vector<PlacedClosure> closure_specs_;  // of Model::closures
};

// ---- A copy of a model with other parameters: same bodies, joints and names, so that a state of
// one is a state of the other. For identification and sensitivities.

/// Starts from a built model and changes values in it; structure stays. Every function @throws
/// InputError for a value that is not finite or that no model may have; indices are the caller's.
class ModelEditor {
 public:
  explicit ModelEditor(Model model) : model_(std::move(model)) {}

  void set_gravity(const Vector3& gravity);  ///< [m/s^2] in W
  void set_material(int geometry, const Material& material);
  /// Pose in the frame of its body, for the ground that of the world.
  void set_pose(int geometry, const Pose& X_BG);
  /// Mass [kg] of a body; carried weight (GravityCompensation) and the centre stay, the rotational
  /// inertia keeps its ratio to the mass.
  void set_mass(int body, double mass);
  /// All of it; the mass must be positive, whether a real body has the rest is the caller's.
  void set_inertia(int body, const SpatialInertia& inertia);
  /// Rotational inertia about the centre of mass, times `factor`.
  void scale_inertia(int body, double factor);
  /// All lengths of a body from its origin, times `factor`: shapes and where they are, centre of
  /// mass, radii of gyration; the mass stays. @throws InputError where another joint or a closure
  /// is mounted on it, or its shape is terrain.
  void scale_size(int body, double factor);
  void set_damping(int v_index, double value);       ///< [N m s/rad or N s/m]
  void set_dry_friction(int v_index, double value);  ///< [N m or N]
  void set_armature(int v_index, double value);      ///< [kg m^2 or kg]

  /// The model; the editor is empty afterwards.
  Model take() { return std::move(model_); }

 private:
  friend class ModelArchive;  // scene_archive.cc
  /// All that a model is.
  static auto parts(Model& m) {
    return std::tie(m.nq_, m.nv_, m.bodies_, m.trees_, m.joints_, m.frames_, m.geometries_,
                    m.pair_materials_, m.mimics_, m.springs_, m.servos_, m.drags_,
                    m.gravity_compensations_, m.closures_, m.notes_, m.excluded_pairs_,
                    m.exclusion_reasons_, m.included_pairs_, m.gravity_, m.default_q_, m.damping_,
                    m.armature_, m.dry_friction_);
  }

  Model model_;
};

}  // namespace counterpoint
