#pragma once

#include <string>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// xacro's $(optenv NAME default ...) becomes its default; the environment is not asked, so that a
/// file means the same everywhere. Each is noted.
std::string expand_optenv(const std::string& text, const std::string& file,
                          std::vector<Note>& notes);

}  // namespace counterpoint
