#pragma once

#include <string>

namespace counterpoint::apps {

/// Returns version, build type, compiler, flags, instruction sets of this processor, and optional
/// parts, a line each.
std::string version_text();

}  // namespace counterpoint::apps
