// Robots and scenes in the formats of other programs: URDF, MJCF and SDF are read, MJCF and URDF
// are written.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

// ---- Options for reading model files, and the parts of a model beside its kinematic trees, common
// to all formats.

struct ModelFileOptions {
  /// Maps NAME of package://NAME/... to a folder; meshes and included files may lie there.
  std::map<std::string, std::filesystem::path> packages;
  /// Replaces non-physical inertias by the nearest physical ones (nearest_physical) and notes each.
  /// If false, they are used unchanged and noted, or refused where the motion would be undefined.
  bool repair_inertias = false;
  /// Cache of hulls shared with other files; null: each file has its own.
  std::shared_ptr<HullCache> hulls;
};

/// Features of MJCF and SDF files that the engine does not support. A file that uses one is
/// refused, unless the user asks to leave that feature out.
enum class LeaveOut {
  /// Drag of the air and wind: `<option density viscosity wind>`, `<enable_wind>`,
  /// `<velocity_decay>`.
  kFluid,
  kTendons,  ///< forces and limits of tendons that do not couple two joints
  /// Actuators that act without a control and are not a servo of one joint; motors in an SDF file.
  kActuators,
  kJointForces,         ///< springs and limits of ball joints, springdamper
  kEqualities,          ///< equality constraints other than closures and couplings of two joints
  kFrictionDirections,  ///< anisotropic friction: the smaller coefficient counts
  kMocap,               ///< motion of mocap bodies, which stay where they are
  kSlip,                ///< creep proportional to force: `<slip1>`, `<slip2>`
};
/// Returns "fluid", "tendons", "actuators", "joint_forces", "equalities", "friction_directions",
/// "mocap" or "slip".
const char* leave_out_name(LeaveOut what);
/// Returns the inverse of leave_out_name; nothing for an unknown name.
std::optional<LeaveOut> leave_out_from_name(const std::string& name);
/// Returns all names for messages: "fluid, tendons, ... or slip".
std::string leave_out_names();
/// Returns advice for messages: ". To go on without it name the file in a scene: models: [{FORMAT:
/// FILE, leave_out: [WORD]}]".
std::string how_to_leave_out(const char* format, const std::filesystem::path& file, LeaveOut word);

struct LeavingOptions : ModelFileOptions {
  std::set<LeaveOut> leave_out;
};

struct ModelParts {
  /// Geometry fixed to the world.
  struct Environment {
    std::string name;
    Shape shape;
    Pose X_WG;
    Material material;
  };
  /// Two links or geometries that never touch.
  struct Exclusion {
    std::string a, b;
    std::string reason;
  };
  struct Surface {
    std::string a, b;
    PairSurface surface;
  };

  std::vector<Environment> environment;
  std::vector<ClosureSpec> closures;
  std::vector<TendonSpec> tendons;
  std::vector<ActuatorSpec> commanded;  ///< actuators with a command of their own
  std::vector<Exclusion> exclusions;
  std::vector<std::pair<std::string, std::string>> inclusions;  ///< see ModelBuilder::include_pair
  std::vector<Surface> surfaces;
  std::vector<SensorSpec> sensors;
};

/// Adds the parts to a builder that has their links, placed at X_WL and with `prefix` before every
/// name. @throws InputError as the builder.
void add_parts(const ModelParts& parts, const Pose& X_WL, const std::string& prefix,
               ModelBuilder& builder);

// ---- The file that a mesh name in a URDF refers to.

struct MeshPath {
  std::filesystem::path file;
  /// True if the named package or folder was not found, and the file was found by the end of its
  /// path.
  bool guessed = false;
  /// Result of the upward search: the folder that was taken as the package.
  std::filesystem::path root = {};
};

/// Finds the file of a mesh name: package://NAME/..., model://NAME/..., file://..., absolute, or
/// relative to the URDF. A package that is not listed is searched for upwards from the URDF: first
/// a folder NAME, then folders that contain the end of the path. The file, symlinks followed, must
/// lie in the URDF's folder, in the package that contains this folder (the nearest one upwards with
/// package.xml or model.config; without one, the folder above), in a listed package, or in the
/// folder NAME found upwards. `kind` is the word for the file in messages: "mesh", "included file"
/// ...
/// @throws InputError (with `where`) naming the searched places, or the way to allow files
/// elsewhere.
MeshPath find_mesh(const std::string& name, const std::filesystem::path& urdf_folder,
                   const std::map<std::string, std::filesystem::path>& packages,
                   const std::string& where, const char* kind = "mesh");

// ---- URDF files through urdfdom, with a second pass over the XML for the elements that urdfdom
// ignores.

/// Packages that are not listed are searched for upwards from the URDF.
struct UrdfOptions : ModelFileOptions {
  /// Swaps limits whose lower is above the upper one, and drops a `<mimic>` if the joint or its
  /// master is fixed or has several coordinates, or the master does not exist; notes each. If
  /// false, such files are refused.
  bool repair_joints = false;
  /// Values that a collision's file does not give.
  Material default_material;
};

/// Reads a URDF file. Visual elements are ignored; collision meshes become their convex hulls.
/// Friction and restitution come from Bullet's `<contact>`, Drake's proximity properties and
/// Gazebo's mu1. @throws InputError naming file, line or element, the expected input and a remedy.
RobotSpec load_urdf(const std::filesystem::path& file, const UrdfOptions& options = {});

// ---- MJCF, MuJoCo's model files: their supported contents, and their conversion to a scene.

using MjcfOptions = LeavingOptions;

/// A model as an MJCF file describes it. The root link of `robot` is the world ("world"); shapes
/// fixed to it are in `environment`, so that they touch the bodies attached to the world, as in
/// MuJoCo.
struct MjcfModel : ModelParts {
  /// A joint in the order of MuJoCo's qpos; names are those of `robot`.
  struct Coordinate {
    std::string joint;
    JointType type = JointType::kRevolute;
    std::vector<double> reference;  ///< qpos0, joint_nq numbers
  };
  /// An actuator with control u: the force on its joint is gain u + bias - stiffness q - damping w.
  struct Actuator {
    std::string name;
    /// Joint of one coordinate; "": it acts on a tendon, is one of `commanded`, or has no
    /// counterpart and acts only with a control.
    std::string joint;
    std::string tendon;  ///< in `tendons`; the force is along it, L and dL/dt in place of q and w
    double gain = 0.0, bias = 0.0, stiffness = 0.0, damping = 0.0;
    std::optional<double> least, most;  ///< bounds of u
    int commanded = -1;                 ///< index into `commanded`, whose law it has then; or -1
    std::string where;
  };
  struct Keyframe {
    std::string name;
    std::vector<double> q, v, control;  ///< in MuJoCo's order; if empty: qpos0, zero, zero
    std::vector<double> mocap_position, mocap_rotation;  ///< 3 and 4 numbers a mocap; or empty
    std::string where;
  };

  RobotSpec robot;
  std::vector<Coordinate> coordinates;
  std::vector<Coordinate> mocaps;  ///< floating joints of mocap bodies; not in qpos
  std::vector<Actuator> actuators;
  std::vector<Keyframe> keyframes;
  Vector3 gravity = Vector3(0, 0, -9.81);
  double time_step = 0.002;    ///< [s]
  double air_density = 0.0;    ///< [kg/m^3]
  double air_viscosity = 0.0;  ///< [Pa s]
  std::string integrator = "semi_implicit_euler";
};

/// Reads an MJCF file (docs/reference/mjcf.md). @throws InputError naming file, line, element, the
/// expected input and a remedy; also for unsupported features that would change the motion.
MjcfModel load_mjcf(const std::filesystem::path& file, const MjcfOptions& options = {});

/// Returns true if the root element of an XML file is `<mujoco>`. @throws InputError if it is not
/// XML.
bool is_mjcf(const std::filesystem::path& file);

/// Initial velocity of a joint.
struct StartVelocity {
  std::string joint;
  std::vector<double> v;  ///< joint_nv numbers [rad/s or m/s]
};

/// Adds a model to a builder, placed at X_WL and with `prefix` before every name, at a keyframe
/// (its name; "none": qpos0; "": the first one, or qpos0 if there is none). Returns the velocities
/// of the keyframe. @throws InputError as the builder, and for an unknown keyframe.
std::vector<StartVelocity> add_mjcf(const MjcfModel& model, const std::string& keyframe,
                                    const Pose& X_WL, const std::string& prefix,
                                    ModelBuilder& builder);

// ---- SDF, Gazebo's format of models and worlds: its supported contents, and their conversion to a
// scene.

using SdfOptions = LeavingOptions;

/// The models of an SDF file; static ones are in `environment`. Names: link "arm" of a single
/// model, "robot/arm" in a world, "robot/gripper/arm" in a nested model.
struct SdfModel : ModelParts {
  struct Tree {
    RobotSpec robot;
    /// kFixed: joints connect the tree to the world, which is the root link (named "world" after
    /// the model's prefix).
    Base base = Base::kFloating;
    Pose X_WL;
  };
  std::string name;
  std::string where;  ///< the file
  std::vector<Tree> trees;
  std::vector<Note> notes;
  std::optional<Vector3> gravity;   ///< gravity of a world [m/s^2]
  std::optional<double> time_step;  ///< time step of a world [s]
};

/// Reads an SDF file and the files that it includes (docs/reference/sdf.md). @throws InputError
/// naming file, line, element, the expected input and a remedy; also for unsupported features that
/// would change the motion, and if the program was built without libsdformat.
SdfModel load_sdf(const std::filesystem::path& file, const SdfOptions& options = {});

/// Returns true if the root element of an XML file is `<sdf>` (or `<gazebo>`, its old name).
/// @throws InputError if it is not XML.
bool is_sdf(const std::filesystem::path& file);

/// Adds the models to a builder, placed at X_WL and with `prefix` before every name. @throws
/// InputError as the builder.
void add_sdf(const SdfModel& model, const Pose& X_WL, const std::string& prefix,
             ModelBuilder& builder);

// ---- Export of a scene as MJCF (MuJoCo) or URDF.
//
// Both contain the bodies, inertias, joints, shapes and materials as far as the format has them;
// everything else is listed in Exported::lost. Numbers have 17 digits, so that reading the file
// gives the same values except for one rounding of frames. Bodies are those of the model: links
// held by fixed joints are merged, and a joint's axis is z of its body's frame.

/// An additional file, to be written beside the exported one.
struct ExportedFile {
  std::string name;  ///< relative to the folder of the exported file
  std::string text;
};

struct Exported {
  std::string text;                 ///< the document
  std::vector<ExportedFile> files;  ///< files that it refers to: meshes
  std::vector<Note> lost;           ///< parts of the scene that the format cannot express
};

/// The weight that is carried for all links of a body together; MJCF carries it at the centre of
/// mass of the body.
struct CarriedWeight {
  double mass = 0.0;      ///< [kg]
  bool at_center = true;  ///< true to 1e-9 of the distances
};
CarriedWeight carried_weight(const Model& model, int body);

/// Choices of export_mjcf.
struct MjcfExport {
  /// Pairs of geometries that do not collide, in addition to those that the model excludes
  /// (collision::Collider::overlapping_pairs).
  std::vector<std::pair<int, int>> apart;
  EffectSet effects = EffectSet::all();     ///< the others are left out
  std::string integrator = "implicitfast";  ///< known to MuJoCo 2.3.5 and later
  bool start = true;                        ///< writes the initial state as keyframe "start"
  bool frames = true;                       ///< writes frames of links, as sites, and sensors
  /// True: if surfaces differ, all pairs that may touch are listed, each with the friction that it
  /// has here. False: MuJoCo takes the larger friction of the two, which is noted as lost.
  bool pair_surfaces = false;
};

/// Returns the MJCF of the whole scene. Contacts are as stiff as MuJoCo's solver handles well
/// (solref 2 h, solimp 0.9999, elliptic cones, impratio 100); the contact models of the two engines
/// differ. @throws InputError for a plane that is not fixed to the world.
Exported export_mjcf(const Scene& scene, const MjcfExport& how = {});

/// Returns the URDF of one robot: the trees connected to the world by joints, or one floating tree.
/// It has neither the initial state nor the environment. `mesh_folder`: folder of the meshes (OBJ,
/// [m]), relative to the file. @throws InputError if the scene holds several robots: more than one
/// tree, one of them floating.
Exported export_urdf(const Scene& scene, const std::string& mesh_folder = "meshes");

}  // namespace counterpoint
