// Sources of the applied forces of a simulation: a file, or a seeded random source.
#pragma once

#include <cstdint>
#include <filesystem>
#include <random>
#include <vector>

#include "counterpoint/engine/trajectory.h"

namespace counterpoint::apps {

/// End of the names of the columns with forces of actuators in the tables of inverses.
inline constexpr const char* kActuatorForceSuffix = ".force";

/// Inputs from a CSV file with the column time and any of the scene's applied forces, servo targets
/// and wrenches on links (other columns of a trajectory are allowed and ignored). A row applies
/// from its time until the next; coordinates of prescribed joints move on a line to the next row.
class InputSchedule {
 public:
  /// @throws InputError naming file, line and column
  InputSchedule(const std::filesystem::path& file, const Model& model);

  /// Adds the applied force at a time [s] to that of `input` (nv) and sets targets and wrenches, if
  /// the file has any; nothing before the first row. A row applies already if it is at most `slack`
  /// [s] later than `time` (times are sums of steps and therefore rounded).
  void apply(const Model& model, double time, double slack, Input& input);

  /// Time [s] of the first row later than `time`; infinity after the last.
  double next_change(double time, double slack) const;

  const InputColumns& columns() const { return columns_; }

 private:
  const VectorX& values_at(double time, double slack);

  std::vector<double> time_;
  MatrixX force_;  // nv x rows
  InputColumns columns_;
  MatrixX known_;      // values of columns_ x rows
  VectorX values_;     // interpolated values
  int num_moved_ = 0;  // number of columns of prescribed joints
  int row_ = -1;       // row that applies at the last time asked for
};

/// Random forces, constant for kHold; also used in tests of the inverse. Uniform in +- scale *
/// min(effort limit, weight carried by the joint [* 0.1 m for rotations]) on actuated joints, and
/// +- wrench_scale * weight [* 0.1 m] on free bodies. The same seed gives the same bits.
class RandomForces {
 public:
  static constexpr double kHold = 0.02;  ///< [s]
  static constexpr double kLever = 0.1;  ///< [m]

  RandomForces(const Model& model, double scale, double wrench_scale, std::uint64_t seed);

  /// Adds the force at a time [s]; call it with increasing times.
  void add_to(double time, double slack, VectorX& force);
  /// Time of the next draw [s]; infinity if all forces are zero.
  double next_change(double time, double slack) const;

 private:
  void draw();

  VectorX amplitude_;  // nv
  VectorX force_;      // nv
  std::mt19937_64 generator_;
  long held_ = -1;  // index of the last period drawn
};

}  // namespace counterpoint::apps
