#include "counterpoint/engine/forces/taut_links.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {
namespace {

/// Target of h times the rate of a taut link: a step resolves it to a few percent in energy.
constexpr double kTurn = 1.0;
/// A step is repeated if its own forces ask for more than this times its factors. At this ratio h
/// times the rate is 1.4; the stability limit is 2.
constexpr double kTooFast = 2.0;
constexpr double kMostFactor = 1e9;

/// Returns the square of the fastest rate at which forces turn a link back [1/s^2]. moments: sum r
/// F' [N m]; inertia: about the centre of mass; both in the same frame.
double fastest_rate(const Matrix3& moments, const Matrix3& inertia) {
  Matrix3 stiffness = -0.5 * (moments + moments.transpose());
  stiffness.diagonal().array() += moments.trace();
  const Eigen::LLT<Matrix3> llt(inertia);
  if (llt.info() != Eigen::Success) return 0.0;
  Matrix3 reduced = llt.matrixL().solve(stiffness);
  reduced = llt.matrixL().solve(Matrix3(reduced.transpose()));
  Eigen::SelfAdjointEigenSolver<Matrix3> eigen;
  eigen.computeDirect(Matrix3(0.5 * (reduced + reduced.transpose())), Eigen::EigenvaluesOnly);
  return std::max(0.0, eigen.eigenvalues()[2]);
}

double wanted_factor(double h, double rate) {
  return std::clamp(h * h * rate / (kTurn * kTurn), 1.0, kMostFactor);
}

}  // namespace

TautLinks::TautLinks(const Model& model, bool called) {
  const auto bodies = static_cast<size_t>(model.num_bodies());
  factor_.assign(bodies, 1.0);
  before_ = factor_;
  if (!called) return;
  model_ = model;
  slowed_ = model;
  pulled_ = list_pulled_links(model);
  is_pulled_.assign(bodies, 0);
  for (const int i : pulled_) is_pulled_[static_cast<size_t>(i)] = 1;
  for (const int i : pulled_) {
    const Body& body = model.body(i);
    if (body.joint_type != JointType::kFloating || body.subtree_end > i + 1)
      tree_links_.push_back(i);
  }
  rate_.assign(bodies, 0.0);
  moments_.assign(bodies, Matrix3::Zero());
  links_.reserve(bodies);
  loss_.reserve(bodies);
  changed_.reserve(bodies);
}

void TautLinks::clear() {
  for (const TautLink& link : links_) {
    const auto i = static_cast<size_t>(link.body);
    before_[i] = factor_[i] = 1.0;
  }
  links_.clear();
}

void TautLinks::recall(double h, const std::vector<RememberedForce>& memory) {
  clear();
  for (const RememberedForce& r : memory) {
    const auto i = static_cast<size_t>(r.a);
    if (r.kind != RememberedForce::Kind::kTautLink || i >= is_pulled_.size() || !is_pulled_[i])
      continue;
    if (!(r.force[0] >= 1.0 && r.force[2] >= 0.0)) continue;
    before_[i] = r.force[0];
    factor_[i] = wanted_factor(h, r.force[2]);
  }
  list();
}

void TautLinks::set(std::span<const TautLink> links) {
  clear();
  for (const TautLink& link : links) {
    const auto i = static_cast<size_t>(link.body);
    if (i == 0 || i >= factor_.size() || !(link.kept >= 1.0 && link.kept <= link.factor) ||
        !std::isfinite(link.factor))
      throw InputError(fmt::format(
          "taut link: body {} with factors {} and {}; a moving body, and numbers from 1 on are "
          "expected, the second no larger than the first",
          link.body, link.factor, link.kept));
  }
  links_.assign(links.begin(), links.end());
  for (const TautLink& link : links_) {
    factor_[static_cast<size_t>(link.body)] = link.factor;
    before_[static_cast<size_t>(link.body)] = link.kept;
  }
}

void TautLinks::list() {
  links_.clear();
  for (const int body : pulled_) {
    const auto i = static_cast<size_t>(body);
    if (factor_[i] > 1.0 || before_[i] > 1.0)
      links_.push_back({body, factor_[i], std::min(before_[i], factor_[i])});
  }
}

const Model& TautLinks::slowed(const Model& model) {
  if (links_.empty()) return model;
  if (!model_) slowed_ = model_ = model;
  ModelEditor editor(std::move(*slowed_));
  for (const int body : changed_) editor.set_inertia(body, model_->body(body).inertia);
  changed_.clear();
  for (const TautLink& link : links_) {
    SpatialInertia inertia = model_->body(link.body).inertia;
    inertia.rotational *= link.factor;
    editor.set_inertia(link.body, inertia);
    changed_.push_back(link.body);
  }
  *slowed_ = editor.take();
  return *slowed_;
}

void TautLinks::find_losses(const Model& slowed, double h, const Kinematics& data) {
  loses_ = false;
  loss_.clear();
  for (const TautLink& link : links_) {
    const Matrix3& R_WB = data.X_WB[link.body].rotation;
    const Matrix3& inertia = slowed.body(link.body).inertia.rotational;
    const Vector3 omega_B = R_WB.transpose() * data.V[link.body].angular;
    const double share = (1.0 - link.kept / link.factor) / h;
    loss_.push_back(R_WB * (inertia * omega_B) * -share);
    loses_ = loses_ || share > 0.0;
  }
}

void TautLinks::add_losses(ExternalForces& external) const {
  for (size_t i = 0; i < loss_.size(); ++i) external.external[links_[i].body].torque += loss_[i];
}

void TautLinks::add_force(int body, const Vector3& point, const Vector3& force,
                          const Kinematics& data) {
  if (!is_pulled_[static_cast<size_t>(body)]) return;
  const Pose& X_WB = data.X_WB[body];
  const Vector3 arm = point - X_WB * model_->body(body).inertia.center;
  moments_[static_cast<size_t>(body)] += arm * force.transpose();
}

void TautLinks::find_rates(const ConstraintSet& constraints, const contact::Problem& problem,
                           const VectorX& impulse, double h, const std::vector<Force>& joint_force,
                           std::span<const ExternalWrench> wrenches, const Kinematics& data) {
  for (const int body : pulled_) moments_[static_cast<size_t>(body)].setZero();
  for (const ExternalWrench& w : wrenches)
    add_force(w.body, data.X_WB[w.body] * w.point, w.wrench.force, data);
  for (size_t i = constraints.contacts.size(); i < constraints.pairs.size(); ++i) {
    const PairConstraint& pair = constraints.pairs[i];
    const Force force =
        pair_impulse(pair, impulse.data() + problem.first_row(static_cast<int>(i))) * (1.0 / h);
    add_force(pair.body_a, pair.position, -force.force, data);
    add_force(pair.body_b, pair.position, force.force, data);
  }
  if (needs_joint_forces()) {
    for (int i = 1; i < model_->num_bodies(); ++i) {
      const Body& body = model_->body(i);
      if (body.joint_type == JointType::kFloating) continue;
      const Vector3& force = joint_force[static_cast<size_t>(i)].force;
      add_force(i, data.X_WB[i].translation, force, data);
      add_force(body.parent, data.X_WB[i].translation, -force, data);
    }
  }
  for (const int body : pulled_) {
    const auto i = static_cast<size_t>(body);
    const Matrix3& R_WB = data.X_WB[body].rotation;
    const Matrix3 turned = R_WB.transpose() * moments_[i] * R_WB;
    rate_[i] = fastest_rate(turned, model_->body(body).inertia.rotational);
  }
}

bool TautLinks::raise(double h) {
  bool more = false;
  for (const int body : pulled_) {
    const auto i = static_cast<size_t>(body);
    const double wanted = wanted_factor(h, rate_[i]);
    if (!(wanted > kTooFast * factor_[i])) continue;
    factor_[i] = wanted;
    more = true;
  }
  if (more) list();
  return more;
}

void TautLinks::remember(double h, std::vector<RememberedForce>& memory) const {
  for (const int body : pulled_) {
    const auto i = static_cast<size_t>(body);
    if (!(factor_[i] > 1.0 || wanted_factor(h, rate_[i]) > 1.0)) continue;
    RememberedForce r;
    r.kind = RememberedForce::Kind::kTautLink;
    r.a = body;
    r.force = {factor_[i], std::min(before_[i], factor_[i]), rate_[i]};
    memory.push_back(r);
  }
}

void find_taut_links(const State& state, std::vector<TautLink>& links) {
  links.clear();
  for (const RememberedForce& r : state.memory)
    if (r.kind == RememberedForce::Kind::kTautLink && r.force[0] > 1.0)
      links.push_back({r.a, r.force[0], r.force[1]});
}

}  // namespace counterpoint
