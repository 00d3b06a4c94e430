// What a step is given and what comes out of it, checked in a few nanoseconds. The element at fault
// is searched for only after a step has failed.
//
// Of what is given, sizes, coordinates, lengths of quaternions and applied forces are checked
// before a step: collision must not see what is not a number, and a normalized quaternion or a
// clamped force would hide what was wrong. Any other number that is not finite leads to a state
// that is not finite, which is checked after every step.
#pragma once

#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step.h"

namespace counterpoint {

class StateCheck {
 public:
  explicit StateCheck(const Model& model);

  /// Before a step. False if a coordinate or an applied force is not finite, or a quaternion not of
  /// unit length. @throws InputError where a size is not the model's, or a wrench acts on a body
  /// that is not there.
  bool accepts(const Model& model, const State& state, const Input& input) const;
  /// The first fault of all that a step was given.
  Fault of_given(const Model& model, const State& state, const Input& input) const;
  /// The same of what an inverse is given; the applied force of `known` is not looked at. @throws
  /// as `accepts`.
  Fault of_given(const Model& model, const VectorRef& q, const VectorRef& v,
                 const VectorRef& v_next, const Input& known) const;

  /// After a step. False if its state is not finite, or faster than `max_speed` [m/s].
  bool accepts(double max_speed, const State& next) const;
  /// Where that is.
  Fault of_result(const Model& model, double max_speed, const State& next) const;

  /// The first recovered force (nv) that is not finite.
  Fault of_recovered(const Model& model, const VectorRef& force) const;

  /// By coordinate of v: the speed at which it moves the mass that is farthest out, over its own. 1
  /// where it is a length; else the length of all links outboard [m], with sliding joints at zero,
  /// and the radius of gyration of the last.
  const std::vector<double>& reach() const { return reach_; }

 private:
  bool has_unit_quaternions(const double* q) const;
  Fault of_coordinates(const Model& model, const VectorRef& q, const VectorRef& v) const;

  std::vector<int> quaternions_;        ///< where they begin in q
  std::vector<int> quaternion_bodies_;  ///< whose they are
  std::vector<double> reach_;
};

}  // namespace counterpoint
