// The motion that a problem with the key `retarget` follows. Internal header.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/optimize/files/point_source.h"
#include "counterpoint/engine/optimize/reference.h"
#include "counterpoint/engine/optimize/retarget.h"
#include "counterpoint/model/scene.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::optimization {

class SourceMotion {
 public:
  /// in: the map `retarget`. given: files that replace those of the map. own: scene of the robot,
  /// which is also that of the motion if no other one is named.
  SourceMotion(const YamlValue& in, const SourceFiles& given, std::shared_ptr<const Scene> own,
               const std::filesystem::path& problem_file);

  /// True for the target `source` of a configuration.
  static bool is_target(const YamlValue& target) { return target.is_text("source"); }
  /// Returns the reference of a configuration.
  std::shared_ptr<const Reference> configuration(const YamlValue& target) const;
  /// Returns a term for each point of the map that `sources`, a name or pattern or a list of them,
  /// names: `common` with the point's link, place and reference.
  std::vector<Term> terms(const YamlValue& sources, const Term& common) const;
  const std::filesystem::path& motion_file() const { return motion_file_; }
  const std::filesystem::path& scene_file() const { return scene_file_; }

 private:
  /// An entry of `map`: a point of the motion, and the point of the robot that follows it.
  struct Follower {
    YamlValue in;
    std::string source;
    int body = 0;
    Vector3 point = Vector3::Zero();         ///< in the body frame [m]
    Vector3 source_point = Vector3::Zero();  ///< in the axes of the source's link or joint [m]
    /// The distance from this other point of the motion is scaled by `scale`; empty: none.
    std::string from = {};
    double scale = 1.0;
  };

  void open(const YamlValue& in);
  double read_unit(const YamlValue& in) const;
  void read_axes(const YamlValue& in);
  void read_map(const YamlValue& in);
  Follower read_follower(const std::string& source, const YamlValue& in) const;
  void attach(const YamlValue& in, const std::string& where, const std::string& link,
              Follower& out) const;
  MatrixX positions(const Follower& follower) const;
  MatrixX orientations(const Follower& follower) const;

  std::shared_ptr<const Scene> own_, scene_;
  std::filesystem::path problem_folder_, motion_file_, scene_file_;
  Playback playback_;
  double scale_ = 1.0;   ///< factor of positions, from the world's origin on the ground
  double ground_ = 0.0;  ///< height of the ground in the motion [m]
  VectorX posture_;      ///< nq: pose of the robot that is the motion's posture at rest
  Matrix3 axes_ = Matrix3::Identity();  ///< from the motion's axes to those of the world
  std::optional<Samples> coordinates_;  ///< configurations of `scene_`, unless it is of points
  std::unique_ptr<PointSource> source_;
  std::vector<Follower> map_;
};

}  // namespace counterpoint::optimization
