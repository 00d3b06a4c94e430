#pragma once

#include <string>

namespace counterpoint::apps {

/// Version, build type, compiler, flags, what this processor has, optional parts; a line each.
std::string version_text();

}  // namespace counterpoint::apps
