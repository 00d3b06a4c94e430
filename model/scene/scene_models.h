// Entries of `models` in a scene file: robots, objects and their initial state. Private to
// scene_yaml.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/text_files.h"
#include "counterpoint/model/urdf/srdf.h"

namespace counterpoint {

/// Adds the entries of `models` to a builder, one after the other.
class ModelReader {
 public:
  /// `folder` is the base of relative paths. Builder and options must outlive the reader.
  ModelReader(std::filesystem::path folder, const UrdfOptions& urdf_options, ModelBuilder& builder)
      : folder_(std::move(folder)), urdf_options_(urdf_options), builder_(builder) {}

  /// Adds one entry with all its copies. `only_one`: it is the only entry, and needs no prefix if
  /// it has no name.
  void read(const YamlValue& in, bool only_one);

  /// Returns the initial velocities (nv) of the model built from these entries.
  VectorX start_velocities(const Model& model) const;

 private:
  struct Velocity {
    YamlValue value;
    std::string joint;
    std::vector<double> numbers;
  };

  LeavingOptions leaving_options(const YamlValue& in) const;
  static void expect_no_robot_keys(const YamlValue& in, const char* format);
  void read_mjcf(const YamlValue& in, bool only_one);
  void read_sdf(const YamlValue& in, bool only_one);
  void place(const YamlValue& in, bool only_one, const std::string& robot_name, const Pose& X_WL,
             const std::function<void(const Pose&, const std::string&)>& add);
  RobotSpec read_robot(const YamlValue& in, ModelParts& parts) const;
  Srdf read_srdf(const YamlValue& in);
  /// Reads the joint positions and velocities of one copy.
  void read_start(const YamlValue& in, Base base, int first_joint, const std::string& prefix);
  void read_base_velocity(const YamlValue& in, Base base, const std::string& joint);

  std::filesystem::path folder_;
  const UrdfOptions& urdf_options_;
  ModelBuilder& builder_;
  std::vector<Velocity> velocities_;
};

}  // namespace counterpoint
