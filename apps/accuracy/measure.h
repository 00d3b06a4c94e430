// Cost and error of each setting.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "families.h"
#include "physics.h"
#include "reference.h"
#include "tasks/task_list.h"

namespace counterpoint::apps::accuracy {

/// A setting, measured.
struct Point {
  Setting setting;
  int failed = 0;       ///< pieces that did not reach their end; if > 0, the numbers below are
                        ///< invalid
  std::string failure;  ///< message of the first failed piece
  Deviation error;      ///< mean over the pieces, at their ends
  std::vector<double> piece_errors;  ///< Deviation::all of each piece
  double worst = 0.0;                ///< largest of piece_errors
  double cost = 0.0;  ///< processor seconds per simulated second, median over the repeats
  double cost_low = 0.0, cost_high = 0.0;  ///< least and largest of the repeats
  long steps = 0;                          ///< total over all pieces
  std::optional<Physics> physics;          ///< this engine only, see measure()
  bool measured() const { return failed == 0; }
};

/// A family, measured.
struct MeasuredFamily {
  Family family;
  std::string refused;        ///< why it cannot run at all; then there are no points
  std::vector<Point> points;  ///< in the order of the settings
  std::string same_as;        ///< earlier family with identical settings, or empty
  /// Only for a family with `own`: distance of its own fine run from the reference, and the error
  /// of that run.
  std::optional<double> own_apart = {}, own_error = {};
};

/// Index of a point: family and setting.
struct Place {
  std::size_t family = 0, point = 0;
  bool operator==(const Place&) const = default;
};

const Point& point_at(const std::vector<MeasuredFamily>& measured, const Place& place);

struct MeasureOptions {
  int repeats = 5;
  bool physics = true;
  bool contacts = true;  ///< the scene has contacts: contact residuals and the block are part of
                         ///< its physics
  /// Called from time to time; returning true ends the measurement with the settings measured so
  /// far.
  std::function<bool()> stop = {};
  /// Runs the settings, one task each, for their errors; by default in this thread.
  tasks::ListRunner run = tasks::run_here;
  /// Hash of everything that errors depend on, for `run`.
  std::uint64_t fingerprint = 0;
};

/// Runs every piece with every setting for its error; the results are bitwise equal whoever runs
/// it. Settings with equal keys are measured once. Physics is added at the scene's own time step.
/// If options.stop ends it, settings not yet reached are missing. Costs come from this one run,
/// whose threads compete with others.
std::vector<MeasuredFamily> measure_errors(const Scene& scene, const Plan& plan,
                                           const Reference& reference,
                                           const std::vector<Family>& families,
                                           const MeasureOptions& options);

/// Measures costs in this thread alone, in `repeats` rounds over all settings, after a warm-up
/// piece of each. If options.stop ends it, costs come from the rounds completed.
void measure_times(const Plan& plan, const Reference& reference, const MeasureOptions& options,
                   std::vector<MeasuredFamily>& families);

/// Runs measure_errors, then measure_times.
std::vector<MeasuredFamily> measure(const Scene& scene, const Plan& plan,
                                    const Reference& reference, const std::vector<Family>& families,
                                    const MeasureOptions& options);

/// Adds the physics of a setting of this engine, unless it is already there.
void add_physics(const Scene& scene, const Plan& plan, const Reference& reference,
                 const MeasureOptions& options, Point& point);

}  // namespace counterpoint::apps::accuracy
