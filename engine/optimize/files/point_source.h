// Motions to follow, as places and orientations of named points over time. Internal header.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "counterpoint/engine/optimize/reference.h"
#include "counterpoint/model/scene.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::optimization {

/// A point of a motion at the times of its source, in the source's axes.
struct PointTrack {
  MatrixX position;     ///< 3 x times [m]; NaN where the point was not seen
  MatrixX orientation;  ///< 4 x times, unit quaternions w x y z; without columns: unknown
  Quaternion rest = Quaternion::Identity();  ///< orientation in the posture at rest
};

class PointSource {
 public:
  explicit PointSource(std::vector<double> time) : time_(std::move(time)) {}
  virtual ~PointSource() = default;
  const std::vector<double>& time() const { return time_; }  ///< [s], ascending
  /// Returns the track of a point, or of a place [m] in the axes of a link or joint of this name.
  /// @throws InputError at `in` if there is none, or a place is asked of a point without axes.
  virtual PointTrack track(const YamlValue& in, const std::string& name,
                           const Vector3& place) const = 0;

 private:
  std::vector<double> time_;
};

/// The links of a scene that moves along samples of its configuration.
std::unique_ptr<PointSource> links_of(std::shared_ptr<const Scene> scene, const Samples& samples);

/// The points of a table with columns NAME.x, NAME.y, NAME.z and perhaps NAME.qw ... NAME.qz:
/// markers, whose empty cells are gaps, or joints of a skeleton, at rest where no joint turns.
/// unit: length in the table [m]. @throws InputError at `in` for a damaged table.
std::unique_ptr<PointSource> points_of(const YamlValue& in, const std::filesystem::path& file,
                                       double unit);

}  // namespace counterpoint::optimization
