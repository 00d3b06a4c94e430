// MJCF, MuJoCo's model files: what is read of them, and how it goes into a scene.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "counterpoint/model/builder/model_parts.h"

namespace counterpoint {

/// What a file may ask for that the engine does not have; refused, unless the user leaves it out.
enum class LeaveOut {
  kFluid,                ///< drag of the air: <option density viscosity wind>
  kTendons,              ///< forces and limits of tendons that are no coupling of two joints
  kActuators,            ///< actuators that pull by themselves and are no servo of one joint
  kJointForces,          ///< springs and limits of ball joints and the like
  kEqualities,           ///< equality constraints that are no closure and no coupling
};
/// "fluid", "tendons", "actuators", "joint_forces", "equalities".
const char* leave_out_name(LeaveOut what);
/// The reverse; nothing for an unknown name.
std::optional<LeaveOut> leave_out_from_name(const std::string& name);

struct MjcfOptions : ModelFileOptions {
  std::set<LeaveOut> leave_out;
};

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

/// Reads an MJCF file (docs/reference/mjcf.md). @throws InputError naming file, line, element, what was
/// expected and what to do, also for what the engine does not have and would change the motion.
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

}  // namespace counterpoint
