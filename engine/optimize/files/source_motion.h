// The motion that a problem with the key `retarget` follows. Internal header.
#pragma once

#include <memory>
#include <string>
#include <vector>

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

  /// True for a target `source` or {source: ...}.
  static bool is_target(const YamlValue& target) {
    return target.is_text("source") || target.has("source");
  }
  /// Returns the reference of the term with this index among those of an entry.
  std::shared_ptr<const Reference> reference(const YamlValue& target, const Term& term,
                                             std::size_t index) const;
  const std::filesystem::path& motion_file() const { return motion_file_; }
  const std::filesystem::path& scene_file() const { return scene_file_; }

 private:
  MatrixX link_values(const YamlValue& target, const Term& term, const std::string& link) const;

  std::shared_ptr<const Scene> own_, scene_;
  std::filesystem::path motion_file_, scene_file_;
  Playback playback_;
  double scale_ = 1.0;   ///< factor of positions, from the world's origin on the ground
  double ground_ = 0.0;  ///< height of the ground in the motion [m]
  Samples samples_;      ///< configurations of `scene_`
};

}  // namespace counterpoint::optimization
