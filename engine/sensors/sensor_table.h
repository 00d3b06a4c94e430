// The sensors of a model as columns of a table: exact values in a step, and readings with errors.
//
//     SensorTable table(model, options);
//     SensorSampler readings(model, seed);
//     VectorX exact(table.size()), row(table.size());
//     table.evaluate({before.q, before.v, after.q, after.v, input, h}, exact);
//     readings.read(before.time, exact, row);
//
// A row belongs to a step, and has the time of its start: positions and velocities at (q, w),
// accelerations (w+ - w) / h at q, and the forces of the step's inverse, which are means over the
// step (docs/reference/sensors.md).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// One column of the table.
struct SensorColumn {
  std::string name;  ///< "SENSOR.fx"
  std::string unit;  ///< "m/s^2"; "1" for a component of a quaternion
  /// Axes of a component of a vector, and frame of a position: "world", "sensor", or the name of
  /// the reference link; empty for numbers without axes.
  std::string frame;
  int sensor = 0;  ///< index into Model::sensors
};

/// Returns the columns of all sensors of a model, in their order.
std::vector<SensorColumn> sensor_columns(const Model& model);

/// A step that was computed or recorded.
struct SensorStep {
  VectorRef q, v, q_next, v_next;  ///< nq, nv, nq, nv [m, rad; m/s, rad/s]
  const Input& known;              ///< input as step_inverse takes it
  double h = 0.0;                  ///< length of the step [s]
};

/// Numbers of computations so far; a quantity that no sensor needs is not computed.
struct SensorWork {
  long poses = 0;          ///< kinematics of all bodies
  long accelerations = 0;  ///< spatial accelerations of all bodies
  long inverses = 0;       ///< inverse steps
  long wrenches = 0;       ///< wrenches of all joints
  long rays = 0;           ///< rays against all geometries

  bool operator==(const SensorWork&) const = default;
};

/// Computes exact values. It allocates nothing after the first step with as many contacts. Use one
/// object per thread.
class SensorTable {
 public:
  /// The model must outlive the table. @throws InputError if a sensor has no value: a force where
  /// the integrator has no inverse, a wrench under another one than semi_implicit_euler, the centre
  /// of mass of links without mass.
  SensorTable(const Model& model, const SimulationOptions& options);
  SensorTable(Model&&, const SimulationOptions&) = delete;  ///< a temporary would not outlive it
  ~SensorTable();
  SensorTable(SensorTable&&) noexcept;
  SensorTable& operator=(SensorTable&&) noexcept;

  const std::vector<SensorColumn>& columns() const;
  int size() const { return static_cast<int>(columns().size()); }
  /// Computes all values (size()), in the units of the columns. NaN: there is none, since a ray
  /// hits nothing within its limit, or the step has no inverse. @throws InputError if a size is not
  /// the model's, or h is not positive.
  void evaluate(const SensorStep& step, VectorOut values);
  const SensorWork& work() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Turns exact values into readings: reading = exact + bias + noise, rounded to multiples of the
/// quantum, sampled and delayed as Sensor::errors says.
///
/// A sample is taken at the first row at or after every multiple of 1 / rate (without a rate at
/// every row) and appears at the first row that is `delay` later; it is held until the next. Before
/// the first one readings are NaN. The noise of a sample depends on the seed, the name of the
/// column and the number of the sample alone, and is the same on every machine.
class SensorSampler {
 public:
  SensorSampler(const Model& model, std::uint64_t seed);

  /// Adds the next row, at `time` [s], times ascending from 0. exact, readings:
  /// SensorTable::size(). Allocates only while a delay holds back more samples than before.
  void read(double time, const VectorRef& exact, VectorOut readings);

 private:
  /// The samples of one sensor.
  struct Channel {
    SensorErrors errors;
    Eigen::Index first = 0, rows = 0;  ///< its rows
    std::vector<std::uint64_t> seeds;  ///< for each row
    long sample = -1;                  ///< number of the last sample
    std::vector<double> held;          ///< values that are read
    std::vector<double> waiting;       ///< samples to come: time [s] and values of each
    std::size_t begin = 0;             ///< index of the first of them
  };
  void take_sample(Channel& channel, double time, const VectorRef& exact);
  static void advance(Channel& channel, double time);

  std::vector<Channel> channels_;
  long row_ = 0;
};

}  // namespace counterpoint
