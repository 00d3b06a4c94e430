// A scene whose sensors are read step by step, by the names of their columns.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "counterpoint/engine/sensors/sensor_table.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint::test {

class Sensed {
 public:
  explicit Sensed(Scene scene)
      : simulator(std::move(scene)), table(simulator.model(), simulator.options()) {}

  /// Does one step and evaluates all sensors in it.
  void step() {
    before = simulator.state();
    ASSERT_TRUE(simulator.step().succeeded());
    values.resize(table.size());
    const State& after = simulator.state();
    table.evaluate(
        {before.q, before.v, after.q, after.v, simulator.input(), simulator.options().time_step},
        values);
  }
  /// Index of a column; a failure if there is none.
  int index(const std::string& column) const {
    for (int i = 0; i < table.size(); ++i)
      if (table.columns()[static_cast<std::size_t>(i)].name == column) return i;
    ADD_FAILURE() << "there is no column " << column;
    return 0;
  }
  double value(const std::string& column) const { return values[index(column)]; }
  /// Three columns from this one on.
  Vector3 vector(const std::string& column) const { return values.segment<3>(index(column)); }

  Simulator simulator;
  SensorTable table;
  State before;
  VectorX values;
};

inline SensorSpec sensor(const std::string& name, std::vector<SensorKind> kinds,
                         const std::string& link, const Vector3& position = Vector3::Zero()) {
  SensorSpec spec;
  spec.sensor.name = name;
  spec.sensor.kinds = std::move(kinds);
  spec.sensor.X_FS.translation = position;
  spec.link = link;
  return spec;
}

/// Kinds of an inertial measurement unit, whose vectors are along its own axes.
inline SensorSpec imu(const std::string& name, const std::string& link,
                      const Vector3& position = Vector3::Zero()) {
  SensorSpec spec =
      sensor(name, {SensorKind::kSpecificForce, SensorKind::kAngularVelocity}, link, position);
  spec.sensor.own_axes = true;
  return spec;
}

inline SensorSpec wrench(const std::string& name, const std::string& link,
                         const Vector3& position = Vector3::Zero()) {
  return sensor(name, {SensorKind::kForce, SensorKind::kTorque}, link, position);
}

}  // namespace counterpoint::test
