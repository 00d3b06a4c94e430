// Robots and scenes in the formats of other programs: URDF, MJCF and SDF are read, MJCF and URDF
// written.
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

// ---- How a file of a model is read, and what it describes beside trees, whatever its format.

struct ModelFileOptions {
  /// package:// roots: NAME -> folder, which meshes and included files may lie in.
  std::map<std::string, std::filesystem::path> packages;
  /// Opt-in: makes non-physical inertias physical (nearest one meeting the triangle inequality) and
  /// notes each. Off: they are used as they are where that can be simulated, noted, or refused.
  bool repair_inertias = false;
  /// Where hulls are shared with other files; none: each file has its own.
  std::shared_ptr<HullCache> hulls;
};

/// What an MJCF or SDF file may ask for that the engine does not have; refused, unless the user
/// leaves it out.
enum class LeaveOut {
  kFluid,        ///< drag of the air and wind: <option density viscosity wind>, <enable_wind>,
                 ///< <velocity_decay>
  kTendons,      ///< forces and limits of tendons that are no coupling of two joints
  kActuators,    ///< actuators that pull by themselves and are no servo of one joint; motors of an
                 ///< SDF file
  kJointForces,  ///< springs and limits of ball joints and the like
  kEqualities,   ///< equality constraints that are no closure and no coupling
  kFrictionDirections,  ///< friction that differs with the direction: the smaller counts
  kSlip,                ///< creep that grows with the force: <slip1>, <slip2>
};
/// "fluid", "tendons", "actuators", "joint_forces", "equalities", "friction_directions", "slip".
const char* leave_out_name(LeaveOut what);
/// The reverse; nothing for an unknown name.
std::optional<LeaveOut> leave_out_from_name(const std::string& name);
/// All names, for messages: "fluid, tendons, ... or slip".
std::string leave_out_names();
/// What a message says of a word: ". To go on without it name the file in a scene: models:
/// [{FORMAT: FILE, leave_out: [WORD]}]".
std::string how_to_leave_out(const char* format, const std::filesystem::path& file, LeaveOut word);

struct LeavingOptions : ModelFileOptions {
  std::set<LeaveOut> leave_out;
};

struct ModelParts {
  /// Fixed to the world.
  struct Environment {
    std::string name;
    Shape shape;
    Pose X_WG;
    Material material;
  };
  /// Links or geometries that never touch.
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
  std::vector<Exclusion> exclusions;
  std::vector<std::pair<std::string, std::string>> inclusions;  ///< ModelBuilder::include_pair
  std::vector<Surface> surfaces;
};

/// Puts them into a builder that has their links, placed and prefixed. @throws InputError as the
/// builder.
void add_parts(const ModelParts& parts, const Pose& X_WL, const std::string& prefix,
               ModelBuilder& builder);

// ---- Finds the file that a mesh name in a URDF means.

struct MeshPath {
  std::filesystem::path file;
  /// The package or folder named was not found as such; the file was found by the end of its path.
  bool guessed = false;
  std::filesystem::path root = {};  ///< of a search upwards: the folder that stands for the package
};

/// `kind`: what messages call it, "mesh", "included file" ...
/// package://NAME/..., model://NAME/..., file://..., absolute, or relative to the URDF. A package
/// that is not listed is looked for upwards from the URDF: a folder NAME first, then folders that
/// hold the end of the path. The file, symlinks followed, must lie in the URDF's folder, in the
/// package that this is part of (the nearest folder upwards with package.xml or model.config;
/// without one, the folder above), in a listed package, or in the folder NAME found upwards.
/// @throws InputError (with `where`) telling where was looked, or how to allow what lies elsewhere.
MeshPath find_mesh(const std::string& name, const std::filesystem::path& urdf_folder,
                   const std::map<std::string, std::filesystem::path>& packages,
                   const std::string& where, const char* kind = "mesh");

// ---- URDF files through urdfdom, with a second pass over the XML for what urdfdom drops.

/// A package not listed is searched for upwards from the URDF.
struct UrdfOptions : ModelFileOptions {
  /// Opt-in: exchanges limits whose lower is above the upper, and lets a joint go by itself that is
  /// to follow one that does not exist, is fixed or has several coordinates (or is so itself);
  /// notes each. Off: refused.
  bool repair_joints = false;
  /// For what a collision's file does not say.
  Material default_material;
};

/// Reads a URDF file. Visual elements are ignored; collision meshes become their convex hulls.
/// Friction and restitution come from Bullet's <contact>, Drake's proximity properties and Gazebo's
/// mu1. @throws InputError naming file, line or element, what was expected, what to do.
RobotSpec load_urdf(const std::filesystem::path& file, const UrdfOptions& options = {});

// ---- MJCF, MuJoCo's model files: what is read of them, and how it goes into a scene.

using MjcfOptions = LeavingOptions;

/// A model as an MJCF file describes it. The root link of `robot` is the world ("world"); what is
/// fixed to it stands in `environment`, so that it touches what hangs on it, as in MuJoCo.
struct MjcfModel : ModelParts {
  /// A joint in the order of MuJoCo's qpos; names are those of `robot`.
  struct Coordinate {
    std::string joint;
    JointType type = JointType::kRevolute;
    std::vector<double> reference;  ///< qpos0, joint_nq numbers
  };
  /// What an actuator does with its control u: it pulls at a joint with
  /// gain u + bias - stiffness q - damping w.
  struct Actuator {
    std::string name;
    std::string joint;  ///< of one coordinate; "": has no counterpart, and pulls with u only
    double gain = 0.0, bias = 0.0, stiffness = 0.0, damping = 0.0;
    std::optional<double> least, most;  ///< bounds of u
    std::string where;
  };
  struct Keyframe {
    std::string name;
    std::vector<double> q, v, control;  ///< in MuJoCo's order; empty: qpos0, zero, zero
    std::string where;
  };

  RobotSpec robot;
  std::vector<Coordinate> coordinates;
  std::vector<Actuator> actuators;
  std::vector<Keyframe> keyframes;
  Vector3 gravity = Vector3(0, 0, -9.81);
  double time_step = 0.002;    ///< [s]
  double air_density = 0.0;    ///< [kg/m^3]
  double air_viscosity = 0.0;  ///< [Pa s]
  std::string integrator = "semi_implicit_euler";
};

/// Reads an MJCF file (docs/reference/mjcf.md). @throws InputError naming file, line, element, what
/// was expected and what to do, also for what the engine does not have and would change the motion.
MjcfModel load_mjcf(const std::filesystem::path& file, const MjcfOptions& options = {});

/// True if the root element of an XML file is <mujoco>. @throws InputError if it is no XML.
bool is_mjcf(const std::filesystem::path& file);

/// A speed at the start, by joint.
struct StartVelocity {
  std::string joint;
  std::vector<double> v;  ///< joint_nv
};

/// Puts a model into a builder, placed and prefixed, at a keyframe (by name; "none": qpos0; "": the
/// first, or qpos0 if there is none). Returns the speeds there. @throws InputError as the builder,
/// and for an unknown keyframe.
std::vector<StartVelocity> add_mjcf(const MjcfModel& model, const std::string& keyframe,
                                    const Pose& X_WL, const std::string& prefix,
                                    ModelBuilder& builder);

// ---- SDF, Gazebo's format of models and worlds: what is read of it, and how it goes into a scene.

using SdfOptions = LeavingOptions;

/// The models of an SDF file. Static ones stand in `environment`. Names: link "arm" of a lone
/// model; "robot/arm" in a world; "robot/gripper/arm" in a model within it.
struct SdfModel : ModelParts {
  struct Tree {
    RobotSpec robot;
    /// kFixed: joints lead to the world, which is the root link ("world" behind the model's name).
    Base base = Base::kFloating;
    Pose X_WL;
  };
  std::string name;
  std::string where;  ///< the file
  std::vector<Tree> trees;
  std::vector<Note> notes;
  std::optional<Vector3> gravity;   ///< of a world [m/s^2]
  std::optional<double> time_step;  ///< of a world [s]
};

/// Reads an SDF file with what it includes (docs/reference/sdf.md). @throws InputError naming file,
/// line, element, what was expected and what to do, also for what the engine does not have and
/// would change the motion, and where the program was built without libsdformat.
SdfModel load_sdf(const std::filesystem::path& file, const SdfOptions& options = {});

/// True if the root element of an XML file is <sdf> (or <gazebo>, its old name). @throws InputError
/// if it is no XML.
bool is_sdf(const std::filesystem::path& file);

/// Puts the models into a builder, placed and prefixed. @throws InputError as the builder.
void add_sdf(const SdfModel& model, const Pose& X_WL, const std::string& prefix,
             ModelBuilder& builder);

// ---- A scene for other programs: as MJCF (MuJoCo), or as URDF.
//
// Both say what the format can: bodies, inertias, joints, shapes, materials. What it cannot is
// listed, never left out in silence. Numbers are written with 17 digits, so that what is read back
// is what was written but for one rounding of frames. The bodies are those of the model: links that
// fixed joints hold are merged, and a joint's axis is z of its body's frame.

/// A file to be written beside the exported one.
struct ExportedFile {
  std::string name;  ///< relative to the folder of the exported file
  std::string text;
};

struct Exported {
  std::string text;                 ///< the document
  std::vector<ExportedFile> files;  ///< what it refers to: meshes
  std::vector<Note> lost;           ///< what the format cannot say
};

/// MJCF of the whole scene, its start as keyframe "start". Contacts are as stiff as MuJoCo's solver
/// takes well (solref 2 h, solimp 0.9999, elliptic cones, impratio 100); both engines' contact
/// models differ. `apart`: pairs of geometries that do not collide beyond those that the model
/// excludes (collision::Collider::overlapping_pairs). @throws InputError for what would be another
/// model: a plane that moves.
Exported export_mjcf(const Scene& scene, const std::vector<std::pair<int, int>>& apart = {});

/// URDF of one robot: trees that hang on the world by joints, or one that floats. The start is not
/// in it, nor what lies on the world. `mesh_folder`: where the meshes (OBJ, [m]) are put and looked
/// for, relative to the file. @throws InputError if the scene holds several robots: more than one
/// tree, one of them floating.
Exported export_urdf(const Scene& scene, const std::string& mesh_folder = "meshes");

}  // namespace counterpoint
