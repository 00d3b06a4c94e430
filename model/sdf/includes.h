// <include> of SDF files: which files they mean, and whether these may be opened.
#pragma once

#include <filesystem>
#include <sdf/ParserConfig.hh>
#include <string>
#include <vector>

#include "counterpoint/model/model.h"
#include "counterpoint/model/robot_files.h"

namespace counterpoint::sdf_file {

/// Tells libsdformat where every included file lies, so that it opens these and no other; it would
/// look in the current folder and in paths of the environment. `text`: the file's. Notes where a
/// file was found by the end of its path. @throws InputError with file and line for files that are
/// missing or lie outside the folders that the file may reach (find_mesh), includes in a circle,
/// and where one name means two files.
void resolve_includes(const std::filesystem::path& file, const std::string& text,
                      const SdfOptions& options, sdf::ParserConfig& config,
                      std::vector<Note>& notes);

}  // namespace counterpoint::sdf_file
