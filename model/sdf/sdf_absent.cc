// Replaces the SDF reader in builds without libsdformat.
#include <fmt/format.h>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/sdf/urdf_tags.h"

namespace counterpoint {

SdfModel load_sdf(const std::filesystem::path& file, const SdfOptions&) {
  throw InputError(
      fmt::format("{}: this program was built without SDF; install libsdformat-dev and "
                  "build again (scripts/setup.sh)",
                  file.string()));
}

namespace sdf_file {

void read_urdf_tags(const std::filesystem::path& file, const std::string&,
                    const std::vector<std::string>& references, RobotSpec& robot, ModelParts&) {
  robot.notes.push_back(
      {file.string(),
       fmt::format("sensors and plugins of <gazebo> ({}) are left out: this program was built "
                   "without SDF; install libsdformat-dev and build again (scripts/setup.sh)",
                   references.size())});
}

}  // namespace sdf_file

}  // namespace counterpoint
