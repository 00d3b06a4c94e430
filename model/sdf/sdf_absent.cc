// Replaces the SDF reader in builds without libsdformat.
#include <fmt/format.h>

#include "counterpoint/model/robot_files.h"

namespace counterpoint {

SdfModel load_sdf(const std::filesystem::path& file, const SdfOptions&) {
  throw InputError(
      fmt::format("{}: this program was built without SDF; install libsdformat-dev and "
                  "build again (scripts/setup.sh)",
                  file.string()));
}

}  // namespace counterpoint
