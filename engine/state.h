// State and Input: all that a step depends on beside the model and its options. Hash: of their
// bits.
#pragma once

#include <bit>
#include <cstdint>
#include <string_view>
#include <vector>

#include "counterpoint/model/model.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// The force of one constraint in the last step, and which constraint that was (contact_memory.h).
struct RememberedForce {
  enum class Kind : unsigned char { kContact, kClosure, kJoint, kTautLink };
  Kind kind = Kind::kContact;
  int a = 0, b = 0;              ///< geometries; closure and first row; velocity and its row; body
  Vector3 at = Vector3::Zero();  ///< of a contact: in the frame of the body that moves [m]
  /// In W [N]; of a joint row its only entry is the first. A taut link has the factor and the kept
  /// factor of TautLink here, and the square of the rate at which its forces would turn it [1/s^2].
  Vector3 force = Vector3::Zero();
  Vector3 torque = Vector3::Zero();  ///< of torsional and rolling friction, of welds, in W [N m]

  bool operator==(const RememberedForce&) const = default;
};

/// The whole truth about a moment. Copyable; two equal states step to equal bits.
struct State {
  double time = 0.0;  ///< [s]
  VectorX q;          ///< nq, model/model.h says what each joint's coordinates mean
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

/// A light link that a step turned as if it had more rotational inertia (taut_links.h).
struct TautLink {
  int body = 0;
  double factor = 1.0;  ///< inertia about its centre of mass, times its own
  double kept = 1.0;    ///< the part of that, times its own, which has the velocity at the start

  bool operator==(const TautLink&) const = default;
};

/// The taut links of the step that led to a state, as its memory has them, by body.
void find_taut_links(const State& state, std::vector<TautLink>& links);

/// What is applied from outside during one step.
struct Input {
  VectorX applied_force;                 ///< nv, or empty: none [N, N m]; conjugate to v
  std::vector<ExternalWrench> wrenches;  ///< optional
  VectorX servo_position = {};  ///< targets, by Model::servos [rad or m]; or empty: the model's
  VectorX servo_velocity = {};  ///< targets [rad/s or m/s]; or empty: the model's
  /// Known of a step that is inverted, or to be repeated: the softening that it reported.
  Softening softening = {};
  /// The same of the links that were taut, by body (find_taut_links). A step that is given some
  /// takes these and no others.
  std::vector<TautLink> taut_links = {};
};

// ---- 64-bit FNV-1a over numbers, byte by byte from the lowest: the same on every machine.

class Hash {
 public:
  void add_byte(unsigned char byte) { value_ = (value_ ^ byte) * 1099511628211u; }
  void add(std::uint64_t word) {
    for (int i = 0; i < 8; ++i) add_byte(static_cast<unsigned char>(word >> (8 * i)));
  }
  void add(int number) { add(static_cast<std::uint64_t>(static_cast<std::int64_t>(number))); }
  /// The bits: 0 and -0 differ.
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(bool) = delete;
  /// All numbers of a vector or matrix of Eigen, column by column.
  template <class Derived>
  void add(const Eigen::DenseBase<Derived>& numbers) {
    for (Eigen::Index j = 0; j < numbers.cols(); ++j)
      for (Eigen::Index i = 0; i < numbers.rows(); ++i) add(numbers(i, j));
  }
  /// The characters, and how many.
  void add(std::string_view text) {
    add(static_cast<std::uint64_t>(text.size()));
    for (const char c : text) add_byte(static_cast<unsigned char>(c));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 14695981039346656037u;
};

}  // namespace counterpoint
