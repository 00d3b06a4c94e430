// Recordings of real motions: which column is which coordinate of a scene (a YAML column map,
// docs/reference/recording-format.md), and the recording read through it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/motion_files.h"
#include "counterpoint/model/scene.h"

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
  /// Velocities after an impact. Where there are any, a row is an impact: `entries` are before it,
  /// and there is no time.
  std::vector<Entry> after;
  std::vector<std::string> skip;  ///< rows of impacts with anything but 0 there are left out
  int free_body = -1;          ///< body whose pose is compared; -1: the mapped joint positions are
  std::optional<double> rate;  ///< [1/s]; else `time` holds
  ColumnSource time;
  std::optional<int> substeps;  ///< time steps between two rows
  /// Recorded velocities are backward differences of the positions: v(t) is the mean over the
  /// interval before t. A body under gravity g is by then g interval / 2 faster.
  bool backward_difference = false;
  /// Recorded angular velocities of floating and spherical joints are in world axes, not in the
  /// body's; turned by the recorded orientation.
  bool world_angular = false;
  int average = 1;  ///< rows, centred and odd, of which a value is the mean
  int pieces = 1;   ///< as many recordings of equal length one file gives
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

/// The recordings of a file: one, as many as the map cuts it into, or one for each impact; then
/// their names say which part it is. Of an impact both rows are at the pose and the time before.
/// @throws InputError naming file, line, column: as Table, and for fewer than two rows a
/// recording, time not rising, quaternions that are not of unit length (1e-3; they are normalised).
std::vector<Recording> read_recordings(const std::filesystem::path& file, const ColumnMap& map,
                                       const Model& model, const VectorX& start_q,
                                       const VectorX& start_v);

/// Those of several files, with the scene's start where the map names nothing.
std::vector<Recording> read_all(const std::vector<std::string>& files, const ColumnMap& map,
                                const Scene& scene);

}  // namespace counterpoint::apps
