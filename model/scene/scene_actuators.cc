#include "counterpoint/model/scene/scene_actuators.h"

#include <initializer_list>
#include <tuple>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/scene/scene_shapes.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

/// Commands that a delay line keeps where a file does not say.
constexpr int kDelaySamples = 10;

using Numbers = std::initializer_list<std::pair<const char*, double*>>;

/// Reads those of the numbers that are there, none of them negative.
void read_numbers(const YamlValue& in, const Numbers& numbers) {
  for (const auto& [key, value] : numbers)
    if (in.has(key)) *value = in.at(key).number(0.0, kInfinity);
}

void read_muscle(const YamlValue& in, Muscle& m) {
  in.expect_map({"curves", "max_force", "optimal_length", "slack_length", "pennation", "max_speed",
                 "damping", "shortest", "longest", "passive_force", "eccentric_force",
                 "activation_time", "deactivation_time", "activation_smoothing"});
  if (in.has("curves")) {
    const YamlValue curves = in.at("curves");
    if (!curves.is_text("millard") && !curves.is_text("mujoco"))
      curves.fail("millard or mujoco is expected");
    m.curves = curves.is_text("mujoco") ? Muscle::Curves::kMujoco : Muscle::Curves::kMillard;
  }
  if (!in.has("max_force") || !in.has("optimal_length"))
    in.fail("max_force [N] and optimal_length [m] are expected");
  if (in.has("slack_length")) m.slack_length = in.at("slack_length").number();
  read_numbers(in, {{"max_force", &m.max_force},
                    {"optimal_length", &m.optimal_length},
                    {"pennation", &m.pennation},
                    {"max_speed", &m.max_speed},
                    {"damping", &m.damping},
                    {"shortest", &m.shortest},
                    {"longest", &m.longest},
                    {"passive_force", &m.passive_force},
                    {"eccentric_force", &m.eccentric_force},
                    {"activation_time", &m.activation_time},
                    {"deactivation_time", &m.deactivation_time},
                    {"activation_smoothing", &m.activation_smoothing}});
}

/// Reads the law under one of the keys of `kLaws`, or that of a force.
void read_law(const YamlValue& in, ActuatorSpec& spec) {
  Actuator& a = spec.actuator;
  if (in.has("gain")) a.gain = in.at("gain").number();
  if (in.has("bias")) a.bias = in.at("bias").number();
  if (in.has("position")) {
    const YamlValue law = in.at("position");
    law.expect_map({"stiffness", "damping"});
    a.gain = a.stiffness = law.at("stiffness").number(0.0, kInfinity);
    read_numbers(law, {{"damping", &a.damping}});
  } else if (in.has("velocity")) {
    const YamlValue law = in.at("velocity");
    law.expect_map({"damping"});
    a.gain = a.damping = law.at("damping").number(0.0, kInfinity);
  } else if (in.has("damper")) {
    const YamlValue law = in.at("damper");
    law.expect_map({"damping"});
    a.gain = a.least_command = 0.0;
    a.command_damping = law.at("damping").number(0.0, kInfinity);
  } else if (in.has("pid")) {
    const YamlValue law = in.at("pid");
    law.expect_map({"kp", "ki", "kd", "integral_limit"});
    a.law = ActuatorLaw::kPid;
    read_numbers(
        law, {{"kp", &a.kp}, {"ki", &a.ki}, {"kd", &a.kd}, {"integral_limit", &a.integral_limit}});
  } else if (in.has("dc_motor")) {
    const YamlValue law = in.at("dc_motor");
    law.expect_map({"torque_constant", "resistance", "inductance", "current_limit"});
    a.law = ActuatorLaw::kDcMotor;
    a.torque_constant = law.at("torque_constant").positive();
    a.resistance = law.at("resistance").positive();
    read_numbers(law, {{"inductance", &a.inductance}, {"current_limit", &a.current_limit}});
  } else if (in.has("muscle")) {
    a.law = ActuatorLaw::kMuscle;
    a.least_command = 0.0;
    a.most_command = 1.0;
    read_muscle(in.at("muscle"), a.muscle);
  } else if (in.has("propeller")) {
    const YamlValue law = in.at("propeller");
    law.expect_map({"joint", "thrust", "drag", "axis"});
    a.law = ActuatorLaw::kPropeller;
    spec.joint = law.at("joint").text();
    const Vector3 axis =
        law.has("axis") ? law.at("axis").vector3().normalized() : Vector3(Vector3::UnitZ());
    double drag = 0.0;
    read_numbers(law, {{"drag", &drag}});
    a.direction = {-drag * axis, law.at("thrust").number() * axis};
  }
}

/// Reads the place where it acts: joint, tendon, or link.
void read_transmission(const YamlValue& in, ActuatorSpec& spec) {
  Actuator& a = spec.actuator;
  int places = 0;
  const auto at = [&](const char* key, std::string& name, Transmission transmission) {
    if (!in.has(key)) return;
    ++places;
    name = in.at(key).text();
    a.transmission = transmission;
  };
  at("joint", spec.joint, Transmission::kJoint);
  at("tendon", spec.tendon, Transmission::kTendon);
  at("link", spec.link, Transmission::kLink);
  if (places != 1) in.fail("one of joint, tendon, link is expected");
  if (in.has("gear")) a.gear = in.at("gear").number();
  if (a.transmission != Transmission::kLink) return;
  if (in.has("adhesion")) {
    a.transmission = Transmission::kAdhesion;
    in.at("adhesion").expect_map({"reach"});
    read_numbers(in.at("adhesion"), {{"reach", &a.reach}});
  } else if (!in.has("propeller") && !in.has("force") && !in.has("torque")) {
    in.fail(
        "on a link, force: [x, y, z] or torque: [x, y, z] per unit of the command, "
        "propeller, or adhesion is expected");
  }
  if (in.has("point")) a.point = in.at("point").vector3();
  if (in.has("force")) a.direction.force = in.at("force").vector3();
  if (in.has("torque")) a.direction.torque = in.at("torque").vector3();
}

}  // namespace

ActuatorSpec read_actuator(const YamlValue& in) {
  in.expect_map({"name",         "joint",         "tendon",   "link",      "gear",     "point",
                 "force",        "torque",        "adhesion", "propeller", "command",  "range",
                 "delay",        "delay_samples", "slew",     "lag",       "gain",     "bias",
                 "position",     "velocity",      "damper",   "pid",       "dc_motor", "muscle",
                 "force_limits", "integrate"});
  ActuatorSpec spec;
  spec.where = in.where();
  Actuator& a = spec.actuator;
  a.name = in.at("name").text();
  int laws = 0;
  for (const char* law :
       {"position", "velocity", "damper", "pid", "dc_motor", "muscle", "propeller"})
    laws += in.has(law);
  if (laws > 1)
    in.fail("one law is expected: position, velocity, damper, pid, dc_motor, muscle, propeller");
  if (laws == 1 && (in.has("gain") || in.has("bias")))
    in.fail("gain and bias belong to a force without another law");
  read_transmission(in, spec);
  read_law(in, spec);
  if (in.has("range"))
    std::tie(a.least_command, a.most_command) = read_range(in.at("range"), false);
  if (in.has("force_limits")) std::tie(a.least, a.most) = read_range(in.at("force_limits"), false);
  if (in.has("command")) a.command = in.at("command").number();
  read_numbers(in, {{"delay", &a.delay}, {"lag", &a.lag}});
  if (in.has("integrate")) {
    a.integrates = true;
    std::tie(a.least_setpoint, a.most_setpoint) = read_range(in.at("integrate"), false);
  }
  if (in.has("slew")) a.slew = in.at("slew").positive();
  if (a.delay > 0.0) a.delay_samples = kDelaySamples;
  if (in.has("delay_samples"))
    a.delay_samples = in.at("delay_samples").integer(1, limits::kMaxDelaySamples);
  return spec;
}

}  // namespace counterpoint
