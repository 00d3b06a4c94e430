#include "mjcf_forces.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/forces/actuators.h"
#include "counterpoint/engine/forces/tendons.h"

namespace counterpoint::apps {
namespace {

/// Sums of gain u + bias of servos and motors, by the name of their joint or tendon.
using Pulls = std::map<std::string, double>;

Pulls pulls_of(const MjcfModel& read, const VectorX& controls,
               std::string MjcfModel::Actuator::*place) {
  Pulls out;
  for (std::size_t i = 0; i < read.actuators.size(); ++i) {
    const MjcfModel::Actuator& a = read.actuators[i];
    if (!(a.*place).empty())
      out[a.*place] += a.gain * controls[static_cast<Eigen::Index>(i)] + a.bias;
  }
  return out;
}

double pull_at(const Pulls& pulls, const std::string& name) {
  const auto found = pulls.find(name);
  return found == pulls.end() ? 0.0 : found->second;
}

/// Adds the forces of actuators on links to `total`.
void add_wrenches(const Dynamics& dynamics, std::span<const ExternalWrench> wrenches,
                  VectorX& total) {
  MatrixX jacobian;
  for (const ExternalWrench& w : wrenches) {
    const Frame& frame = dynamics.model().frames()[static_cast<std::size_t>(w.frame)];
    const Pose X_WF = dynamics.frame_pose(w.frame);
    const Vector3 arm = X_WF * (frame.X_BF.inverse() * w.point) - X_WF.translation;
    dynamics.frame_jacobian(w.frame, jacobian);
    total += jacobian.topRows<3>().transpose() * (w.wrench.torque + arm.cross(w.wrench.force)) +
             jacobian.bottomRows<3>().transpose() * w.wrench.force;
  }
}

}  // namespace

void Differences::add(std::size_t quantity, double ours, double theirs) {
  if (ranges_.size() <= quantity) ranges_.resize(quantity + 1);
  Range& range = ranges_[quantity];
  range.difference = std::max(range.difference, std::abs(ours - theirs));
  range.size = std::max({range.size, std::abs(ours), std::abs(theirs)});
}

double Differences::worst() const {
  double worst = 0.0;
  for (const Range& range : ranges_)
    if (range.difference > 0.0) worst = std::max(worst, range.difference / range.size);
  return worst;
}

Followers::Followers(const Model& model) : model_(model) {
  std::vector<Mimic> left = model.mimics();
  while (!left.empty()) {
    const auto follows_none_left = [&](const Mimic& m) {
      return std::none_of(left.begin(), left.end(),
                          [&](const Mimic& other) { return other.joint == m.master; });
    };
    const auto next = std::find_if(left.begin(), left.end(), follows_none_left);
    order_.push_back(*next);
    left.erase(next);
  }
}

void Followers::place(VectorX& q, VectorX& v) const {
  for (const Mimic& m : order_) {
    const Body &follower = model_.body(m.joint + 1), &master = model_.body(m.master + 1);
    q[follower.q_index] = m.multiplier * q[master.q_index] + m.offset;
    v[follower.v_index] = m.multiplier * v[master.v_index];
  }
}

void Followers::reduce(VectorX& force) const {
  for (auto m = order_.rbegin(); m != order_.rend(); ++m) {
    double& on_follower = force[model_.body(m->joint + 1).v_index];
    force[model_.body(m->master + 1).v_index] += m->multiplier * on_follower;
    on_follower = 0.0;
  }
}

ForceComparison::ForceComparison(const MjcfModel& read, const Model& model, const mjModel& m,
                                 const std::vector<Place>& velocities)
    : read_(read),
      model_(model),
      m_(m),
      velocities_(velocities),
      followers_(model),
      z_(model.default_z()) {
  options_.time_step = kInstant;
}

bool ForceComparison::same_actuators() const {
  if (static_cast<int>(read_.actuators.size()) != m_.nu) return false;
  for (int i = 0; i < m_.nu; ++i) {
    const char* name = mj_id2name(&m_, mjOBJ_ACTUATOR, i);
    if (name && read_.actuators[static_cast<std::size_t>(i)].name != name) return false;
  }
  return true;
}

/// Sets the control of a servo so that its force is within its limits, or within 1 N (N m).
void ForceComparison::hold_within_limits(std::size_t i, const VectorX& q, const VectorX& v,
                                         std::mt19937_64& random, mjData& d) const {
  const MjcfModel::Actuator& a = read_.actuators[i];
  if (a.joint.empty() || a.gain == 0.0) return;
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  const Body& body = model_.body(model_.find_joint(a.joint) + 1);
  const double most = m_.actuator_forcelimited[i] ? m_.actuator_forcerange[2 * i + 1] : 1.0;
  const double force = share(random) * most * std::abs(m_.actuator_gear[6 * i]);
  const double held = a.stiffness * q[body.q_index] + a.damping * v[body.v_index];
  d.ctrl[i] = (force + held - a.bias) / a.gain;
}

/// Draws the activation of an actuator with internal states.
void ForceComparison::activate(std::size_t i, std::mt19937_64& random, mjData& d) {
  const int of_law = read_.actuators[i].commanded;
  if (of_law < 0) return;
  const Actuator& a = model_.actuators()[static_cast<std::size_t>(of_law)];
  std::uniform_real_distribution<double> share(0.0, 1.0);
  double* peer = m_.actuator_actadr[i] < 0 ? nullptr : d.act + m_.actuator_actadr[i];
  double* ours = z_.data() + a.z_index;
  if (a.keeps_setpoint()) *ours++ = controls_[static_cast<Eigen::Index>(i)];
  double filtered = 0.0;
  if (a.lag > 0.0 || a.integrates) {
    const double range = std::isfinite(a.most_command) ? a.most_command - a.least_command : 1.0;
    const double least = std::isfinite(a.least_command) ? a.least_command : 0.0;
    *ours++ = filtered = least + share(random) * range;
  }
  if (a.has_law_state()) {
    const bool bounded = a.law == ActuatorLaw::kPid && std::isfinite(a.integral_limit);
    *ours = share(random) * (bounded ? a.integral_limit / a.ki : 1.0);
    *peer++ = *ours;
  }
  if (a.has_slew()) *peer++ = controls_[static_cast<Eigen::Index>(i)];
  if (a.lag > 0.0 || a.integrates) *peer = filtered;
}

void ForceComparison::draw(const VectorX& q, const VectorX& v, std::mt19937_64& random, mjData& d) {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::normal_distribution<double> normal;
  q_ = q;
  v_ = v;
  controls_ = VectorX::Zero(m_.nu);
  ++draws_;
  for (std::size_t i = 0; i < read_.actuators.size(); ++i) {
    const MjcfModel::Actuator& a = read_.actuators[i];
    // Actuators without a counterpart act only with a control.
    if (a.joint.empty() && a.tendon.empty() && a.commanded < 0) continue;
    d.ctrl[i] = a.least ? *a.least + share(random) * (*a.most - *a.least) : normal(random);
    if (draws_ % 2 == 0) hold_within_limits(i, q, v, random, d);
    if (a.least) d.ctrl[i] = std::clamp(d.ctrl[i], *a.least, *a.most);
    controls_[static_cast<Eigen::Index>(i)] = d.ctrl[i];
    activate(i, random, d);
  }
}

VectorX ForceComparison::forces_of_joints() const {
  VectorX total = -model_.damping().cwiseProduct(v_);
  const Pulls pulls = pulls_of(read_, controls_, &MjcfModel::Actuator::joint);
  for (const JointSpring& spring : model_.springs()) {
    const Body& body = model_.body(spring.joint + 1);
    total[body.v_index] -= spring.stiffness * (q_[body.q_index] - spring.reference);
  }
  for (const MjcfModel::Coordinate& c : read_.coordinates) {
    if (joint_nv(c.type) != 1) continue;
    const int joint = model_.find_joint(c.joint), servo = model_.find_servo(joint);
    const Body& body = model_.body(joint + 1);
    double force = pull_at(pulls, c.joint);
    if (servo >= 0) {
      const JointServo& s = model_.servos()[static_cast<std::size_t>(servo)];
      force -= s.stiffness * q_[body.q_index] + s.damping * v_[body.v_index];
    }
    const double limit = model_.joint(joint).effort_limit;
    total[body.v_index] += std::clamp(force, -limit, limit);
  }
  return total;
}

/// Forces of springs, dampers and servos of tendons.
VectorX ForceComparison::forces_of_tendons(const Dynamics& dynamics) const {
  VectorX total = VectorX::Zero(model_.nv()), arms(model_.nv());
  const Pulls pulls = pulls_of(read_, controls_, &MjcfModel::Actuator::tendon);
  for (std::size_t i = 0; i < model_.tendons().size(); ++i) {
    const Tendon& tendon = model_.tendons()[i];
    const TendonServo& servo = tendon.servo;
    const double length = dynamics.tendon_length(static_cast<int>(i));
    dynamics.tendon_arms(static_cast<int>(i), arms);
    const double speed = arms.dot(v_);
    const double rest = std::clamp(length, tendon.rest_shortest, tendon.rest_longest);
    const double pull =
        pull_at(pulls, tendon.name) - servo.stiffness * length - servo.damping * speed;
    total += arms * (std::clamp(pull, servo.least, servo.most) -
                     tendon.stiffness * (length - rest) - tendon.damping * speed);
  }
  return total;
}

/// Forces of actuators with a command of their own; compares each.
VectorX ForceComparison::forces_of_actuators(const Dynamics& dynamics, const mjData& d) {
  VectorX total = VectorX::Zero(model_.nv()), force, next = z_;
  if (model_.actuators().empty()) return total;
  Data data(model_);
  compute_poses(model_, q_, data);
  Tendons tendons(model_);
  tendons.find(model_, q_, data, {});
  Input input;
  input.command.resize(static_cast<Eigen::Index>(model_.actuators().size()));
  for (std::size_t i = 0; i < read_.actuators.size(); ++i)
    if (const int at = read_.actuators[i].commanded; at >= 0)
      input.command[at] = controls_[static_cast<Eigen::Index>(i)];
  const StepContext context{model_, options_, EffectSet::all(), q_, v_, z_};
  Actuators laws(model_);
  laws.find(context, data, tendons, ConstraintSet(), input);
  laws.conclude(context, tendons, v_, force, next);
  add_wrenches(dynamics, laws.wrenches(), total);
  for (std::size_t i = 0; i < read_.actuators.size(); ++i) {
    const int at = read_.actuators[i].commanded;
    if (at < 0) continue;
    const Actuator& a = model_.actuators()[static_cast<std::size_t>(at)];
    actuators.add(i, force[at], d.actuator_force[i]);
    if (a.transmission == Transmission::kJoint)
      total[model_.body(a.joint + 1).v_index] += a.gear * force[at];
    if (a.transmission == Transmission::kTendon)
      for (const RowTerm& term : tendons.arms(a.tendon))
        total[term.v_index] += a.gear * term.coefficient * force[at];
  }
  return total;
}

void ForceComparison::compare(const Dynamics& dynamics, const mjData& d) {
  VectorX ours = forces_of_joints() + forces_of_tendons(dynamics);
  ours += forces_of_actuators(dynamics, d);
  VectorX theirs(model_.nv());
  for (const auto& [at, peer] : velocities_) {
    // Compensation of gravity is among the forces of actuators where it counts towards their limit.
    const bool counts = m_.jnt_actgravcomp[m_.dof_jntid[peer]] != 0;
    theirs[at] = d.qfrc_spring[peer] + d.qfrc_damper[peer] + d.qfrc_actuator[peer] -
                 (counts ? d.qfrc_gravcomp[peer] : 0.0);
  }
  followers_.reduce(ours);
  followers_.reduce(theirs);
  for (Eigen::Index k = 0; k < ours.size(); ++k)
    joints.add(static_cast<std::size_t>(k), ours[k], theirs[k]);
}

}  // namespace counterpoint::apps
