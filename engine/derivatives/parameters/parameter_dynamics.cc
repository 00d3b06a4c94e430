#include "counterpoint/engine/derivatives/parameters/parameter_dynamics.h"

#include "counterpoint/engine/dynamics/gravity_compensation.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

using K = StepParameterKind;

/// Calls act(parameter, column) for all parameters of a kind.
template <class Act>
void for_each(const std::vector<PreparedParameter>& parameters, K kind, Act&& act) {
  for (size_t i = 0; i < parameters.size(); ++i)
    if (parameters[i].kind() == kind) act(parameters[i], static_cast<Eigen::Index>(i));
}

/// Returns the direction of gravity, or zero.
Vector3 down_of(const Model& model, EffectSet effects) {
  return effects.has(Effect::kGravity) && !model.gravity().isZero(0.0)
             ? Vector3(model.gravity().normalized())
             : Vector3(Vector3::Zero());
}

Vector6 stacked(const Force& f) {
  Vector6 out;
  out << f.torque, f.force;
  return out;
}

}  // namespace

TreeTerms tree_terms(const Model& model, int t, const InvertedStep& inverted) {
  if (!inverted.has_coriolis) return TreeTerms::kNone;
  const Tree& tree = model.trees()[static_cast<size_t>(t)];
  if (tree.body_end - tree.body_begin == 1) {
    for (int n = 0; n < inverted.start.free_flight().num_flyers(); ++n)
      if (inverted.start.free_flight().body(n) == tree.body_begin) return TreeTerms::kNone;
    return TreeTerms::kPlain;
  }
  if (inverted.start.energy_projection().share(t) > 0.0) return TreeTerms::kProjected;
  return inverted.start.predictor().covers(t) ? TreeTerms::kPredicted : TreeTerms::kPlain;
}

ParameterDynamics::ParameterDynamics(const Model& model, size_t num_parameters)
    : sweep_(model),
      regressor_(model),
      zero_(VectorX::Zero(model.nv())),
      at_(zero_),
      by_prediction_(MatrixX::Zero(model.nv(), static_cast<Eigen::Index>(num_parameters))),
      dq_(MatrixX::Zero(model.nv(), model.nv())),
      dv_(dq_),
      M_(dq_) {}

void ParameterDynamics::add(const Parameters& parameters, const InverseArguments& of,
                            const InvertedStep& inverted, MatrixX& du) {
  const Model& model = of.model;
  const EffectSet effects = of.effects;
  const VectorRef &v = of.v, &v_next = of.v_next;
  const double h = of.h();
  const Vector3 gravity =
      effects.has(Effect::kGravity) ? model.gravity() : Vector3(Vector3::Zero());
  const Vector3 down = down_of(model, effects);
  acceleration_ = (v_next - v) / h;
  for (int t = 0; t < model.num_trees(); ++t) {
    const Tree& tree = model.trees()[static_cast<size_t>(t)];
    const TreeTerms terms = tree_terms(model, t, inverted);
    regressor_.set_motion(model, terms == TreeTerms::kPlain ? v.data() : nullptr,
                          acceleration_.data(), gravity, inverted.at());
    add_inertias(parameters, model, tree, inverted.at(), 1.0, du);
    if (terms == TreeTerms::kPredicted) add_prediction(parameters, of, tree, gravity, inverted, du);
  }
  regressor_.set_motion(model, nullptr, nullptr, down, inverted.at());
  add_gravity(parameters, model, moving_bodies(model), inverted.at(), du);
  if (inverted.has_coriolis) add_flyers(parameters, of, gravity, down, inverted, du);
  for_each(parameters, K::kDamping, [&](const PreparedParameter& p, Eigen::Index k) {
    for (const int i : p.parameter.targets)
      if (effects.has(Effect::kDamping)) du(i, k) += v_next[i];
  });
  for_each(parameters, K::kArmature, [&](const PreparedParameter& p, Eigen::Index k) {
    for (const int i : p.parameter.targets)
      if (effects.has(Effect::kArmature)) du(i, k) += (v_next[i] - v[i]) / h;
  });
}

/// Adds the derivative of inverse dynamics by inertial parameters at the regressor's motion, for
/// one tree.
void ParameterDynamics::add_inertias(const Parameters& parameters, const Model& model,
                                     const Tree& tree, const Kinematics& data, double factor,
                                     MatrixX& out) const {
  for_each(parameters, K::kInertia, [&](const PreparedParameter& p, Eigen::Index k) {
    for (size_t i = 0; i < p.parameter.targets.size(); ++i) {
      const int body = p.parameter.targets[i];
      if (body >= tree.body_begin && body < tree.body_end)
        regressor_.add(model, body, p.parameter.changes[i], factor, data, out.col(k));
    }
  });
}

/// Adds the derivative by the magnitude of gravity; the regressor must be set to gravity of
/// magnitude 1.
void ParameterDynamics::add_gravity(const Parameters& parameters, const Model& model,
                                    BodyRange bodies, const Kinematics& data, MatrixX& out) const {
  for_each(parameters, K::kGravity, [&](const PreparedParameter&, Eigen::Index k) {
    for (int b = bodies.begin; b < bodies.end; ++b)
      regressor_.add(model, b, inertial_parameters(model.body(b).inertia), 1.0, data, out.col(k));
    for (const GravityCompensation& carried : compensations_of(model, bodies)) {
      const SpatialInertia point{carried.mass, carried.center, Matrix3::Zero()};
      regressor_.add(model, carried.body, inertial_parameters(point), -1.0, data, out.col(k));
    }
  });
}

/// Sets by_prediction_: derivatives by the parameters of the prediction's equation, inverse
/// dynamics with joint forces at the predicted acceleration (f - v) / h.
void ParameterDynamics::find_prediction(const Parameters& parameters, const InverseArguments& of,
                                        const Tree& tree, const Vector3& gravity,
                                        const InvertedStep& inverted) {
  const Model& model = of.model;
  const EffectSet effects = of.effects;
  const VectorRef& v = of.v;
  const double h = of.h();
  const VectorX& f = inverted.start.predictor().velocity();
  const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
  const auto holds = [&](int i) { return i >= tree.v_begin && i < tree.v_end; };
  at_.setZero();
  at_(part) = (f(part) - v(part)) / h;
  by_prediction_.setZero();
  regressor_.set_motion(model, v.data(), at_.data(), gravity, inverted.at());
  add_inertias(parameters, model, tree, inverted.at(), 1.0, by_prediction_);
  regressor_.set_motion(model, nullptr, nullptr, down_of(model, effects), inverted.at());
  add_gravity(parameters, model, {tree.body_begin, tree.body_end}, inverted.at(), by_prediction_);
  for_each(parameters, K::kDamping, [&](const PreparedParameter& p, Eigen::Index k) {
    for (const int i : p.parameter.targets)
      if (holds(i) && effects.has(Effect::kDamping)) by_prediction_(i, k) += f[i];
  });
  for_each(parameters, K::kArmature, [&](const PreparedParameter& p, Eigen::Index k) {
    for (const int i : p.parameter.targets)
      if (holds(i) && effects.has(Effect::kArmature)) by_prediction_(i, k) += at_[i];
  });
}

/// Adds dB(v, f) + B(v, df), f the predicted velocity, with (M + D) df / h = -by_prediction_.
void ParameterDynamics::add_prediction(const Parameters& parameters, const InverseArguments& of,
                                       const Tree& tree, const Vector3& gravity,
                                       const InvertedStep& inverted, MatrixX& du) {
  const Model& model = of.model;
  const EffectSet effects = of.effects;
  const VectorRef& v = of.v;
  const double h = of.h();
  const int begin = tree.v_begin, n = tree.v_end - tree.v_begin;
  const auto part = Eigen::seqN(begin, n);
  // B(v, f) = n((v + f) / 2) - n((v - f) / 2).
  for (const double sign : {1.0, -1.0}) {
    at_.setZero();
    at_(part) = 0.5 * (v(part) + sign * inverted.start.predictor().velocity()(part));
    regressor_.set_motion(model, at_.data(), nullptr, Vector3::Zero(), inverted.at());
    add_inertias(parameters, model, tree, inverted.at(), sign, du);
  }
  find_prediction(parameters, of, tree, gravity, inverted);
  // B(v, .) is half of dn/dv.
  SweepInput in;
  in.v = v.data();
  in.a = zero_.data();
  sweep_.run(model, tree, inverted.at(), in, {dq_, dv_, M_});
  if (effects.has(Effect::kArmature))
    M_.diagonal().segment(begin, n) += model.armature().segment(begin, n);
  if (effects.has(Effect::kDamping))
    M_.diagonal().segment(begin, n) += h * model.damping().segment(begin, n);
  if (effects.has(Effect::kSprings)) {
    for (const JointSpring& spring : model.springs()) {
      const int i = model.body(spring.joint + 1).v_index;
      if (i >= begin && i < begin + n) M_(i, i) += h * h * spring.stiffness;
    }
  }
  auto columns = by_prediction_.middleRows(begin, n);
  solver_.begin(M_.block(begin, begin, n, n), static_cast<int>(columns.cols()));
  solver_.add(columns, 0, -0.5 * h);
  if (!solver_.solve()) return;
  solver_.get(0, columns);
  du.middleRows(begin, n) += dv_.block(begin, begin, n, n).lazyProduct(columns);
}

/// Adds the mean forces of free bodies by extrapolated differences of mean_force alone.
void ParameterDynamics::add_flyers(const Parameters& parameters, const InverseArguments& of,
                                   const Vector3& gravity, const Vector3& down,
                                   const InvertedStep& inverted, MatrixX& du) const {
  const Model& model = of.model;
  const VectorRef& v = of.v;
  const double h = of.h();
  for (int n = 0; n < inverted.start.free_flight().num_flyers(); ++n) {
    const int i = inverted.start.free_flight().body(n);
    const Body& body = model.body(i);
    const Matrix3& R = inverted.at().X_WB[i].rotation;
    const Vector3 omega = v.segment<3>(body.v_index + joint_num_linear(body.joint_type));
    const auto add = [&](Eigen::Index k, const Vector6& change) {
      const Force f{R * change.head<3>(), R * change.tail<3>()};
      for (int j = body.v_index; j < body.v_index + joint_nv(body.joint_type); ++j)
        du(j, k) += dot(inverted.at().axis[j], f);
    };
    std::array<Vector6, 4> at;
    for_each(parameters, K::kInertia, [&](const PreparedParameter& p, Eigen::Index k) {
      if (p.flights.empty() || !p.has(i)) return;
      for (size_t s = 0; s < at.size(); ++s)
        at[s] = stacked(p.flights[s].flight.mean_force(p.flights[s].model, n, h, omega,
                                                       R.transpose() * gravity));
      add(k, p.flight_scheme(at));
    });
    if (gravity.isZero(0.0)) continue;
    const DifferenceScheme scheme = difference_scheme(1e-3 * gravity.norm(), 0.0, true);
    for_each(parameters, K::kGravity, [&](const PreparedParameter&, Eigen::Index k) {
      for (size_t s = 0; s < at.size(); ++s)
        at[s] = stacked(inverted.start.free_flight().mean_force(
            model, n, h, omega, R.transpose() * (gravity + scheme.at[s] * down)));
      add(k, scheme(at));
    });
  }
}

}  // namespace counterpoint
