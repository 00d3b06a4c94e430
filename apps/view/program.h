// The page's JavaScript program, which the build bundles from page/ (CMakeLists.txt).
#pragma once

namespace counterpoint::view {

/// Returns the program; empty if it could not be built.
const char* program();
/// Returns the reason why it could not be built.
const char* program_missing();

}  // namespace counterpoint::view
