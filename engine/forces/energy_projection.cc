#include "counterpoint/engine/forces/energy_projection.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"

namespace counterpoint {
namespace {

/// Rotation in a step [rad] from which (to twice of it) the lag moves from 0.5 to far_lag.
constexpr double kSmallTurn = 0.5 * EnergyProjection::kFarTurn;

/// Lag of trees without a prediction, and of those that turn far.
double far_lag(bool floats) { return floats ? 1.0 : 0.0; }

double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

/// Sums up a tree's motion: V [rad/s, m/s] are velocities of bodies, v of coordinates; poses from
/// `data`.
TreeMotion motion_of(const Model& model, const Tree& tree, const VectorX& rotors,
                     const VectorRef& v, const Kinematics& data, const std::vector<Motion>& V) {
  TreeMotion motion;
  motion.floats = model.body(tree.body_begin).joint_type == JointType::kFloating;
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    const SpatialInertia& inertia = model.body(i).inertia;
    const Matrix3& R_WB = data.X_WB[i].rotation;
    const Vector3 velocity = V[i].at(R_WB * inertia.center);
    const Vector3 omega_B = R_WB.transpose() * V[i].angular;
    motion.momentum += inertia.mass * velocity;
    motion.mass += inertia.mass;
    motion.energy +=
        0.5 * (inertia.mass * velocity.squaredNorm() + omega_B.dot(inertia.rotational * omega_B));
  }
  const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
  motion.energy += 0.5 * v(part).cwiseAbs2().dot(rotors(part));
  if (motion.floats) motion.energy -= 0.5 * motion.momentum.squaredNorm() / motion.mass;
  return motion;
}

}  // namespace

JointTurn joint_turn(const Model& model, const Tree& tree, double h, const VectorRef& v) {
  JointTurn most;
  double fastest = 0.0;
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    const Body& body = model.body(i);
    const int linear = joint_num_linear(body.joint_type);
    const int count = joint_nv(body.joint_type) - linear;
    const double speed = v.segment(body.v_index + linear, count).squaredNorm();
    if (!(speed > fastest)) continue;
    fastest = speed;
    most.first = body.v_index + linear;
    most.count = count;
  }
  most.angle = h * std::sqrt(fastest);
  return most;
}

double EnergyProjection::lag(double turn, bool predicted, bool floats) {
  const double far = far_lag(floats);
  return predicted ? 0.5 + (far - 0.5) * smooth_step((turn - kSmallTurn) / kSmallTurn) : far;
}

double EnergyProjection::lag_slope(double turn, bool predicted, bool floats) {
  if (!predicted) return 0.0;
  const double x = std::clamp((turn - kSmallTurn) / kSmallTurn, 0.0, 1.0);
  return (floats ? 3.0 : -3.0) * x * (1.0 - x) / kSmallTurn;
}

double EnergyProjection::share_of(double rate) {
  return smooth_step((rate - kSlow) / (kFast - kSlow));
}

double EnergyProjection::share_slope(double rate) {
  const double x = std::clamp((rate - kSlow) / (kFast - kSlow), 0.0, 1.0);
  return 6.0 * x * (1.0 - x) / (kFast - kSlow);
}

EnergyProjection::EnergyProjection(const Model& model)
    : V_(model.num_bodies()),
      q_(VectorX::Zero(model.nq())),
      plain_(VectorX::Zero(model.nv())),
      change_(VectorX::Zero(model.nv())),
      taken_(VectorX::Zero(model.nv())),
      reached_(VectorX::Zero(model.nv())),
      zero_(VectorX::Zero(model.nv())),
      corrected_(model.num_trees()),
      switched_(model.num_trees(), 0),
      scale_(model.num_trees(), 1.0),
      share_(model.num_trees(), 0.0) {
  for (int t = 0; t < model.num_trees(); ++t)
    corrected_[t] = model.trees()[t].body_end - model.trees()[t].body_begin > 1;
  for (int i = 1; i < model.num_bodies(); ++i)
    if (model.joint(i - 1).prescribed) corrected_[model.body(i).tree] = 0;
  for (const Closure& closure : model.closures())
    for (const int body : {closure.body_a, closure.body_b})
      if (body > 0 && !closure.switched) corrected_[model.body(body).tree] = 0;
  for (const Closure& closure : model.closures()) {
    if (!closure.switched) continue;
    for (const int body : {closure.body_a, closure.body_b})
      if (body > 0) switched_[model.body(body).tree] = 1;
  }
  if (std::find(corrected_.begin(), corrected_.end(), 1) != corrected_.end())
    scratch_.emplace(model);
}

/// Whether a switched closure acts on a tree.
bool EnergyProjection::is_held(const StepContext& at, int t) {
  const auto holds = [&](const Closure& c) {
    return c.switched && c.acts(at.z) &&
           (at.model.body(c.body_a).tree == t || at.model.body(c.body_b).tree == t);
  };
  return std::any_of(at.model.closures().begin(), at.model.closures().end(), holds);
}

double EnergyProjection::apply(const StepContext& at, bool predicted, const VectorX& rotors, int t,
                               Data& data) {
  const Model& model = at.model;
  const double h = at.h();
  share_[t] = 0.0;
  if (!corrected_[t] || (switched_[t] && is_held(at, t))) return 0.0;
  const Tree& tree = model.trees()[t];
  double fastest = 0.0;
  for (int k = tree.body_begin; k < tree.body_end; ++k)
    fastest = std::max(fastest, data.V[k].angular.squaredNorm());
  const double share = share_of(h * fastest / (predicted ? kPredictedFactor : 1.0));
  if (!(share > 0.0) || !find_change(at, predicted, rotors, t, share, data)) return 0.0;
  share_[t] = share;
  const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
  taken_(part) = change_(part);
  // M times taken_ / h is the mean force: include the rest of the forces at the start of the step.
  if (!predicted) taken_(part) += (1.0 - share) * plain_(part);
  set_force(model, h, rotors, tree, data);
  return share;
}

bool EnergyProjection::find_change(const StepContext& at, bool predicted, const VectorX& rotors,
                                   int t, double share, Data& data) {
  const Model& model = at.model;
  const Tree& tree = model.trees()[t];
  const BodyRange bodies = {tree.body_begin, tree.body_end};
  const int begin = tree.v_begin, size = tree.v_end - tree.v_begin;
  compute_inertias(model, bodies, data);
  const TreeMotion start = motion_at(at, t, 0.0, at.v, predicted, rotors, data);
  if (!aba(model, zero_, rotors, Vector3::Zero(), bodies, data, plain_)) return false;

  auto plain = plain_.segment(begin, size);
  plain *= at.h();
  const auto w = at.v.segment(begin, size);
  reached_.segment(begin, size) = w + plain;
  const TreeMotion end = keep_energy(at, t, predicted, rotors, start.energy, data);
  auto reached = reached_.segment(begin, size);
  if (start.floats) {  // coordinates are along the axes of the joint's frame
    const Matrix3& R_WJ = model.body(bodies.begin).X_PJ.rotation;
    reached.head<3>() += R_WJ.transpose() * (start.momentum - end.momentum) / start.mass;
  }
  change_.segment(begin, size) = share * (reached - w);
  return true;
}

// Returns the motion at the pose q (+) (from - lag) h x, where the energy of velocities x [m/s,
// rad/s] is measured if they lead to the pose q (+) from h x. data: poses at q.
TreeMotion EnergyProjection::motion_at(const StepContext& at, int t, double from,
                                       const VectorRef& x, bool predicted, const VectorX& rotors,
                                       const Kinematics& data) {
  const Model& model = at.model;
  const double h = at.h();
  const Tree& tree = model.trees()[t];
  const BodyRange bodies = {tree.body_begin, tree.body_end};
  const bool floats = model.body(tree.body_begin).joint_type == JointType::kFloating;
  const double back =
      predicted ? lag(joint_turn(model, tree, h, x).angle, predicted, floats) : far_lag(floats);
  const bool elsewhere = from != back;
  if (elsewhere) {
    integrate_configuration(model, at.q, x, (from - back) * h, bodies, q_);
    compute_poses(model, q_, bodies, *scratch_);
  }
  const Kinematics& there = elsewhere ? *scratch_ : data;
  compute_body_velocities(model, x, bodies, there, V_);
  return motion_of(model, tree, rotors, x, there, V_);
}

// Scales reached_ such that the kinetic energy, as measured by motion_at, is `energy`. If it is
// measured at q, it is proportional to the square of the scale. Otherwise the scale is the root of
// an equation in one variable; it exists, since the energy goes from 0 to infinity with the scale.
// Secant method from 1, kept in a bracket.
TreeMotion EnergyProjection::keep_energy(const StepContext& at, int t, bool predicted,
                                         const VectorX& rotors, double energy,
                                         const Kinematics& data) {
  const Tree& tree = at.model.trees()[t];
  constexpr int kMaxTrials = 60;
  auto reached = reached_.segment(tree.v_begin, tree.v_end - tree.v_begin);
  TreeMotion motion = motion_at(at, t, 1.0, reached_, predicted, rotors, data);
  if (!predicted && motion.floats) {
    const double factor =
        energy > 0.0 && motion.energy > 0.0 ? std::sqrt(energy / motion.energy) : 1.0;
    reached *= factor;
    motion.momentum *= factor;
    scale_[t] = factor;
    return motion;
  }
  double low = 0.0, high = std::numeric_limits<double>::infinity();
  double before = 0.0, excess_before = -1.0, scale = 1.0;
  for (int trial = 0; trial < kMaxTrials; ++trial) {
    if (trial > 0) motion = motion_at(at, t, 1.0, reached_, predicted, rotors, data);
    // Relative excess of speed; nearly equal to the relative excess of the scale.
    const double excess =
        energy > 0.0 ? std::sqrt(std::max(0.0, motion.energy) / energy) - 1.0 : 0.0;
    if (!(std::abs(excess) > tolerance_)) break;
    (excess < 0.0 ? low : high) = scale;
    double next = scale - excess * (scale - before) / (excess - excess_before);
    if (!(next > low && next < high)) next = std::isfinite(high) ? 0.5 * (low + high) : 2.0 * low;
    before = scale;
    excess_before = excess;
    reached *= next / scale;
    scale = next;
  }
  scale_[t] = scale;
  return motion;
}

void EnergyProjection::set_force(const Model& model, double h, const VectorX& rotors,
                                 const Tree& tree, Data& data) {
  const int begin = tree.v_begin, size = tree.v_end - tree.v_begin;
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    const Body& body = model.body(i);
    Motion A =
        joint_motion(body.joint_type, &data.axis[body.v_index], taken_.data() + body.v_index) *
        (-1.0 / h);
    if (body.parent != 0) A += shift(data.A[body.parent], data.arm[i]);
    data.A[i] = A;
    data.has_mean_force[i] = 1;
    data.mean_force[i] = rigid_body_force(body.inertia, data.X_WB[i].rotation, data.A[i]);
  }
  data.mean_rotor_force.segment(begin, size) =
      rotors.segment(begin, size).cwiseProduct(taken_.segment(begin, size)) / h;
}

}  // namespace counterpoint
