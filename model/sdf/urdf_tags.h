// Elements of a URDF's <gazebo>, which are SDF.
#pragma once

#include "counterpoint/model/robot_files.h"

namespace counterpoint::sdf_file {

/// Adds what `text` says, an SDF world of models with one <sensor> or <plugin> of `file` each. The
/// sensor of a model is that of the link or joint of the robot in `references`. Without libsdformat
/// they are noted. @throws InputError as load_sdf.
void read_urdf_tags(const std::filesystem::path& file, const std::string& text,
                    const std::vector<std::string>& references, RobotSpec& robot,
                    ModelParts& parts);

}  // namespace counterpoint::sdf_file
