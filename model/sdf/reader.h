// The reader of SDF, a module (files/module.h).
#pragma once

#include "counterpoint/model/robot_files.h"

namespace counterpoint::sdf_file {

/// See load_sdf.
SdfModel read_model(const std::filesystem::path& file, const SdfOptions& options);
/// See read_urdf_tags.
void read_tags(const std::filesystem::path& file, const std::string& text,
               const std::vector<std::string>& references, RobotSpec& robot, ModelParts& parts);

struct Reader {
  decltype(&read_model) model;
  decltype(&read_tags) tags;
};

}  // namespace counterpoint::sdf_file
