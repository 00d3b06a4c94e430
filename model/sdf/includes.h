// <include> of SDF files: which files they mean, and whether these may be opened.
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

/// Tells libsdformat where every included file lies, so that it opens these and no other; it would
/// look in the current folder and in paths of the environment. `text`: the file's. Notes where a
/// file was found by the end of its path. @throws InputError with file and line for files that are
/// missing or lie outside the folders that the file may reach (find_mesh), includes in a circle,
/// and where one name means two files.
/// Returns the text with the sun and the ground plane of Gazebo's model library written out where
/// no folder holds them, lines as they were.
std::string resolve_includes(const std::filesystem::path& file, const std::string& text,
                             const SdfOptions& options, sdf::ParserConfig& config,
                             std::vector<Note>& notes);

/// What stands for an <include> of Gazebo's model library: "" for the sun, a model for the ground
/// plane; nothing for any other. `uri`: model://NAME, or an address of Fuel.
std::optional<std::string> library_model(const std::string& uri,
                                         const tinyxml2::XMLElement& include);
/// A text whose includes, counted in its order from 0, are replaced; lines stay where they are.
std::string with_includes_replaced(const std::string& text,
                                   const std::map<std::size_t, std::string>& by_number);

}  // namespace counterpoint::sdf_file
