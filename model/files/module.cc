#include "counterpoint/model/files/module.h"

#include <dlfcn.h>

namespace counterpoint {
namespace {

struct Description {
  const char* name;
  const char* reads;
  const char* package;  ///< Debian package without which it is not built
  bool built;
};

Description describe(Module module) {
  switch (module) {
    case Module::kSdf:
      return {"sdf", "SDF", "libsdformat-dev", COUNTERPOINT_HAS_SDF != 0};
    case Module::kMeshes:
      return {"meshes", "meshes", "libassimp-dev", true};
    case Module::kHdf5:
      return {"hdf5", "HDF5", "libhdf5-dev", COUNTERPOINT_HAS_HDF5 != 0};
  }
  return {};
}

}  // namespace

const void* find_module(Module module, std::string& fault) {
  const auto [name, reads, package, built] = describe(module);
  if (!built) {
    fault = fmt::format(
        "this program was built without {}; install {} and build again (scripts/setup.sh)", reads,
        package);
    return nullptr;
  }
  // Searched in the folders that the program was linked with, then as all shared libraries are. The
  // version in the symbol keeps a program from using the module of another version.
  const std::string file = fmt::format("libcounterpoint_{}.so", name);
  const std::string symbol = fmt::format("counterpoint_{}_" COUNTERPOINT_MODULE_VERSION, name);
  void* const library = dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL);
  const void* const table = library != nullptr ? dlsym(library, symbol.c_str()) : nullptr;
  if (table == nullptr) {
    const char* const why = dlerror();
    fault = fmt::format(
        "a part of this program cannot be opened ({}); install the program again, or put the "
        "folder of {} into LD_LIBRARY_PATH",
        why != nullptr ? why : "no reason given", file);
  }
  return table;
}

}  // namespace counterpoint
