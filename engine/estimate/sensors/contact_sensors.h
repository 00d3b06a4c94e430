// Residuals of measured contact forces: the sum of contact forces on some links, less the reading.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor_rows.h"
#include "counterpoint/engine/step.h"

namespace counterpoint::estimation {

class ContactSensors {
 public:
  explicit ContactSensors(const std::vector<SensorTerm>& terms);

  bool any() const { return rows_ > 0; }
  /// Residuals of all readings over their deviations at frame t, whose step has this inverse; 0
  /// where nothing was read. 3 rows a sensor.
  void evaluate(const Model& model, const SensorFrames& frames, int t, const Inverse& inverse,
                VectorX& out) const;
  /// How they go with the offsets (rows x constants).
  void differentiate(MatrixX& by_constants) const;

 private:
  const std::vector<SensorTerm>* terms_;
  int rows_ = 0;
};

}  // namespace counterpoint::estimation
