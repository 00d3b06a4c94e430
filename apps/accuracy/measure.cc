#include "measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "measure/median.h"
#include "report/progress.h"

namespace counterpoint::apps::accuracy {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Errors of one run of all pieces; false if one failed.
bool run_for_error(EngineAdapter& adapter, const Model& model, const Plan& plan, const Reference& reference,
                   Point& point) {
  double seconds = 0.0;
  for (const Piece& piece : reference.pieces) {
    const Passage passage = adapter.advance(piece.start, plan.length);
    seconds += passage.seconds;
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
  point.cost = point.cost_low = point.cost_high = seconds / (plan.length * count);
  return point.failed == 0;
}

/// A point whose time is to be taken: the pieces by its adapter.
struct Timing {
  size_t family = 0, point = 0;
  std::unique_ptr<EngineAdapter> adapter;
  std::vector<double> costs;
};

void run_for_time(const Plan& plan, const Reference& reference, Timing& timing) {
  double seconds = 0.0;
  for (const Piece& piece : reference.pieces)
    seconds += timing.adapter->advance(piece.start, plan.length).seconds;
  timing.costs.push_back(seconds / (plan.length * static_cast<double>(reference.pieces.size())));
}

void set_cost(Timing& timing, Point& point) {
  std::vector<double>& costs = timing.costs;
  if (costs.empty()) return;  // stopped: that of the first run stands
  std::sort(costs.begin(), costs.end());
  point.cost = median(costs);
  point.cost_low = costs.front();
  point.cost_high = costs.back();
}

/// The point without its time; the adapter that it is to be taken of, unless it failed.
Point measure_point(const Scene& scene, const Plan& plan, const Reference& reference,
                    const Setting& setting, const MeasureOptions& options,
                    std::unique_ptr<EngineAdapter>& adapter) {
  Point point;
  point.setting = setting;
  adapter = setting.make();
  if (!run_for_error(*adapter, scene.model, plan, reference, point)) {
    point.error = {kNaN, kNaN, kNaN};
    point.worst = point.cost = point.cost_low = point.cost_high = kNaN;
    adapter.reset();
    return point;
  }
  const bool at_scene_step =
      setting.engine && std::abs(setting.engine->options.time_step / plan.time_step - 1.0) < 1e-9;
  if (at_scene_step) add_physics(scene, plan, reference, options, point);
  return point;
}

/// The same pieces with the ends of the family's own fine run.
Reference own_reference(const Scene& scene, const Plan& plan, const Reference& reference,
                        MeasuredFamily& measured) {
  Reference own = reference;
  const auto fine = measured.family.own(reference.time_step);
  const auto coarse = measured.family.own(2.0 * reference.time_step);
  double apart = 0.0, error = 0.0;
  for (Piece& piece : own.pieces) {
    const Passage end = fine->advance(piece.start, plan.length);
    const Passage twice = coarse->advance(piece.start, plan.length);
    for (const Passage* run : {&end, &twice})
      if (!run->failure.empty()) throw std::runtime_error("its own fine run: " + run->failure);
    apart += deviation(scene.model, piece.end.q, end.end.q).all;
    error += deviation(scene.model, end.end.q, twice.end.q).all;
    piece.end = end.end;
  }
  const auto count = static_cast<double>(own.pieces.size());
  measured.own_apart = apart / count;
  measured.own_error = own.error = error / count;
  return own;
}

bool same_settings(const Family& a, const Family& b) {
  return a.settings.size() == b.settings.size() &&
         std::equal(
             a.settings.begin(), a.settings.end(), b.settings.begin(),
             [](const Setting& x, const Setting& y) { return !x.key.empty() && x.key == y.key; });
}

/// Points with an earlier one's key are that one.
void copy_known(const std::map<std::string, Place>& known, std::vector<MeasuredFamily>& out) {
  for (size_t f = 0; f < out.size(); ++f) {
    for (size_t p = 0; p < out[f].points.size(); ++p) {
      const std::string& key = out[f].points[p].setting.key;
      if (key.empty()) continue;
      const Place& first = known.at(key);
      if (first == Place{f, p}) continue;
      const Setting setting = out[f].points[p].setting;
      out[f].points[p] = out[first.family].points[first.point];
      out[f].points[p].setting = setting;
    }
  }
}

bool stopped(const MeasureOptions& options) { return options.stop && options.stop(); }

/// Round after round over all of them, so that what else the machine does meets all alike.
void run_rounds(const Plan& plan, const Reference& reference, const MeasureOptions& options,
                std::vector<Timing>& timings) {
  Progress progress("timing", options.repeats * static_cast<int>(timings.size()));
  int done = 0;
  for (int round = 0; round < options.repeats; ++round) {
    for (Timing& timing : timings) {
      if (stopped(options)) return;
      run_for_time(plan, reference, timing);
      progress.update(++done);
    }
  }
}

}  // namespace

std::vector<MeasuredFamily> measure(const Scene& scene, const Plan& plan,
                                    const Reference& reference, const std::vector<Family>& families,
                                    const MeasureOptions& options) {
  size_t total = 0, done = 0;
  for (const Family& family : families) total += family.settings.size();
  Progress progress("measuring", static_cast<int>(total));
  std::map<std::string, Place> known;
  std::vector<Timing> timings;
  std::vector<MeasuredFamily> out;
  for (const Family& family : families) {
    if (stopped(options)) break;
    MeasuredFamily measured{family, {}, {}, {}};
    for (const MeasuredFamily& earlier : out)
      if (measured.same_as.empty() && same_settings(earlier.family, family))
        measured.same_as = earlier.family.name;
    const size_t timings_before = timings.size();
    try {
      const Reference mine =
          family.own ? own_reference(scene, plan, reference, measured) : reference;
      for (const Setting& setting : family.settings) {
        if (stopped(options)) break;
        const auto found = setting.key.empty() ? known.end() : known.find(setting.key);
        if (found != known.end()) {
          measured.points.push_back({});  // filled in when all is known
        } else {
          std::unique_ptr<EngineAdapter> adapter;
          measured.points.push_back(measure_point(scene, plan, mine, setting, options, adapter));
          const Place here{out.size(), measured.points.size() - 1};
          if (adapter) timings.push_back({here.family, here.point, std::move(adapter), {}});
          if (!setting.key.empty()) known[setting.key] = here;
        }
        measured.points.back().setting = setting;
        progress.update(static_cast<int>(++done));
      }
    } catch (const std::runtime_error& why) {  // the engine lacks what the scene needs
      measured.points.clear();
      timings.resize(timings_before);
      std::erase_if(known, [&](const auto& entry) { return entry.second.family == out.size(); });
      measured.refused = why.what();
    }
    if (!measured.points.empty() || !measured.refused.empty()) out.push_back(std::move(measured));
  }
  progress.wipe();
  run_rounds(plan, reference, options, timings);
  for (Timing& timing : timings) set_cost(timing, out[timing.family].points[timing.point]);
  copy_known(known, out);
  return out;
}

void add_physics(const Scene& scene, const Plan& plan, const Reference& reference,
                 const MeasureOptions& options, Point& point) {
  if (!options.physics || !point.setting.engine || !point.measured() || point.physics) return;
  point.physics =
      measure_physics(scene, *point.setting.engine, plan, reference.pieces, options.contacts);
}

}  // namespace counterpoint::apps::accuracy
