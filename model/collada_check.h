// A look at a Collada file before assimp reads it.
#pragma once

#include <filesystem>

namespace counterpoint {

/// Assimp's reader trusts the numbers of a Collada file: it crashes, or reads without end, where they are
/// none or point beyond the arrays. @throws InputError with file and line for XML that is not well-formed,
/// lists that are not of numbers or not of the length they should have, references to nothing, and
/// indices out of range.
void check_collada(const std::filesystem::path& file);

}  // namespace counterpoint
