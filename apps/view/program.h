// The page's program, as the build packed it from page/ (CMakeLists.txt).
#pragma once

namespace counterpoint::view {

/// JavaScript; empty where it could not be built.
const char* program();
/// Why it could not be built.
const char* program_missing();

}  // namespace counterpoint::view
