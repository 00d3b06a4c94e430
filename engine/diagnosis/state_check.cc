#include "counterpoint/engine/diagnosis/state_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace counterpoint {
namespace {

bool all_finite(const double* x, Eigen::Index size) {
  // Adding kCarry to the exponent sets the sign bit only if all exponent bits are ones (infinity,
  // NaN). There are no branches, and two numbers take one instruction.
  constexpr std::uint64_t kExponent = 0x7ff0'0000'0000'0000, kCarry = 0x0010'0000'0000'0000;
  std::uint64_t sum = 0;
  for (Eigen::Index i = 0; i < size; ++i)
    sum |= (std::bit_cast<std::uint64_t>(x[i]) & kExponent) + kCarry;
  return (sum >> 63) == 0;
}

template <class Vector>
bool all_finite(const Vector& x) {
  return all_finite(x.data(), x.size());
}

/// Returns the index of the first number that is not finite, or -1.
int find_not_finite(const double* x, Eigen::Index size) {
  for (Eigen::Index i = 0; i < size; ++i)
    if (!std::isfinite(x[i])) return static_cast<int>(i);
  return -1;
}

int find_not_finite(const VectorRef& x) { return find_not_finite(x.data(), x.size()); }

double squared_length(const double* r) {
  return r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3];
}
/// To first order in t, (1 + t)^2 = 1 + 2 t.
bool is_unit(double square) { return std::abs(square - 1.0) <= 2.0 * kQuaternionTolerance; }

/// Returns the fault of the first coordinate of v that is not finite.
Fault first_velocity_fault(FaultKind kind, const Model& model, const VectorRef& v) {
  const int i = find_not_finite(v);
  return velocity_fault(kind, model, i, v[i]);
}

Fault first_position_fault(FaultKind kind, const Model& model, const VectorRef& q) {
  const int i = find_not_finite(q);
  return position_fault(kind, model, i, q[i]);
}

Fault target_fault(FaultKind kind, const Model& model, const VectorX& targets) {
  Fault fault;
  fault.kind = kind;
  fault.index = find_not_finite(targets);
  const bool servo = kind == FaultKind::kServoPosition || kind == FaultKind::kServoVelocity;
  if (servo) fault.body = model.servos()[fault.index].joint + 1;
  fault.value = targets[fault.index];
  return fault;
}

[[noreturn]] void refuse_size(const char* what, Eigen::Index found, Eigen::Index expected) {
  throw InputError(
      fmt::format("a step was given {} numbers for {}; expected {}", found, what, expected));
}

void check_size(const char* what, Eigen::Index found, Eigen::Index expected) {
  if (found != expected) refuse_size(what, found, expected);
}

/// Checks the sizes of the inputs of servos and tendons, and the bodies of wrenches.
void check_known(const Model& model, const Input& input) {
  const auto servos = static_cast<Eigen::Index>(model.servos().size());
  for (const VectorX* targets : {&input.servo_position, &input.servo_velocity})
    if (targets->size() != 0) check_size("servo targets", targets->size(), servos);
  const auto tendons = static_cast<Eigen::Index>(model.tendons().size());
  for (const VectorX* numbers : {&input.tendon_force, &input.tendon_target})
    if (numbers->size() != 0) check_size("tendons", numbers->size(), tendons);
  const auto actuators = static_cast<Eigen::Index>(model.actuators().size());
  if (input.command.size() != 0) check_size("commands", input.command.size(), actuators);
  if (input.z.size() != 0) check_size("internal states", input.z.size(), model.nz());
  if (input.prescribed.size() != 0)
    check_size("prescribed coordinates", input.prescribed.size(), model.nq());
  for (const ExternalWrench& w : input.wrenches) {
    if (w.body >= 0 && w.body < model.num_bodies()) continue;
    throw InputError(fmt::format("a wrench acts on body {}; the model has bodies 0 to {}", w.body,
                                 model.num_bodies() - 1));
  }
}

Fault of_wrenches(const std::vector<ExternalWrench>& wrenches) {
  for (size_t i = 0; i < wrenches.size(); ++i) {
    const ExternalWrench& w = wrenches[i];
    for (const Vector3* part : {&w.wrench.force, &w.wrench.torque, &w.point}) {
      if (all_finite(*part)) continue;
      Fault fault;
      fault.kind = FaultKind::kWrench;
      fault.body = w.body;
      fault.index = static_cast<int>(i);
      fault.value = (*part)[find_not_finite(*part)];
      return fault;
    }
  }
  return {};
}

Fault of_known(const Model& model, const Input& input) {
  if (!all_finite(input.servo_position))
    return target_fault(FaultKind::kServoPosition, model, input.servo_position);
  if (!all_finite(input.servo_velocity))
    return target_fault(FaultKind::kServoVelocity, model, input.servo_velocity);
  if (!all_finite(input.tendon_force))
    return target_fault(FaultKind::kTendonForce, model, input.tendon_force);
  if (!all_finite(input.tendon_target))
    return target_fault(FaultKind::kTendonTarget, model, input.tendon_target);
  if (!all_finite(input.command)) return target_fault(FaultKind::kCommand, model, input.command);
  if (!all_finite(input.z)) return target_fault(FaultKind::kInternalState, model, input.z);
  return of_wrenches(input.wrenches);
}

}  // namespace

StateCheck::StateCheck(const Model& model) : reach_(static_cast<size_t>(model.nv()), 1.0) {
  // Distance of the farthest mass from the body's origin [m].
  std::vector<double> outboard(static_cast<size_t>(model.num_bodies()), 0.0);
  for (int i = model.num_bodies() - 1; i > 0; --i) {
    const Body& body = model.body(i);
    const SpatialInertia& inertia = body.inertia;
    if (inertia.mass > 0.0) {
      const double gyration =
          std::sqrt(std::max(0.5 * inertia.rotational.trace() / inertia.mass, 0.0));
      outboard[i] = std::max(outboard[i], inertia.center.norm() + gyration);
    }
    const double arm = body.X_PJ.translation.norm() + outboard[i];
    outboard[body.parent] = std::max(outboard[body.parent], arm);
    const int num_linear = joint_num_linear(body.joint_type);
    for (int k = num_linear; k < joint_nv(body.joint_type); ++k)
      reach_[body.v_index + k] = outboard[i];
  }
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (joint_nq(body.joint_type) == joint_nv(body.joint_type)) continue;
    quaternions_.push_back(body.q_index + joint_nq(body.joint_type) - 4);
    quaternion_bodies_.push_back(i);
  }
}

bool StateCheck::has_unit_quaternions(const double* q) const {
  bool good = true;
  for (const int i : quaternions_) good &= is_unit(squared_length(q + i));
  return good;
}

Fault StateCheck::of_coordinates(const Model& model, const VectorRef& q, const VectorRef& v) const {
  if (!all_finite(q)) return first_position_fault(FaultKind::kPosition, model, q);
  if (!all_finite(v)) return first_velocity_fault(FaultKind::kVelocity, model, v);
  if (has_unit_quaternions(q.data())) return {};
  Fault fault;
  fault.kind = FaultKind::kQuaternion;
  for (size_t i = 0; i < quaternions_.size(); ++i) {
    const double square = squared_length(q.data() + quaternions_[i]);
    if (is_unit(square)) continue;
    fault.body = quaternion_bodies_[i];
    fault.value = std::sqrt(square);
    break;
  }
  return fault;
}

bool StateCheck::accepts(const Model& model, const State& state, const Input& input) const {
  check_size("q", state.q.size(), model.nq());
  check_size("v", state.v.size(), model.nv());
  if (input.applied_force.size() != 0)
    check_size("applied forces", input.applied_force.size(), model.nv());
  check_known(model, input);
  return all_finite(state.q) && all_finite(state.v) && all_finite(input.applied_force) &&
         has_unit_quaternions(state.q.data());
}

Fault StateCheck::of_given(const Model& model, const State& state, const Input& input) const {
  if (const Fault fault = of_coordinates(model, state.q, state.v); fault.any()) return fault;
  if (!std::isfinite(state.time)) {
    Fault fault;
    fault.kind = FaultKind::kTime;
    fault.value = state.time;
    return fault;
  }
  if (!all_finite(input.applied_force))
    return first_velocity_fault(FaultKind::kAppliedForce, model, input.applied_force);
  return of_known(model, input);
}

Fault StateCheck::of_given(const Model& model, const VectorRef& q, const VectorRef& v,
                           const VectorRef& v_next, const Input& known) const {
  check_size("q", q.size(), model.nq());
  check_size("v", v.size(), model.nv());
  check_size("v_next", v_next.size(), model.nv());
  check_known(model, known);
  if (const Fault fault = of_coordinates(model, q, v); fault.any()) return fault;
  if (!all_finite(v_next)) return first_velocity_fault(FaultKind::kNewVelocity, model, v_next);
  return of_known(model, known);
}

Fault StateCheck::of_recovered(const Model& model, const VectorRef& force) const {
  if (all_finite(force)) return {};
  return first_velocity_fault(FaultKind::kRecoveredForce, model, force);
}

bool StateCheck::accepts(double max_speed, const State& next) const {
  const double* v = next.v.data();
  bool good = all_finite(next.q);
  good &= std::isfinite(next.time);
  // The comparison is false for NaN and infinity.
  for (size_t k = 0; k < reach_.size(); ++k) good &= std::abs(v[k]) * reach_[k] < max_speed;
  return good;
}

Fault StateCheck::of_result(const Model& model, double max_speed, const State& next) const {
  if (!all_finite(next.v)) return first_velocity_fault(FaultKind::kNewVelocity, model, next.v);
  if (!all_finite(next.q)) return first_position_fault(FaultKind::kNewPosition, model, next.q);
  Fault fault;
  fault.kind = FaultKind::kSpeed;
  fault.bound = max_speed;
  for (size_t k = 0; k < reach_.size(); ++k) {
    const double speed = std::abs(next.v[static_cast<Eigen::Index>(k)]) * reach_[k];
    if (!(speed >= fault.value)) continue;
    fault.value = speed;
    fault.coordinate = static_cast<int>(k);
  }
  fault.body = body_of_velocity(model, fault.coordinate);
  return fault;
}

}  // namespace counterpoint
