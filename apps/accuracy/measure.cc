#include "measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "measure/median.h"
#include "report/progress.h"
#include "tasks/archive.h"

namespace counterpoint::apps::accuracy {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Runs all pieces once and adds up their errors; false if one failed.
bool run_for_error(EngineAdapter& adapter, const Model& model, const Plan& plan,
                   const Reference& reference, Point& point) {
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

/// A setting to be timed: its adapter runs all pieces.
struct Timing {
  std::unique_ptr<EngineAdapter> adapter;
  std::vector<Point*> points;  ///< points with this setting
  std::vector<double> costs;
};

void run_for_time(const Plan& plan, const Reference& reference, Timing& timing) {
  double seconds = 0.0;
  for (const Piece& piece : reference.pieces)
    seconds += timing.adapter->advance(piece.start, plan.length).seconds;
  timing.costs.push_back(seconds / (plan.length * static_cast<double>(reference.pieces.size())));
}

void set_cost(Timing& timing) {
  std::vector<double>& costs = timing.costs;
  if (costs.empty()) return;  // stopped: the cost of the first run stays
  std::sort(costs.begin(), costs.end());
  for (Point* point : timing.points) {
    point->cost = median(costs);
    point->cost_low = costs.front();
    point->cost_high = costs.back();
  }
}

/// The same pieces, ending where the family's own fine run ends.
struct OwnReference {
  Reference reference;
  double apart = 0.0, error = 0.0;  ///< MeasuredFamily::own_apart, own_error
};

OwnReference own_reference(const Scene& scene, const Plan& plan, const Reference& reference,
                           const Family& family, const MeasureOptions& options) {
  OwnReference own{reference};
  const auto fine = family.own(reference.time_step);
  const auto coarse = family.own(2.0 * reference.time_step);
  for (const auto& adapter : {fine.get(), coarse.get()}) adapter->stop_when(options.stop);
  for (Piece& piece : own.reference.pieces) {
    const Passage end = fine->advance(piece.start, plan.length);
    const Passage twice = coarse->advance(piece.start, plan.length);
    for (const Passage* run : {&end, &twice})
      if (!run->failure.empty()) throw std::runtime_error("its own fine run: " + run->failure);
    own.apart += deviation(scene.model, piece.end.q, end.end.q).all;
    own.error += deviation(scene.model, end.end.q, twice.end.q).all;
    piece.end = end.end;
  }
  const auto count = static_cast<double>(own.reference.pieces.size());
  own.apart /= count;
  own.error /= count;
  own.reference.error = own.error;
  return own;
}

/// Result of one setting, without its time.
struct Measurement {
  std::string refused;  ///< why its family cannot run; then nothing else is set
  std::optional<double> own_apart = {}, own_error = {};
  Point point;

  template <class Archive>
  void serialize(Archive& a) {
    a(refused, own_apart, own_error, point.failed, point.failure, tasks::as_in_memory(point.error),
      point.piece_errors, point.worst, point.cost, point.cost_low, point.cost_high, point.steps,
      tasks::as_in_memory(point.physics));
  }
};

/// Worker of one thread that measures errors. All arguments must outlive it.
class ErrorWorker {
 public:
  ErrorWorker(const Scene& scene, const Plan& plan, const Reference& reference,
              const std::vector<Family>& families, const MeasureOptions& options)
      : scene_(scene), plan_(plan), reference_(reference), families_(families), options_(options) {}

  Measurement measure(const Place& place) {
    Measurement out;
    const Family& family = families_[place.family];
    try {
      const Reference* reference = &reference_;
      if (family.own) {
        const OwnReference& own = own_of(place.family);
        out.own_apart = own.apart;
        out.own_error = own.error;
        reference = &own.reference;
      }
      measure(family.settings[place.point], *reference, out.point);
    } catch (const std::runtime_error& why) {  // the engine cannot simulate this scene
      out.refused = why.what();
    }
    return out;
  }

 private:
  void measure(const Setting& setting, const Reference& reference, Point& point) {
    point.setting = setting;
    const auto adapter = setting.make();
    adapter->stop_when(options_.stop);
    if (!run_for_error(*adapter, scene_.model, plan_, reference, point)) {
      point.error = {kNaN, kNaN, kNaN};
      point.worst = point.cost = point.cost_low = point.cost_high = kNaN;
      return;
    }
    const bool at_scene_step =
        setting.engine &&
        std::abs(setting.engine->options.time_step / plan_.time_step - 1.0) < 1e-9;
    if (at_scene_step) add_physics(scene_, plan_, reference, options_, point);
  }
  /// Computed once for all settings of the family that this thread measures.
  const OwnReference& own_of(size_t family) {
    const auto known = own_.find(family);
    if (known != own_.end()) return known->second;
    return own_
        .emplace(family, own_reference(scene_, plan_, reference_, families_[family], options_))
        .first->second;
  }

  const Scene& scene_;
  const Plan& plan_;
  const Reference& reference_;
  const std::vector<Family>& families_;
  const MeasureOptions& options_;
  std::map<size_t, OwnReference> own_;
};

bool same_settings(const Family& a, const Family& b) {
  return a.settings.size() == b.settings.size() &&
         std::equal(
             a.settings.begin(), a.settings.end(), b.settings.begin(),
             [](const Setting& x, const Setting& y) { return !x.key.empty() && x.key == y.key; });
}

/// Times all settings in rounds, so that other load on the machine affects all alike.
void run_rounds(const Plan& plan, const Reference& reference, const MeasureOptions& options,
                std::vector<Timing>& timings) {
  Progress progress("timing", options.repeats * static_cast<int>(timings.size()));
  int done = 0;
  for (Timing& timing : timings) timing.adapter->stop_when(options.stop);
  try {
    for (Timing& timing : timings)  // warm-up
      timing.adapter->advance(reference.pieces.front().start, plan.length);
    for (int round = 0; round < options.repeats; ++round) {
      for (Timing& timing : timings) {
        run_for_time(plan, reference, timing);
        progress.update(++done);
      }
    }
  } catch (const Stopped&) {  // completed rounds are kept
  }
}

/// Numbers of settings by Setting::key.
using NumberByKey = std::map<std::string, size_t>;

/// Number of an earlier setting with this key, or else `next`, which it then gets.
size_t number_of(const std::string& key, size_t next, NumberByKey& known) {
  return key.empty() ? next : known.try_emplace(key, next).first->second;
}

/// Settings to be measured, the first with each key; `numbers` maps each family and setting to
/// them.
struct DistinctSettings {
  std::vector<Place> places;
  std::vector<std::vector<size_t>> numbers;

  explicit DistinctSettings(const std::vector<Family>& families) {
    NumberByKey known;
    for (size_t f = 0; f < families.size(); ++f) {
      numbers.emplace_back();
      for (size_t p = 0; p < families[f].settings.size(); ++p) {
        const size_t number = number_of(families[f].settings[p].key, places.size(), known);
        if (number == places.size()) places.push_back({f, p});
        numbers.back().push_back(number);
      }
    }
  }
};

/// Collects the measurements of a family that are available.
MeasuredFamily gather(const Family& family, const std::vector<size_t>& numbers,
                      const std::vector<std::optional<Measurement>>& measurements) {
  MeasuredFamily out{family, {}, {}, {}};
  for (size_t p = 0; p < numbers.size(); ++p) {
    const std::optional<Measurement>& m = measurements[numbers[p]];
    if (!m) continue;
    if (!m->refused.empty()) {
      out.points.clear();
      out.refused = m->refused;
      break;
    }
    if (family.own) {
      out.own_apart = m->own_apart;
      out.own_error = m->own_error;
    }
    out.points.push_back(m->point);
    out.points.back().setting = family.settings[p];
  }
  return out;
}

}  // namespace

const Point& point_at(const std::vector<MeasuredFamily>& measured, const Place& place) {
  return measured[place.family].points[place.point];
}

std::vector<MeasuredFamily> measure_errors(const Scene& scene, const Plan& plan,
                                           const Reference& reference,
                                           const std::vector<Family>& families,
                                           const MeasureOptions& options) {
  const DistinctSettings settings(families);
  tasks::TaskList list;
  list.name = "settings";
  list.count = static_cast<std::int64_t>(settings.places.size());
  list.fingerprint = options.fingerprint;
  list.make_task = [&]() -> tasks::Task {
    const auto worker = std::make_shared<ErrorWorker>(scene, plan, reference, families, options);
    return [&, worker](std::int64_t i) {
      try {
        const Place& place = settings.places[static_cast<size_t>(i)];
        return tasks::Outcome{tasks::to_bytes(worker->measure(place)), true};
      } catch (const Stopped&) {
        return tasks::Outcome{{}, false};
      }
    };
  };
  std::vector<std::optional<Measurement>> measurements;
  for (const auto& bytes : options.run(list)) {
    measurements.emplace_back();
    if (bytes) measurements.back() = tasks::from_bytes<Measurement>(*bytes);
  }
  std::vector<MeasuredFamily> out;
  for (size_t f = 0; f < families.size(); ++f) {
    MeasuredFamily measured = gather(families[f], settings.numbers[f], measurements);
    for (const MeasuredFamily& earlier : out)
      if (measured.same_as.empty() && same_settings(earlier.family, families[f]))
        measured.same_as = earlier.family.name;
    if (!measured.points.empty() || !measured.refused.empty()) out.push_back(std::move(measured));
  }
  return out;
}

void measure_times(const Plan& plan, const Reference& reference, const MeasureOptions& options,
                   std::vector<MeasuredFamily>& families) {
  NumberByKey known;
  std::vector<Timing> timings;
  for (MeasuredFamily& family : families) {
    for (Point& point : family.points) {
      if (!point.measured()) continue;
      const size_t timing = number_of(point.setting.key, timings.size(), known);
      if (timing == timings.size()) timings.push_back({point.setting.make(), {}, {}});
      timings[timing].points.push_back(&point);
    }
  }
  run_rounds(plan, reference, options, timings);
  for (Timing& timing : timings) set_cost(timing);
}

std::vector<MeasuredFamily> measure(const Scene& scene, const Plan& plan,
                                    const Reference& reference, const std::vector<Family>& families,
                                    const MeasureOptions& options) {
  std::vector<MeasuredFamily> measured = measure_errors(scene, plan, reference, families, options);
  measure_times(plan, reference, options, measured);
  return measured;
}

void add_physics(const Scene& scene, const Plan& plan, const Reference& reference,
                 const MeasureOptions& options, Point& point) {
  if (!options.physics || !point.setting.engine || !point.measured() || point.physics) return;
  point.physics = measure_physics(scene, *point.setting.engine, plan, reference.pieces,
                                  options.contacts, options.stop);
}

}  // namespace counterpoint::apps::accuracy
