// What every fuzz target shares: bytes become a file, a parser reads it, and only an InputError may
// come out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "counterpoint/model/model.h"

namespace counterpoint::fuzz {

/// This process's folder for files, in memory where the system has such a place.
const std::filesystem::path& folder();

/// Writes a file into folder() and returns its path.
std::filesystem::path write(const char* name, std::string_view content);

/// Aborts if a model that was accepted holds a number that no model can: a silently wrong model.
void check(const Model& model);

/// The parser under test, given the bytes of one input. Defined by each target.
void read(std::string_view input);

}  // namespace counterpoint::fuzz
