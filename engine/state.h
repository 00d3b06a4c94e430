// State and Input: all that a step depends on beside the model and its options.
#pragma once

#include <cstdint>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// The force of one constraint in the last step, and which constraint that was (contact_memory.h).
struct RememberedForce {
  enum class Kind : unsigned char { kContact, kClosure, kJoint };
  Kind kind = Kind::kContact;
  int a = 0, b = 0;                  ///< geometries; closure and first row; velocity and its row
  Vector3 at = Vector3::Zero();      ///< of a contact: in the frame of the body that moves [m]
  Vector3 force = Vector3::Zero();   ///< in W [N]; of a joint row its only entry is the first
  Vector3 torque = Vector3::Zero();  ///< of torsional and rolling friction, of welds, in W [N m]

  bool operator==(const RememberedForce&) const = default;
};

/// The whole truth about a moment. Copyable; two equal states step to equal bits.
struct State {
  double time = 0.0;  ///< [s]
  VectorX q;          ///< nq, joint.h says what each joint's coordinates mean
  VectorX v;          ///< nv [m/s, rad/s]
  /// Forces of the last step, which the next one starts from; may be empty.
  std::vector<RememberedForce> memory = {};
};

/// Of the bits of time, q and v: 64-bit FNV-1a over the doubles in this order, each from its lowest
/// byte. Equal for equal states; 0 and -0 differ.
std::uint64_t state_hash(const State& state);

/// A force and torque on a body, constant over the step, in world axes.
struct ExternalWrench {
  int body = 0;
  Force wrench;  ///< [N m, N]
  /// Where the force acts and the torque is about, in the body frame [m].
  Vector3 point = Vector3::Zero();
};

/// Softer laws of a step that could not be solved with its own (softening.h).
struct Softening {
  double factor = 1.0;  ///< of every regularizer; below 0: its amount, and convex friction
  int tree = -1;        ///< lowest tree of the island (Model::trees); -1: all islands that move

  bool any() const { return factor != 1.0; }
  bool operator==(const Softening&) const = default;
};

/// What is applied from outside during one step.
struct Input {
  VectorX applied_force;                 ///< nv, or empty: none [N, N m]; conjugate to v
  std::vector<ExternalWrench> wrenches;  ///< optional
  VectorX servo_position = {};  ///< targets, by Model::servos [rad or m]; or empty: the model's
  VectorX servo_velocity = {};  ///< targets [rad/s or m/s]; or empty: the model's
  /// Known of a step that is inverted, or to be repeated: the softening that it reported.
  Softening softening = {};
};

}  // namespace counterpoint
