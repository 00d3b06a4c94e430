#include "measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "progress.h"

namespace counterpoint::apps::accuracy {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Errors of one run of all pieces; false if one failed.
bool run_for_error(Mover& mover, const Model& model, const Plan& plan, const Reference& reference,
                   Point& point) {
  for (const Piece& piece : reference.pieces) {
    const Passage passage = mover.advance(piece.start, plan.length);
    point.steps += passage.steps;
    if (!passage.failure.empty()) {
      if (point.failed++ == 0) point.failure = passage.failure;
      continue;
    }
    const Deviation d = deviation(model, piece.end.q, passage.end.q);
    point.error.all += d.all;
    point.error.length += d.length;
    point.error.angle += d.angle;
    point.piece_errors.push_back(d.all);
    point.worst = std::max(point.worst, d.all);
  }
  const auto count = static_cast<double>(reference.pieces.size());
  for (double* value : {&point.error.all, &point.error.length, &point.error.angle}) *value /= count;
  return point.failed == 0;
}

void run_for_time(Mover& mover, const Plan& plan, const Reference& reference, int repeats,
                  Point& point) {
  std::vector<double> costs;
  for (int i = 0; i < repeats; ++i) {
    double seconds = 0.0;
    for (const Piece& piece : reference.pieces)
      seconds += mover.advance(piece.start, plan.length).seconds;
    costs.push_back(seconds / (plan.length * static_cast<double>(reference.pieces.size())));
  }
  std::sort(costs.begin(), costs.end());
  const size_t n = costs.size();
  point.cost = n % 2 == 1 ? costs[n / 2] : 0.5 * (costs[n / 2 - 1] + costs[n / 2]);
  point.cost_low = costs.front();
  point.cost_high = costs.back();
}

Point measure_point(const Scene& scene, const Plan& plan, const Reference& reference,
                    const Setting& setting, const MeasureOptions& options) {
  Point point;
  point.setting = setting;
  const std::unique_ptr<Mover> mover = setting.make();
  if (!run_for_error(*mover, scene.model, plan, reference, point)) {
    point.error = {kNaN, kNaN, kNaN};
    point.worst = point.cost = point.cost_low = point.cost_high = kNaN;
    return point;
  }
  run_for_time(*mover, plan, reference, options.repeats, point);
  const bool at_scene_step =
      setting.engine && std::abs(setting.engine->options.time_step / plan.time_step - 1.0) < 1e-9;
  if (at_scene_step) add_physics(scene, plan, reference, options, point);
  return point;
}

bool same_settings(const Family& a, const Family& b) {
  return a.settings.size() == b.settings.size() &&
         std::equal(
             a.settings.begin(), a.settings.end(), b.settings.begin(),
             [](const Setting& x, const Setting& y) { return !x.key.empty() && x.key == y.key; });
}

}  // namespace

std::vector<MeasuredFamily> measure(const Scene& scene, const Plan& plan,
                                    const Reference& reference, const std::vector<Family>& families,
                                    const MeasureOptions& options) {
  size_t total = 0, done = 0;
  for (const Family& family : families) total += family.settings.size();
  Progress progress("measuring", static_cast<int>(total));
  std::map<std::string, Point> known;
  std::vector<MeasuredFamily> out;
  for (const Family& family : families) {
    MeasuredFamily measured{family, {}, {}, {}};
    for (const MeasuredFamily& earlier : out)
      if (measured.same_as.empty() && same_settings(earlier.family, family))
        measured.same_as = earlier.family.name;
    try {
      for (const Setting& setting : family.settings) {
        const auto found = setting.key.empty() ? known.end() : known.find(setting.key);
        if (found != known.end()) {
          measured.points.push_back(found->second);
          measured.points.back().setting = setting;
        } else {
          measured.points.push_back(measure_point(scene, plan, reference, setting, options));
          if (!setting.key.empty()) known[setting.key] = measured.points.back();
        }
        progress.update(static_cast<int>(++done));
      }
    } catch (const std::runtime_error& why) {  // the engine lacks what the scene needs
      measured.points.clear();
      measured.refused = why.what();
    }
    out.push_back(std::move(measured));
  }
  return out;
}

void add_physics(const Scene& scene, const Plan& plan, const Reference& reference,
                 const MeasureOptions& options, Point& point) {
  if (!options.physics || !point.setting.engine || !point.measured() || point.physics) return;
  point.physics =
      measure_physics(scene, *point.setting.engine, plan, reference.pieces, options.contacts);
}

}  // namespace counterpoint::apps::accuracy
