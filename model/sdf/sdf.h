// SDF, Gazebo's format of models and worlds: what is read of it, and how it goes into a scene.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/model/builder/model_parts.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {

using SdfOptions = ModelFileOptions;

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

}  // namespace counterpoint
