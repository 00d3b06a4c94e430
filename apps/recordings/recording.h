// Recordings of real motions: which column is which coordinate of a scene (a YAML column map,
// docs/recordings.md), and the recording read through it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/csv.h"
#include "counterpoint/model/model.h"

namespace counterpoint::apps {

/// Value of one coordinate: scale * column + offset, or a constant where `column` is empty.
struct ColumnSource {
  std::string column;
  double scale = 1.0;
  double offset = 0.0;
};

struct ColumnMap {
  /// One coordinate of the scene fed by the recording.
  struct Entry {
    enum class Kind { kPosition, kVelocity, kForce };
    Kind kind = Kind::kPosition;
    int index = 0;     ///< into q, v or the applied force
    std::string name;  ///< as in a trajectory
    ColumnSource source;
  };
  std::vector<Entry> entries;
  int free_body = -1;          ///< body whose pose is compared; -1: the mapped joint positions are
  std::optional<double> rate;  ///< [1/s]; else `time` holds
  ColumnSource time;
  std::optional<int> substeps;  ///< time steps between two rows
  /// Recorded velocities are backward differences of the positions: v(t) is the mean over the
  /// interval before t. A body under gravity g is by then g interval / 2 faster.
  bool backward_difference = false;
};

/// @throws InputError naming file, line, key, what was expected.
ColumnMap load_column_map(const std::filesystem::path& file, const Model& model);

/// A recording as coordinates of the scene. Column k is row k.
struct Recording {
  std::string file;
  std::vector<double> time;  ///< [s]
  MatrixX q, v;              ///< coordinates the map does not name are the scene's start
  MatrixX applied_force;     ///< zero where the map names none
  int num_rows() const { return static_cast<int>(time.size()); }
};

/// @throws InputError naming file, line, column: as CsvTable, and for fewer than two rows, time not
/// rising, quaternions that are not of unit length (1e-3; they are normalised).
Recording read_recording(const std::filesystem::path& file, const ColumnMap& map,
                         const Model& model, const VectorX& start_q, const VectorX& start_v);

}  // namespace counterpoint::apps
