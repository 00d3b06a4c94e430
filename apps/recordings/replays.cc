#include "replays.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "report/report.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

/// The predicted or recorded motion over the rows that were predicted.
view::Clip clip_of(const Recording& recording, const Prediction& prediction, bool recorded,
                   double rate) {
  view::Clip clip;
  clip.name = recorded ? "recorded" : "simulated";
  clip.rows = recording.num_rows();
  const double end = prediction.time.empty() ? recording.time[0] : prediction.time.back();
  view::FrameClock clock(rate);
  for (int row = 0; row < recording.num_rows() && recording.time[row] <= end; ++row) {
    if (!clock.due(recording.time[row]) && recording.time[row] < end) continue;
    const VectorX q = recorded ? VectorX(recording.q.col(row)) : VectorX(prediction.q.col(row));
    clip.states.push_back({recording.time[row], q, VectorX()});
  }
  return clip;
}

}  // namespace

Replays::Replays(const Scene& scene, const std::string& scene_file, const std::string& map,
                 const std::vector<Recording>& recordings,
                 const std::vector<Prediction>& predictions, Compared by)
    : scene_(scene),
      scene_file_(scene_file),
      map_(map),
      recordings_(recordings),
      predictions_(predictions),
      impacts_(by == Compared::kImpacts),
      worst_first_(predictions.size()) {
  const auto error = [&](size_t i) {
    const Deviation& mean = predictions[i].mean;
    return by == Compared::kPose ? mean.position : mean.joints;
  };
  std::iota(worst_first_.begin(), worst_first_.end(), size_t{0});
  std::stable_sort(worst_first_.begin(), worst_first_.end(),
                   [&](size_t a, size_t b) { return error(a) > error(b); });
}

void Replays::write(size_t recording, const std::filesystem::path& file, double rate) const {
  view::Origin origin{scene_file_, {map_, recordings_[recording].file}};
  view::write_replay(file, scene_, origin,
                     clip_of(recordings_[recording], predictions_[recording], false, rate),
                     {clip_of(recordings_[recording], predictions_[recording], true, rate)});
}

void Replays::write_worst(const std::filesystem::path& file, double rate) const {
  if (impacts_) throw InputError("--view: an impact takes no time, there is no motion to show");
  write(worst_first_[0], file, rate);
}

bool Replays::can_write() const { return !impacts_ && view::can_make_pages(); }

}  // namespace counterpoint::apps
