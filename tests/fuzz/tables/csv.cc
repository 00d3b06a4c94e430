// CSV files as plain tables, as trajectories of a small model, and as its inputs.
#include "apps/input/inputs.h"
#include "fuzz/fuzz.h"
#include "fuzz/small_model.h"
#include "fuzz/tables/read_table.h"

namespace counterpoint::fuzz {

void read(std::string_view input) {
  const std::filesystem::path file = write("table.csv", input);
  const Model& model = small_model();
  read_as_trajectory(file, model);
  try_read([&] {
    apps::InputSchedule schedule(file, model);
    Input applied;
    for (const double time : {-1.0, 0.0, 0.5, 1e300}) {
      applied.applied_force.setZero(model.nv());
      schedule.apply(model, time, 0.0, applied);
      if (!applied.applied_force.allFinite()) std::abort();
    }
  });
  const Table table(file);
  for (int row = 0; row < table.num_rows(); ++row) {
    for (int column = 0; column < table.num_columns(); ++column) table.cell(row, column);
  }
}

}  // namespace counterpoint::fuzz
