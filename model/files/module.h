// Modules: parts of the program in shared libraries of their own, opened when they are first
// needed, because the libraries behind them take longer to load than a small scene takes to run.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

enum class Module {
  kSdf,     ///< SDF files, by libsdformat
  kMeshes,  ///< mesh files, by assimp
  kHdf5,    ///< tables in HDF5
};

/// Returns the module's table of functions; null, with the reason in `fault`, if there is none.
const void* find_module(Module module, std::string& fault);

/// Returns the table of the module that reads or writes `file`. @throws InputError naming the file
/// if there is none.
template <class Table>
const Table& open_module(Module module, const std::filesystem::path& file) {
  std::string fault;
  const void* const table = find_module(module, fault);
  if (table == nullptr) throw InputError(fmt::format("{}: {}", file.string(), fault));
  return *static_cast<const Table*>(table);
}

}  // namespace counterpoint
