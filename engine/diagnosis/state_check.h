// Checks of the arguments and results of a step, in a few nanoseconds. The element at fault is
// searched for only after a step has failed.
//
// Sizes, coordinates, lengths of quaternions and applied forces are checked before a step:
// collision must not receive NaN, and normalizing a quaternion or clamping a force would hide an
// error. Any other number that is not finite makes the resulting state not finite, which is checked
// after every step.
#pragma once

#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step.h"

namespace counterpoint {

class StateCheck {
 public:
  explicit StateCheck(const Model& model);

  /// Checks the arguments of a step. Returns false if a coordinate or an applied force is not
  /// finite, or a quaternion is not of unit length. @throws InputError if a size is not the
  /// model's, or a wrench acts on a body that does not exist.
  bool accepts(const Model& model, const State& state, const Input& input) const;
  /// Returns the first fault of all arguments of a step.
  Fault of_given(const Model& model, const State& state, const Input& input) const;
  /// Returns the first fault of the arguments of an inverse; the applied force of `known` is not
  /// checked.
  /// @throws InputError as accepts().
  Fault of_given(const Model& model, const VectorRef& q, const VectorRef& v,
                 const VectorRef& v_next, const Input& known) const;

  /// Checks the result of a step. Returns false if it is not finite, or faster than `max_speed`
  /// [m/s].
  bool accepts(double max_speed, const State& next) const;
  /// Returns the fault of the result of a step.
  Fault of_result(const Model& model, double max_speed, const State& next) const;

  /// Returns the fault of the first recovered force (nv) that is not finite.
  Fault of_recovered(const Model& model, const VectorRef& force) const;

  /// Per coordinate of v: speed of the farthest mass that it moves over its own speed. 1 [-] for
  /// translations; for rotations the length of all outboard links [m], with prismatic joints at
  /// zero, plus the radius of gyration of the last one.
  const std::vector<double>& reach() const { return reach_; }

 private:
  bool has_unit_quaternions(const double* q) const;
  Fault of_coordinates(const Model& model, const VectorRef& q, const VectorRef& v) const;

  std::vector<int> quaternions_;        ///< where each quaternion begins in q
  std::vector<int> quaternion_bodies_;  ///< the body of each quaternion
  std::vector<double> reach_;
};

}  // namespace counterpoint
