// Residuals of measured forces at a step: contact forces on some links, forces of joints.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor_rows.h"
#include "counterpoint/engine/step.h"

namespace counterpoint::estimation {

class ForceSensors {
 public:
  explicit ForceSensors(const std::vector<SensorTerm>& terms);

  bool any() const { return !term_of_row_.empty(); }
  bool any_contacts() const { return any_contacts_; }
  /// Index of each row's sensor.
  const std::vector<int>& term_of_row() const { return term_of_row_; }
  /// Residuals of all readings over their deviations at frame t, whose step has this inverse; 0
  /// where nothing was read.
  void evaluate(const Model& model, const SensorFrames& frames, int t, const Inverse& inverse,
                VectorX& out) const;
  /// Rows of joints' forces: their derivatives from those of the applied force (nv x n).
  void differentiate_joints(const MatrixX& force, MatrixX& out) const;
  /// How residuals of frame t go with offsets and delays (rows x constants).
  void differentiate_constants(const SensorFrames& frames, int t, MatrixX& out) const;

 private:
  const std::vector<SensorTerm>* terms_;
  std::vector<int> term_of_row_;
  bool any_contacts_ = false;
};

}  // namespace counterpoint::estimation
