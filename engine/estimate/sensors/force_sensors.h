// Residuals of measured forces at a step: contact forces on some links, forces of joints, wrenches
// through joints.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/estimate/sensors/sensor_rows.h"
#include "counterpoint/engine/step.h"

namespace counterpoint::estimation {

class ForceSensors {
 public:
  explicit ForceSensors(const std::vector<SensorTerm>& terms);

  bool any() const { return !term_of_row_.empty(); }
  /// Are there rows whose derivatives are not among those of the applied force?
  bool any_differences() const { return any_differences_; }
  /// Index of each row's sensor.
  const std::vector<int>& term_of_row() const { return term_of_row_; }
  /// Residuals of all readings over their deviations at frame t, whose step has this inverse; 0
  /// where nothing was read. Wrenches take the frames t - 1, t, t + 1.
  void evaluate(const Model& model, const SensorFrames& frames, int t, const Inverse& inverse,
                VectorX& out);
  /// Rows of joints' forces: their derivatives from those of the applied force (nv x n).
  void differentiate_joints(const MatrixX& force, MatrixX& out) const;
  /// How residuals of frame t go with offsets and delays (rows x constants).
  void differentiate_constants(const SensorFrames& frames, int t, MatrixX& out) const;

 private:
  /// Forces through all joints but for contacts: data_->F.
  void compute_joint_wrenches(const Model& model, const SensorFrames& frames, int t);

  const std::vector<SensorTerm>* terms_;
  std::vector<int> term_of_row_;
  bool any_differences_ = false, any_wrenches_ = false;
  std::optional<Data> data_;
};

}  // namespace counterpoint::estimation
