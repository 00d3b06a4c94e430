#include "pinocchio.h"

#include <dlfcn.h>

#include <stdexcept>

namespace counterpoint::peers {
namespace {

/// The open module, or null. RTLD_DEEPBIND gives priority to its own symbols, because it has its
/// own Eigen.
void* module() {
  static void* const handle = dlopen(COUNTERPOINT_PINOCCHIO_MODULE,  // NOLINT
                                     RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND);
  return handle;
}

template <class Function>
Function* symbol(const char* name) {
  return module() ? reinterpret_cast<Function*>(dlsym(module(), name)) : nullptr;
}

}  // namespace

std::string pinocchio_version() {
  const auto version = symbol<const char*()>("counterpoint_pinocchio_version");
  return version ? version() : "";
}

std::unique_ptr<PinocchioRobot> load_pinocchio(const std::string& urdf, bool floating,
                                               const double* gravity,
                                               PinocchioConvention convention) {
  const auto load =
      symbol<PinocchioRobot*(const char*, bool, const double*, PinocchioConvention, char*, int)>(
          "counterpoint_pinocchio_load");
  if (!load) throw std::runtime_error("Pinocchio was not found when this was built");
  char error[500] = "";
  std::unique_ptr<PinocchioRobot> robot(
      load(urdf.c_str(), floating, gravity, convention, error, sizeof error));
  if (!robot) throw std::runtime_error(urdf + ": Pinocchio: " + error);
  return robot;
}

}  // namespace counterpoint::peers
