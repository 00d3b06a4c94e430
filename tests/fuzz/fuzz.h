// Common part of the fuzz targets: bytes become a file, a parser reads it, and the only allowed
// exception is InputError.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "counterpoint/model/model.h"

namespace counterpoint::fuzz {

/// Folder of this process for files, in memory if the system has such a folder.
const std::filesystem::path& folder();

/// Writes a file into folder() and returns its path.
std::filesystem::path write(const char* name, std::string_view content);

/// Aborts if an accepted model contains an impossible number, that is, if it is silently wrong.
void check(const Model& model);

/// Runs the parser under test on one input. Each target defines it.
void read(std::string_view input);

}  // namespace counterpoint::fuzz
