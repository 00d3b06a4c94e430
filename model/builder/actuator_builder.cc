// Actuators and internal states: the part of ModelBuilder that adds them to finished trees.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "counterpoint/model/builder/builder_names.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

[[noreturn]] void fail_actuator(const ActuatorSpec& spec, const std::string& what) {
  throw InputError(
      located_at(spec.where, fmt::format("actuator '{}': {}", spec.actuator.name, what)));
}

using Numbers = std::vector<std::pair<const char*, double>>;

void check_not_negative(const ActuatorSpec& spec, const Numbers& numbers) {
  for (const auto& [what, value] : numbers)
    if (!(value >= 0.0 && std::isfinite(value)))
      fail_actuator(spec, fmt::format("{} must not be negative, it is {}", what, value));
}

void check_positive(const ActuatorSpec& spec, const Numbers& numbers) {
  for (const auto& [what, value] : numbers)
    if (!(value > 0.0))
      fail_actuator(spec, fmt::format("{} must be positive, it is {}", what, value));
}

void check_muscle(const ActuatorSpec& spec) {
  const Muscle& m = spec.actuator.muscle;
  check_positive(spec, {{"max_force", m.max_force},
                        {"optimal_length", m.optimal_length},
                        {"max_speed", m.max_speed},
                        {"activation_time", m.activation_time},
                        {"deactivation_time", m.deactivation_time},
                        {"longest", m.longest}});
  check_not_negative(spec, {{"max_force", m.max_force},
                            {"optimal_length", m.optimal_length},
                            {"pennation", m.pennation},
                            {"max_speed", m.max_speed},
                            {"damping", m.damping},
                            {"shortest", m.shortest},
                            {"longest", m.longest},
                            {"passive_force", m.passive_force},
                            {"activation_time", m.activation_time},
                            {"deactivation_time", m.deactivation_time},
                            {"activation_smoothing", m.activation_smoothing}});
  // MuJoCo's muscles may have a negative one: only length less slack_length has a meaning there.
  if (!std::isfinite(m.slack_length) ||
      (m.curves == Muscle::Curves::kMillard && m.slack_length < 0.0))
    fail_actuator(spec, fmt::format("slack_length must not be negative, it is {}", m.slack_length));
  if (!(m.pennation < 1.4))
    fail_actuator(spec, fmt::format("pennation must be less than 1.4 rad, it is {}", m.pennation));
  if (!(m.shortest < 1.0 && m.longest > 1.0))
    fail_actuator(spec, "shortest must be less than 1 and longest more, in optimal lengths");
  if (!(m.eccentric_force > 1.0 && std::isfinite(m.eccentric_force)))
    fail_actuator(spec, fmt::format("eccentric_force must exceed 1, it is {}", m.eccentric_force));
}

void check_law(const ActuatorSpec& spec) {
  const Actuator& a = spec.actuator;
  if (!std::isfinite(a.gain) || !std::isfinite(a.bias))
    fail_actuator(spec, "gain and bias must be finite");
  check_not_negative(spec, {{"stiffness", a.stiffness},
                            {"damping", a.damping},
                            {"kp", a.kp},
                            {"ki", a.ki},
                            {"kd", a.kd},
                            {"command_damping", a.command_damping},
                            {"inductance", a.inductance}});
  check_positive(spec, {{"integral_limit", a.integral_limit}, {"current_limit", a.current_limit}});
  if (a.law == ActuatorLaw::kDcMotor)
    check_positive(spec, {{"torque_constant", a.torque_constant}, {"resistance", a.resistance}});
  if (a.law == ActuatorLaw::kMuscle) check_muscle(spec);
  if (!(a.least <= a.most) || (std::isfinite(a.least) != std::isfinite(a.most)))
    fail_actuator(spec,
                  "two finite bounds of the force are expected, the lower one first, or none");
}

void check_command(const ActuatorSpec& spec) {
  const Actuator& a = spec.actuator;
  if (!(a.least_command <= a.most_command))
    fail_actuator(spec, "the range of the command must be ascending");
  if (!std::isfinite(a.command)) fail_actuator(spec, "the command must be finite");
  if (a.integrates && a.law != ActuatorLaw::kAffine)
    fail_actuator(spec, "an integral of the command goes with a force, a position or a velocity");
  if (!(a.least_setpoint <= a.most_setpoint))
    fail_actuator(spec, "the bounds of the command's integral must be ascending");
  if (a.command_damping > 0.0 && (a.least_command < 0.0 || a.integrates))
    fail_actuator(spec, "damping by the command needs a range of the command from 0 on");
  check_not_negative(spec, {{"lag", a.lag}, {"delay", a.delay}});
  check_positive(spec, {{"slew", a.slew}});
  if (a.delay_samples < 0 || a.delay_samples > limits::kMaxDelaySamples)
    fail_actuator(spec, fmt::format("1 to {} delay_samples are expected, not {}",
                                    limits::kMaxDelaySamples, a.delay_samples));
  if ((a.delay > 0.0) != (a.delay_samples > 0))
    fail_actuator(spec, "delay and delay_samples are expected together");
}

/// Appends the internal states of an actuator whose command has been constant.
void append_states(const Actuator& a, std::vector<double>& z) {
  const double command = std::clamp(a.command, a.least_command, a.most_command);
  const auto append = [&](bool has, double value) {
    if (has) z.push_back(value);
  };
  z.insert(z.end(), static_cast<std::size_t>(a.delay_samples), command);
  append(a.delay_samples > 0, 0.0);
  append(a.keeps_setpoint(), command);
  append(a.lag > 0.0, command);
  append(a.integrates, std::clamp(0.0, a.least_setpoint, a.most_setpoint));
  append(a.has_law_state(), a.law == ActuatorLaw::kMuscle ? std::clamp(command, 0.0, 1.0) : 0.0);
}

void place_on_link(const ActuatorSpec& spec, const Frame& link, int frame, Actuator& a) {
  if (link.body == 0)
    fail_actuator(spec, fmt::format("link '{}' is fixed to the world", link.name));
  a.frame = frame;
  a.body = link.body;
  a.point = link.X_BF * a.point;
  a.direction = {link.X_BF.rotation * a.direction.torque, link.X_BF.rotation * a.direction.force};
  if (!a.point.allFinite() || !a.direction.force.allFinite() || !a.direction.torque.allFinite())
    fail_actuator(spec, "point, force and torque must be finite numbers");
  check_not_negative(spec, {{"reach", a.reach}});
}

}  // namespace

void ModelBuilder::add_actuator(const ActuatorSpec& spec) {
  Actuator a = spec.actuator;
  if (model_.actuators_.size() == limits::kMaxActuators)
    fail_actuator(
        spec, fmt::format("more than {} actuators; make the scene smaller", limits::kMaxActuators));
  if (a.name.empty()) fail_actuator(spec, "a name is expected");
  if (model_.find_actuator(a.name) >= 0)
    fail_actuator(spec, "there is already an actuator of this name");
  if (!std::isfinite(a.gear)) fail_actuator(spec, "the gear must be finite");
  check_law(spec);
  check_command(spec);
  const bool on_link =
      a.transmission == Transmission::kLink || a.transmission == Transmission::kAdhesion;
  if (a.transmission == Transmission::kJoint || a.law == ActuatorLaw::kPropeller) {
    const auto found = joint_names_.find(spec.joint);
    if (found == joint_names_.end())
      fail_actuator(spec, fmt::format("there is no joint '{}'", spec.joint));
    a.joint = found->second;
    if (joint_nv(model_.bodies_[a.joint + 1].joint_type) != 1)
      fail_actuator(spec,
                    fmt::format("joint '{}' has several coordinates; one is expected", spec.joint));
  }
  if (a.transmission == Transmission::kTendon) {
    a.tendon = model_.find_tendon(spec.tendon);
    if (a.tendon < 0) fail_actuator(spec, fmt::format("there is no tendon '{}'", spec.tendon));
  }
  if (on_link) {
    const auto found = frame_names_.find(spec.link);
    if (found == frame_names_.end())
      fail_actuator(spec, fmt::format("there is no link '{}'", spec.link));
    const bool is_force = a.law == ActuatorLaw::kAffine && a.stiffness == 0.0 && a.damping == 0.0 &&
                          a.command_damping == 0.0;
    if (!is_force && a.law != ActuatorLaw::kPropeller)
      fail_actuator(spec, "on a link only a force is possible: it has no length");
    place_on_link(spec, model_.frames_[found->second], found->second, a);
  }
  model_.actuators_.push_back(std::move(a));
}

void ModelBuilder::place_internal_states() {
  std::vector<double> z;
  std::vector<Pose> X_WB;  // where a closure holds in place
  for (Actuator& a : model_.actuators_) {
    a.z_index = static_cast<int>(z.size());
    append_states(a, z);
  }
  for (Closure& closure : model_.closures_) {
    closure.z_index = static_cast<int>(z.size());
    if (!closure.switched) continue;
    z.push_back(closure.attached ? Closure::kAttached : Closure::kReleased);
    if (!closure.in_place) continue;
    if (X_WB.empty()) X_WB = body_poses(model_, model_.default_q_);
    const auto held = pose_in_place(closure, X_WB[closure.body_a], X_WB[closure.body_b]);
    z.insert(z.end(), held.begin(), held.end());
  }
  model_.default_z_ = Eigen::Map<const VectorX>(z.data(), static_cast<Eigen::Index>(z.size()));
}

}  // namespace counterpoint
