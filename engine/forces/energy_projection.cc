#include "counterpoint/engine/forces/energy_projection.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/integrator.h"
#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"

namespace counterpoint {
namespace {

/// From this angle a step [rad] to twice of it the work fades.
constexpr double kSmallTurn = 0.5 * EnergyProjection::kFarTurn;

double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

/// The energy is the one that mid_velocity.h keeps: otherwise a tree that alternates between slow and
/// fast gains or loses the difference each time. h: the step, if the tree has a prediction; else 0:
/// forces at the start of the step keep no energy anyway.
TreeMotion motion_of(const Model& model, const Tree& tree, const VectorX& rotors, double h,
                     const VectorRef& v, Data& data) {
  TreeMotion motion;
  motion.floats = model.body(tree.body_begin).joint_type == JointType::kFloating;
  double fastest = 0.0, work = 0.0;  // of velocity-dependent forces, a second
  Vector3 force = Vector3::Zero();   // theirs on the whole
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    const Motion& V = data.V[i];
    const Force momentum = data.inertia[i] * V;
    motion.momentum += momentum.force;
    motion.mass += model.body(i).inertia.mass;
    motion.energy += 0.5 * dot(V, momentum);
    if (h == 0.0) continue;
    Motion A = data.c[i];
    if (model.body(i).parent != 0) A += shift(data.A[model.body(i).parent], data.arm[i]);
    data.A[i] = A;
    const Force inertial = data.inertia[i] * A;
    work -= dot(V, inertial);
    force -= inertial.force + V.angular.cross(momentum.force);
    fastest = std::max(fastest, V.angular.squaredNorm());
  }
  const int begin = tree.v_begin, size = tree.v_end - tree.v_begin;
  motion.energy += 0.5 * v.segment(begin, size).cwiseAbs2().dot(rotors.segment(begin, size));
  if (motion.floats) motion.energy -= 0.5 * motion.momentum.squaredNorm() / motion.mass;
  if (motion.floats) work -= motion.momentum.dot(force) / motion.mass;
  const double turn = h * std::sqrt(fastest);
  motion.energy += EnergyProjection::share_of_work(turn) * 0.5 * h * work;
  return motion;
}

}  // namespace

double EnergyProjection::share_of_work(double turn) {
  return 1.0 - smooth_step((turn - kSmallTurn) / kSmallTurn);
}

double EnergyProjection::share_of_work_slope(double turn) {
  const double x = std::clamp((turn - kSmallTurn) / kSmallTurn, 0.0, 1.0);
  return -6.0 * x * (1.0 - x) / kSmallTurn;
}

double EnergyProjection::share_of(double rate) {
  return smooth_step((rate - kSlow) / (kFast - kSlow));
}

double EnergyProjection::share_slope(double rate) {
  const double x = std::clamp((rate - kSlow) / (kFast - kSlow), 0.0, 1.0);
  return 6.0 * x * (1.0 - x) / (kFast - kSlow);
}

EnergyProjection::EnergyProjection(const Model& model)
    : q_(VectorX::Zero(model.nq())),
      plain_(VectorX::Zero(model.nv())),
      change_(VectorX::Zero(model.nv())),
      reached_(VectorX::Zero(model.nv())),
      zero_(VectorX::Zero(model.nv())),
      corrected_(model.num_trees()),
      scale_(model.num_trees(), 1.0),
      share_(model.num_trees(), 0.0) {
  for (int t = 0; t < model.num_trees(); ++t)
    corrected_[t] = model.trees()[t].body_end - model.trees()[t].body_begin > 1;
  for (const Closure& closure : model.closures())
    for (const int body : {closure.body_a, closure.body_b})
      if (body > 0) corrected_[model.body(body).tree] = false;
  if (std::find(corrected_.begin(), corrected_.end(), 1) != corrected_.end())
    scratch_.emplace(model);
}

double EnergyProjection::apply(const Model& model, double h, const VectorRef& q, const VectorRef& v,
                               bool predicted, const VectorX& rotors, int t, Data& data) {
  share_[t] = 0.0;
  if (!corrected_[t]) return 0.0;
  const Tree& tree = model.trees()[t];
  double fastest = 0.0;
  for (int k = tree.body_begin; k < tree.body_end; ++k)
    fastest = std::max(fastest, data.V[k].angular.squaredNorm());
  const double share = share_of(h * fastest / (predicted ? kPredictedFactor : 1.0));
  if (!(share > 0.0) || !find_change(model, h, q, v, predicted, rotors, t, share, data)) return 0.0;
  share_[t] = share;
  set_force(model, h, rotors, tree, data);
  return share;
}

bool EnergyProjection::find_change(const Model& model, double h, const VectorRef& q,
                                   const VectorRef& v, bool predicted, const VectorX& rotors, int t,
                                   double share, Data& data) {
  const Tree& tree = model.trees()[t];
  const BodyRange bodies = {tree.body_begin, tree.body_end};
  const int begin = tree.v_begin, size = tree.v_end - tree.v_begin;
  compute_inertias(model, bodies, data);
  const TreeMotion start = motion_of(model, tree, rotors, predicted ? h : 0.0, v, data);
  if (!aba(model, zero_, rotors, Vector3::Zero(), bodies, data, plain_)) return false;

  auto plain = plain_.segment(begin, size);
  plain *= h;
  const auto w = v.segment(begin, size);
  reached_.segment(begin, size) = w + plain;
  const TreeMotion end = keep_energy(model, t, h, q, predicted, rotors, start.energy);
  auto reached = reached_.segment(begin, size);
  if (start.floats) {  // the joint's axes are those of its frame
    const Matrix3& R_WJ = model.body(bodies.begin).X_PJ.rotation;
    reached.head<3>() += R_WJ.transpose() * (start.momentum - end.momentum) / start.mass;
  }
  change_.segment(begin, size) = share * (reached - w);
  return true;
}

// Scales reached_ so that the kinetic energy at the pose that it leads to from q is `energy`.
// A root in one variable that exists, since the energy goes from 0 to infinity with the scale: by
// secants from 1, kept in a bracket.
TreeMotion EnergyProjection::keep_energy(const Model& model, int t, double h, const VectorRef& q,
                                         bool predicted, const VectorX& rotors, double energy) {
  const Tree& tree = model.trees()[t];
  constexpr int kMaxTrials = 60;
  const BodyRange bodies = {tree.body_begin, tree.body_end};
  auto reached = reached_.segment(tree.v_begin, tree.v_end - tree.v_begin);
  TreeMotion motion;
  // Speed over that wanted, less one; it is about the scale over that wanted, less one.
  const auto excess_at_scale = [&] {
    integrate_configuration(model, q, reached_, h, bodies, q_);
    compute_poses(model, q_, bodies, *scratch_);
    compute_velocities(model, reached_, bodies, *scratch_);
    compute_inertias(model, bodies, *scratch_);
    motion = motion_of(model, tree, rotors, predicted ? h : 0.0, reached_, *scratch_);
    return energy > 0.0 ? std::sqrt(std::max(0.0, motion.energy) / energy) - 1.0 : 0.0;
  };
  double low = 0.0, high = std::numeric_limits<double>::infinity();
  double before = 0.0, excess_before = -1.0, scale = 1.0;
  for (int trial = 0; trial < kMaxTrials; ++trial) {
    const double excess = excess_at_scale();
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
        joint_motion(body.joint_type, &data.axis[body.v_index], change_.data() + body.v_index) *
        (-1.0 / h);
    if (body.parent != 0) A += shift(data.A[body.parent], data.arm[i]);
    data.A[i] = A;
    data.has_mean_force[i] = 1;
    data.mean_force[i] = rigid_body_force(body.inertia, data.X_WB[i].rotation, Motion(), data.A[i]);
    data.c[i] = Motion();
  }
  data.mean_rotor_force.segment(begin, size) =
      rotors.segment(begin, size).cwiseProduct(change_.segment(begin, size)) / h;
}

}  // namespace counterpoint
