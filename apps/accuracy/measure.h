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
  int failed = 0;       ///< pieces that did not come to their end; then nothing below is a number
  std::string failure;  ///< the first of them
  Deviation error;      ///< mean over the pieces, at their ends
  std::vector<double> piece_errors;  ///< Deviation::all of each piece
  double worst = 0.0;                ///< the largest of them
  double cost = 0.0;  ///< processor seconds a simulated second, median over the repeats
  double cost_low = 0.0, cost_high = 0.0;  ///< the least and the most of them
  long steps = 0;                          ///< of all pieces
  std::optional<Physics> physics;          ///< this engine only, see measure()
  bool measured() const { return failed == 0; }
};

/// A family, measured.
struct MeasuredFamily {
  Family family;
  std::string refused;        ///< why it cannot be run at all; then there are no points
  std::vector<Point> points;  ///< in the order of the settings
  std::string same_as;        ///< an earlier family with the very same settings, or empty
  /// Of a family with a limit of its own: how far that is from the reference, and how far off its
  /// fine run may be.
  std::optional<double> own_apart = {}, own_error = {};
};

/// A point by its place: family, setting.
struct Place {
  std::size_t family = 0, point = 0;
  bool operator==(const Place&) const = default;
};

struct MeasureOptions {
  int repeats = 5;
  bool physics = true;
  bool contacts = true;  ///< the scene has some: their figures are part of its physics
  /// Asked from time to time: true ends measuring with the settings measured so far.
  std::function<bool()> stop = {};
  /// Runs the settings, a task each, for their errors; by default in this thread.
  tasks::ListRunner run = tasks::run_here;
  /// Of all that errors depend on, for `run`.
  std::uint64_t fingerprint = 0;
};

/// Every piece by every setting, for its error: the same bits whoever runs it. Settings with equal
/// keys are measured once. Physics is added to those at the scene's own time step. Where
/// options.stop ends it: without the settings that were not reached. Costs are those of this one
/// run, of threads beside others.
std::vector<MeasuredFamily> measure_errors(const Scene& scene, const Plan& plan,
                                           const Reference& reference,
                                           const std::vector<Family>& families,
                                           const MeasureOptions& options);

/// Their costs: in this thread alone, in `repeats` rounds over all settings, after a piece of each
/// to warm up. Where options.stop ends it: of as many rounds as there were.
void measure_times(const Plan& plan, const Reference& reference, const MeasureOptions& options,
                   std::vector<MeasuredFamily>& families);

/// Both.
std::vector<MeasuredFamily> measure(const Scene& scene, const Plan& plan,
                                    const Reference& reference, const std::vector<Family>& families,
                                    const MeasureOptions& options);

/// Adds the physics of a setting of this engine, if it is not there.
void add_physics(const Scene& scene, const Plan& plan, const Reference& reference,
                 const MeasureOptions& options, Point& point);

}  // namespace counterpoint::apps::accuracy
