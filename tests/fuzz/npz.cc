// Tables as NumPy's .npz: as a trajectory of a small model, and as such.
#include "fuzz/fuzz.h"
#include "fuzz/small_model.h"
#include "fuzz/tables.h"

namespace counterpoint::fuzz {

void read(std::string_view input) {
  const std::filesystem::path file = write("table.npz", input);
  read_as_trajectory(file, small_model());
  const Table table(file);
  for (int row = 0; row < table.num_rows(); ++row) {
    for (int column = 0; column < table.num_columns(); ++column) table.cell(row, column);
  }
}

}  // namespace counterpoint::fuzz
