// What varies, as a study file says it.
#pragma once

#include "counterpoint/model/text_files.h"
#include "study.h"

namespace counterpoint::apps::sweep {

/// One entry of `vary`. Every value of a list is tried on the study's scene. @throws InputError
/// with file and line.
Axis read_axis(const std::string& name, const YamlValue& value, const Study& study);

/// A file named in a study: as given where that is absolute, else beside the study. @throws
/// InputError where there is none.
std::string file_beside(const YamlValue& value, const std::filesystem::path& study);

}  // namespace counterpoint::apps::sweep
