// Replaces hdf5_format.cc in builds without the HDF5 library.
#include <fmt/format.h>

#include "counterpoint/engine/io/table_format.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file) {
  throw InputError(fmt::format(
      "{}: this build has no HDF5: install libhdf5-dev and configure again, or take .npz, "
      ".mcap or .csv",
      file.string()));
}

}  // namespace

std::unique_ptr<TableSource> open_hdf5(const std::filesystem::path& file, const TableOptions&) {
  refuse(file);
}

std::unique_ptr<TableSink> create_hdf5(const std::filesystem::path& file,
                                       const std::vector<Column>&) {
  refuse(file);
}

}  // namespace counterpoint
