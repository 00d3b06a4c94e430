// State and Input: everything that a step depends on beside the model and its options. Hash: of
// their bits.
#pragma once

#include <bit>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "counterpoint/model/model.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// Force of one constraint in the last step, and the identity of the constraint (contact_memory.h).
struct RememberedForce {
  enum class Kind : unsigned char { kContact, kClosure, kJoint, kTautLink };
  Kind kind = Kind::kContact;
  /// Contact: geometries. Closure: index, first row. Joint: coordinate of v, kind of row. Taut
  /// link: body.
  int a = 0, b = 0;
  Vector3 at = Vector3::Zero();  ///< contact point in the frame of the moving body [m]
  /// Force in W [N]; the first entry only for a joint row. A taut link stores here the factor and
  /// the kept factor of TautLink, and the squared rate at which its forces would turn it [1/s^2].
  Vector3 force = Vector3::Zero();
  /// Torque of torsional and rolling friction and of welds, in W [N m].
  Vector3 torque = Vector3::Zero();

  bool operator==(const RememberedForce&) const = default;
};

/// The complete state of a simulation. Copyable; two equal states step to equal bits.
struct State {
  double time = 0.0;  ///< [s]
  VectorX q;          ///< nq, coordinates of each joint: model/model.h
  VectorX v;          ///< nv [m/s, rad/s]
  /// nz, internal states of actuators and switched closures (Model::nz); empty: Model::default_z.
  VectorX z = {};
  /// Forces of the last step, for the warm start of the next one; may be empty.
  std::vector<RememberedForce> memory = {};
};

/// Returns the given internal states (nz), or those that replace missing ones.
inline const VectorX& given_z(const Model& model, const VectorX& z) {
  return z.size() > 0 ? z : model.default_z();
}

/// Returns a hash of the bits of time, q, v and z: 64-bit FNV-1a over the doubles in this order,
/// each from its lowest byte. Equal for equal states; 0 and -0 differ.
std::uint64_t state_hash(const State& state);

/// A force and torque on a body, constant over the step, in axes of W.
struct ExternalWrench {
  int body = 0;
  Force wrench;  ///< [N m, N]
  /// Point of application of the force and reference point of the torque, in the body frame [m].
  Vector3 point = Vector3::Zero();
  /// Model::frames of the link that it acts on, for sensors of wrenches between links of one body;
  /// -1: the link that the body's joint moves.
  int frame = -1;
};

/// Other laws of a step that could not be solved with its own laws (softening.h).
struct Softening {
  /// Multiplies every regularizer; if negative, |factor| does, and friction is convex. Infinity:
  /// the step is unfinished (SimulationOptions::step_budget), and no law tells its impulses.
  double factor = 1.0;
  int tree = -1;  ///< lowest tree of the island (Model::trees); -1: all moving islands

  bool any() const { return factor != 1.0; }
  bool unfinished() const { return factor == std::numeric_limits<double>::infinity(); }
  /// Whether the step was solved with softer laws.
  bool softens() const { return any() && !unfinished(); }
  bool operator==(const Softening&) const = default;
};

/// A light link that a step rotated as if it had more rotational inertia (taut_links.h).
struct TautLink {
  int body = 0;
  double factor = 1.0;  ///< inertia about its centre of mass over its own
  double kept = 1.0;    ///< part of factor that starts with the link's velocity

  bool operator==(const TautLink&) const = default;
};

/// Finds the taut links of the step that led to a state, from its memory, sorted by body.
void find_taut_links(const State& state, std::vector<TautLink>& links);

/// External input during one step.
struct Input {
  VectorX applied_force;                 ///< nv, or empty for none [N, N m]; conjugate to v
  std::vector<ExternalWrench> wrenches;  ///< optional
  VectorX servo_position = {};  ///< targets, by Model::servos [rad or m]; empty: the model's
  VectorX servo_velocity = {};  ///< targets [rad/s or m/s]; empty: the model's
  /// Forces along tendons, by Model::tendons [N]: pulling is negative; empty: none.
  VectorX tendon_force = {};
  VectorX tendon_target = {};  ///< lengths that their servos aim at [m]; empty: the model's
  VectorX command = {};        ///< one per actuator, in its unit; empty: the model's
  /// Per closure (Model::closures), for the switched ones: 1 attaches, 0 releases, NaN leaves it as
  /// it is; empty: all as they are. A closure that broke stays open until it has been released and
  /// attached again.
  VectorX attach = {};
  /// nq, coordinates at the end of the step of the joints whose motion is prescribed (other entries
  /// are not used); a joint with a NaN stands still, and all do where this is empty.
  VectorX prescribed = {};
  /// Internal states (nz) at the start of a step that is to be inverted; empty: Model::default_z. A
  /// forward step takes those of its state.
  VectorX z = {};
  /// Softening reported by a step that is to be inverted or repeated.
  Softening softening = {};
  /// Taut links of such a step, sorted by body (find_taut_links). If it is not empty, the step uses
  /// these and no others.
  std::vector<TautLink> taut_links = {};
};

// ---- 64-bit FNV-1a over numbers, each from its lowest byte: the same on every machine.

class Hash {
 public:
  void add_byte(unsigned char byte) { value_ = (value_ ^ byte) * 1099511628211u; }
  void add(std::uint64_t word) {
    for (int i = 0; i < 8; ++i) add_byte(static_cast<unsigned char>(word >> (8 * i)));
  }
  void add(int number) { add(static_cast<std::uint64_t>(static_cast<std::int64_t>(number))); }
  /// Adds the bits of a number: 0 and -0 differ.
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(bool) = delete;
  /// Adds all numbers of an Eigen vector or matrix, column by column.
  template <class Derived>
  void add(const Eigen::DenseBase<Derived>& numbers) {
    for (Eigen::Index j = 0; j < numbers.cols(); ++j)
      for (Eigen::Index i = 0; i < numbers.rows(); ++i) add(numbers(i, j));
  }
  /// Adds the number of characters and the characters.
  void add(std::string_view text) {
    add(static_cast<std::uint64_t>(text.size()));
    for (const char c : text) add_byte(static_cast<unsigned char>(c));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 14695981039346656037u;
};

}  // namespace counterpoint
