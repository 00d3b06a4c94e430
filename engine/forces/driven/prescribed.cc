#include "counterpoint/engine/forces/driven/prescribed.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"
#include "counterpoint/engine/fault.h"

namespace counterpoint {
namespace {

/// Inertia of an eliminated coordinate in the contact problem [kg, kg m^2]: it is alone in its row
/// and must not count in the momentum that residuals are relative to.
constexpr double kAloneInertia = 1e-9;

/// Copies the given coordinates of a joint; leaves it where it stands if one of them is NaN.
void take(const Model& model, int joint, const VectorX& given, VectorX& q) {
  const Body& body = model.body(joint + 1);
  const int nq = joint_nq(body.joint_type);
  const auto part = given.segment(body.q_index, nq);
  if (part.hasNaN()) return;
  const auto fail = [&](const std::string& what) {
    throw InputError(
        fmt::format("joint '{}', whose motion is prescribed: {}", model.joint(joint).name, what));
  };
  if (!part.allFinite()) fail("a given coordinate is infinite; a number is expected");
  const bool turns = nq != joint_nv(body.joint_type);
  if (turns && std::abs(part.tail<4>().norm() - 1.0) > kQuaternionTolerance)
    fail(fmt::format("the given quaternion has length {:.9g}; 1 is expected",
                     part.tail<4>().norm()));
  q.segment(body.q_index, nq) = part;
}

}  // namespace

PrescribedMotion::PrescribedMotion(const Model& model) {
  for (int i = 0; i < model.num_joints(); ++i) {
    if (!model.joint(i).prescribed) continue;
    joints_.push_back(i);
    const Body& body = model.body(i + 1);
    for (int k = 0; k < joint_nv(body.joint_type); ++k) coordinates_.push_back(body.v_index + k);
  }
  if (joints_.empty()) return;
  target_ = model.default_q();
  velocity_ = VectorX::Zero(model.nv());
}

void PrescribedMotion::find(const StepContext& at, const Input& input) {
  shifts_.clear();
  target_ = at.q;
  if (input.prescribed.size() != 0)
    for (const int joint : joints_) take(at.model, joint, input.prescribed, target_);
  configuration_difference(at.model, at.q, target_, velocity_);
  velocity_ /= at.h();
  for (const int joint : joints_) {  // standing still without rounding
    const Body& body = at.model.body(joint + 1);
    const auto q = Eigen::seqN(body.q_index, joint_nq(body.joint_type));
    if (target_(q) == at.q(q)) velocity_.segment(body.v_index, joint_nv(body.joint_type)).setZero();
  }
}

void PrescribedMotion::lock(double h, const VectorRef& v, VectorOut diagonal, VectorOut tau) const {
  for (const int k : coordinates_) {
    diagonal[k] = kLockedInertia;
    tau[k] = kLockedInertia * ((velocity_[k] - v[k]) / h);
  }
}

void PrescribedMotion::eliminate(const Model& model, const std::vector<int>& block_of_tree,
                                 contact::Problem& problem) {
  shifts_.assign(static_cast<size_t>(problem.num_constraints()), 0.0);
  const auto place = [&](int k) {
    const int t = model.tree_of_velocity(k);
    return std::pair(block_of_tree[static_cast<size_t>(t)], k - model.trees()[t].v_begin);
  };
  for (const int k : coordinates_) {
    const auto [block, i] = place(k);
    if (block < 0) continue;
    contact::MatrixMap mass = problem.mass(block);
    mass.row(i).setZero();
    mass.col(i).setZero();
    mass(i, i) = kAloneInertia;
    problem.free_velocity()[problem.block_start(block) + i] = velocity_[k];
    for (int c = 0; c < problem.num_constraints(); ++c) {
      for (int side = 0; side < 2; ++side) {
        if (problem.block(c, side) != block) continue;
        contact::MatrixMap J = problem.jacobian(c, side);
        for (int row = 0; row < J.rows(); ++row)
          problem.law(c).bias[static_cast<size_t>(row)] += J(row, i) * velocity_[k];
        shifts_[static_cast<size_t>(c)] += J(0, i) * velocity_[k];
        J.col(i).setZero();
      }
    }
  }
}

void PrescribedMotion::set(const Model& model, VectorX& q, VectorX& v) const {
  for (const int k : coordinates_) v[k] = velocity_[k];
  for (const int joint : joints_) {
    const Body& body = model.body(joint + 1);
    const int nq = joint_nq(body.joint_type);
    q.segment(body.q_index, nq) = target_.segment(body.q_index, nq);
  }
}

}  // namespace counterpoint
