// Reader for the varied quantities of a study file.
#pragma once

#include "counterpoint/model/text_files.h"
#include "study.h"

namespace counterpoint::apps::sweep {

/// Reads one entry of `vary` and tries up to 100 values of a list on the study's scene. @throws
/// InputError with file and line
Axis read_axis(const std::string& name, const YamlValue& value, const Study& study);

/// Resolves a file named in a study: an absolute path as given, else relative to the study. @throws
/// InputError if there is no such file
std::string file_beside(const YamlValue& value, const std::filesystem::path& study);

}  // namespace counterpoint::apps::sweep
