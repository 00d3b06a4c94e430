// Residuals of measured forces in a step: contact forces on links, joint forces, and wrenches
// transmitted by joints.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/estimate/sensors/sensor_rows.h"
#include "counterpoint/engine/sensors/joint_wrenches.h"
#include "counterpoint/engine/step.h"

namespace counterpoint::estimation {

class ForceSensors {
 public:
  explicit ForceSensors(const std::vector<SensorTerm>& terms);

  bool any() const { return !term_of_row_.empty(); }
  /// True if some rows need finite differences, since their derivatives do not follow from those of
  /// the applied force.
  bool any_differences() const { return any_differences_; }
  /// Index of each row's sensor.
  const std::vector<int>& term_of_row() const { return term_of_row_; }
  /// Computes all residuals at frame t, in standard deviations, from inverse dynamics of its step;
  /// 0 for missing readings. Wrenches use the frames t - 1, t, t + 1.
  void evaluate(const Model& model, const SensorFrames& frames, int t, const Inverse& inverse,
                VectorX& out);
  /// Adds the derivatives of joint force rows to `out`, from those of the applied force (nv x n).
  void add_joints(const SensorFrames& frames, const MatrixX& force, MatrixX& out) const;
  /// Derivatives (rows x constants) of the residuals evaluated last, at the same frame and inverse,
  /// with respect to the constants.
  void differentiate_constants(const Model& model, const SensorFrames& frames, int t,
                               const Inverse& inverse, Eigen::Ref<MatrixX> out) const;

 private:
  /// Computes the wrenches of the joints at frame t from those at t - 1, t, t + 1.
  void compute_joint_wrenches(const Model& model, const SensorFrames& frames, int t,
                              const Inverse& inverse);
  /// Computes the weighted residual of a term. Returns false if it has no reading.
  bool residual(const Model& model, const SensorFrames& frames, int t, const Inverse& inverse,
                const SensorTerm& term, Vector3& out) const;

  const std::vector<SensorTerm>* terms_;
  std::vector<int> term_of_row_;
  bool any_differences_ = false, any_wrenches_ = false;
  std::optional<Data> data_;
  std::optional<JointWrenches> joints_;
};

}  // namespace counterpoint::estimation
