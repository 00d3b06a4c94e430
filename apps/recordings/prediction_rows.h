// Table of recorded and predicted positions.
#pragma once

#include <memory>
#include <string>

#include "counterpoint/engine/tables.h"
#include "recordings/estimation.h"

namespace counterpoint::apps {

/// One row per recorded row: the deviation, then simulated and recorded values of the mapped
/// positions and sensors. For impacts, one row per recording with the velocities after it.
class PredictionRows {
 public:
  /// Keeps a reference to `map`. Writes nothing if `file` is empty.
  PredictionRows(const std::string& file, const ColumnMap& map);

  void write(const Recording& recording, const Prediction& prediction);
  void finish();

 private:
  void write_impact(const Recording& recording, const Prediction& prediction);
  void write_row(const Recording& recording, int row, const Deviation& deviation,
                 const Prediction& prediction);

  const ColumnMap& map_;
  std::unique_ptr<TableWriter> table_;
};

}  // namespace counterpoint::apps
