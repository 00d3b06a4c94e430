// Where the applied forces of a simulation come from: a file, or a seeded random source.
#pragma once

#include <cstdint>
#include <filesystem>
#include <random>
#include <vector>

#include "counterpoint/engine/motion_files.h"

namespace counterpoint::apps {

/// Inputs from a CSV file with the columns time and any of the scene's applied forces, servo
/// targets and wrenches on links (the other columns of a trajectory may be there and are not used).
/// A row holds from its time until the next.
class InputSchedule {
 public:
  /// @throws InputError naming file, line and column.
  InputSchedule(const std::filesystem::path& file, const Model& model);

  /// Adds the applied force at a time [s] to that of `input` (nv) and sets targets and wrenches, if
  /// the file has any; nothing before the first row. `slack` [s]: a row this little later than
  /// `time` holds already (times are sums of steps, hence rounded).
  void apply(const Model& model, double time, double slack, Input& input);

  /// The time [s] of the first row later than `time`; infinity after the last.
  double next_change(double time, double slack) const;

  const InputColumns& columns() const { return columns_; }

 private:
  std::vector<double> time_;
  MatrixX force_;  // nv x rows
  InputColumns columns_;
  MatrixX known_;  // values of columns_ x rows
  int row_ = -1;   // the one in force at the last time asked for
};

/// Random forces, constant for kHold: the tests of the inverse are driven by them. Uniform in
/// +- scale * min(effort limit, weight carried by the joint [* 0.1 m where it turns]) on actuated
/// joints, and +- wrench_scale * weight [* 0.1 m] on free bodies. The same seed gives the same
/// bits.
class RandomForces {
 public:
  static constexpr double kHold = 0.02;  ///< [s]
  static constexpr double kLever = 0.1;  ///< [m]

  RandomForces(const Model& model, double scale, double wrench_scale, std::uint64_t seed);

  /// Adds the force at a time [s], asked for in rising order.
  void add_to(double time, double slack, VectorX& force);
  /// When the next ones are drawn [s]; infinity where there are none.
  double next_change(double time, double slack) const;

 private:
  void draw();

  VectorX amplitude_;  // nv
  VectorX force_;      // nv
  std::mt19937_64 generator_;
  long held_ = -1;  // index of the period drawn last
};

}  // namespace counterpoint::apps
