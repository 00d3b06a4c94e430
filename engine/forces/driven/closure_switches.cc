#include "counterpoint/engine/forces/driven/closure_switches.h"

#include <fmt/format.h>

#include <cmath>

#include "counterpoint/engine/constraints/assemble.h"

namespace counterpoint {
namespace {

/// X_WB of one body at q (nq).
Pose body_pose(const Model& model, const VectorRef& q, int i) {
  Pose X_WB;
  for (; i != 0; i = model.body(i).parent) {
    const Body& body = model.body(i);
    X_WB = joint_pose(body.X_PJ, body.joint_type, q.data() + body.q_index) * X_WB;
  }
  return X_WB;
}

void break_by(const Closure& closure, const Force& force, VectorX& z) {
  const bool breaks =
      force.force.norm() > closure.breaking_force || force.torque.norm() > closure.breaking_torque;
  if (breaks) z[closure.z_index] = Closure::kBroken;
}

[[noreturn]] void fail(const Closure& closure, const std::string& what) {
  throw InputError(fmt::format("closure '{}': {}", closure.name, what));
}

void check_state(const Closure& closure, const VectorX& z) {
  const double state = z[closure.z_index];
  if (state != Closure::kAttached && state != Closure::kReleased && state != Closure::kBroken)
    fail(closure, fmt::format("its state is {}; 1 (attached), 0 (released) or -1 (broken) is "
                              "expected",
                              state));
  if (!closure.in_place) return;
  const auto held = z.segment<7>(closure.z_index + 1);
  if (!held.allFinite() || std::abs(held.tail<4>().norm() - 1.0) > kQuaternionTolerance)
    fail(closure,
         "the pose that it holds in place has a number that is not finite, or a "
         "quaternion that is not of unit length");
}

}  // namespace

void switch_closures(const Model& model, const VectorRef& q, const VectorX& attach, VectorX& z) {
  const auto count = static_cast<Eigen::Index>(model.closures().size());
  if (attach.size() != 0 && attach.size() != count)
    throw InputError(
        fmt::format("a step was given {} numbers for the attachment of closures; {} "
                    "are expected",
                    attach.size(), count));
  for (Eigen::Index i = 0; i < count; ++i) {
    const Closure& closure = model.closures()[static_cast<size_t>(i)];
    if (!closure.switched) continue;
    check_state(closure, z);
    if (attach.size() == 0 || std::isnan(attach[i])) continue;
    if (attach[i] != 0.0 && attach[i] != 1.0)
      fail(closure,
           fmt::format("its input is {}; 1 (attach), 0 (release) or nan is expected", attach[i]));
    double& state = z[closure.z_index];
    if (attach[i] == 0.0) {
      state = Closure::kReleased;
    } else if (state == Closure::kReleased) {
      state = Closure::kAttached;
      if (closure.in_place)
        z.segment<7>(closure.z_index + 1) = pose_in_place(
            closure, body_pose(model, q, closure.body_a), body_pose(model, q, closure.body_b));
    }
  }
}

void break_closures(const Model& model, const ConstraintSet& constraints,
                    const contact::Problem& problem, const VectorX& impulse, double h, VectorX& z) {
  const size_t contacts = constraints.contacts.size(), count = constraints.closures.size();
  for (size_t i = 0; i < count;) {
    const int index = constraints.closures[i].index;
    Force sum;
    for (; i < count && constraints.closures[i].index == index; ++i) {
      const int c = static_cast<int>(contacts + i);
      sum += pair_impulse(constraints.pairs[contacts + i], impulse.data() + problem.first_row(c));
    }
    const Closure& closure = model.closures()[static_cast<size_t>(index)];
    if (closure.can_break()) break_by(closure, sum * (1.0 / h), z);
  }
}

void break_closures(const Model& model, std::span<const ClosureForce> forces, VectorX& z) {
  for (size_t i = 0; i < forces.size(); ++i) {
    const Closure& closure = model.closures()[i];
    if (closure.can_break()) break_by(closure, forces[i].force, z);
  }
}

}  // namespace counterpoint
