#include <fmt/format.h>

#include "counterpoint/model/files/module.h"
#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/sdf/reader.h"
#include "counterpoint/model/sdf/urdf_tags.h"

namespace counterpoint {

SdfModel load_sdf(const std::filesystem::path& file, const SdfOptions& options) {
  return open_module<sdf_file::Reader>(Module::kSdf, file).model(file, options);
}

void sdf_file::read_urdf_tags(const std::filesystem::path& file, const std::string& text,
                              const std::vector<std::string>& references, RobotSpec& robot,
                              ModelParts& parts) {
  std::string fault;
  if (const void* const reader = find_module(Module::kSdf, fault))
    return static_cast<const Reader*>(reader)->tags(file, text, references, robot, parts);
  robot.notes.push_back(
      {file.string(), fmt::format("sensors and plugins of <gazebo> ({}) are left out: {}",
                                  references.size(), fault)});
}

}  // namespace counterpoint
