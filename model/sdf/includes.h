// <include> of SDF files: finds the included files and checks that they may be opened.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <sdf/ParserConfig.hh>
#include <string>
#include <vector>

#include "counterpoint/model/model.h"
#include "counterpoint/model/robot_files.h"

namespace tinyxml2 {
class XMLElement;
}

namespace counterpoint::sdf_file {

/// Attributes of SDF versions after 1.9 that libsdformat 12 drops, by later_key().
using LaterAttributes = std::map<std::string, std::string>;
/// Key of an attribute: file, line and name of its element, and its own name.
std::string later_key(const std::filesystem::path& file, int line, const std::string& element,
                      const std::string& attribute);

/// Tells libsdformat where each included file lies, so that it opens no other; by itself it
/// searches the current folder and the paths of environment variables. `text`: content of `file`.
/// Notes each file that was found only by the end of its path. @throws InputError with file and
/// line for included files that are missing or outside the folders that the file may reach
/// (find_mesh), for circular includes, and for one name that means two files.
/// Collects `auto` of <inertial> and `optimization` of <mesh> in `later`. Returns the text with the
/// sun and the ground plane of Gazebo's model library inserted where no folder holds them; line
/// numbers stay the same.
std::string resolve_includes(const std::filesystem::path& file, const std::string& text,
                             const SdfOptions& options, sdf::ParserConfig& config,
                             std::vector<Note>& notes, LaterAttributes& later);

/// Replacement for an <include> from Gazebo's model library: "" for the sun, a model for the ground
/// plane, nothing for any other. `uri`: model://NAME, or an address on Fuel.
std::optional<std::string> library_model(const std::string& uri,
                                         const tinyxml2::XMLElement& include);
/// Replaces includes, numbered from 0 in the order of the text; line numbers stay the same.
std::string with_includes_replaced(const std::string& text,
                                   const std::map<std::size_t, std::string>& by_number);

}  // namespace counterpoint::sdf_file
