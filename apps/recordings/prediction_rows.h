// A table of recorded beside predicted positions.
#pragma once

#include <memory>
#include <string>

#include "counterpoint/engine/motion_files.h"
#include "recordings/estimation.h"

namespace counterpoint::apps {

/// One row a recorded row: the deviation, then recorded and simulated values of the mapped
/// positions. Of impacts one row a recording: velocities after it.
class PredictionRows {
 public:
  /// The map is kept. An empty file: nothing is written.
  PredictionRows(const std::string& file, const ColumnMap& map);

  void write(const Recording& recording, const Prediction& prediction);
  void finish();

 private:
  void write_impact(const Recording& recording, const Prediction& prediction);
  void write_row(const Recording& recording, int row, const Deviation& deviation, const VectorX& q);

  const ColumnMap& map_;
  std::unique_ptr<TableWriter> table_;
};

}  // namespace counterpoint::apps
