// State and Input: all that a step depends on beside the model and its options.
#pragma once

#include <cstdint>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// The whole truth about a moment. Copyable; two equal states step to equal bits.
struct State {
  double time = 0.0;  ///< [s]
  VectorX q;          ///< nq, joint.h says what each joint's coordinates mean
  VectorX v;          ///< nv [m/s, rad/s]
};

/// Of the bits of time, q and v: 64-bit FNV-1a over the doubles in this order, each from its lowest
/// byte. Equal for equal states; 0 and -0 differ.
std::uint64_t state_hash(const State& state);

/// A force and torque on a body, constant over the step, in world axes.
struct ExternalWrench {
  int body = 0;
  Force wrench;                     ///< [N m, N]
  /// Where the force acts and the torque is about, in the body frame [m].
  Vector3 point = Vector3::Zero();
};

/// What is applied from outside during one step.
struct Input {
  VectorX applied_force;                 ///< nv, or empty: none [N, N m]; conjugate to v
  std::vector<ExternalWrench> wrenches;  ///< optional
  VectorX servo_position = {};  ///< targets, by Model::servos [rad or m]; or empty: the model's
  VectorX servo_velocity = {};  ///< targets [rad/s or m/s]; or empty: the model's
};

}  // namespace counterpoint
