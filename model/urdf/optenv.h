#pragma once

#include <string>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// Replaces xacro's $(optenv NAME default ...) by its default and notes each. The environment is
/// not read, so that a file means the same everywhere.
std::string expand_optenv(const std::string& text, const std::string& file,
                          std::vector<Note>& notes);

}  // namespace counterpoint
