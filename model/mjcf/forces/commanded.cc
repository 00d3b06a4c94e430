#include "counterpoint/model/mjcf/forces/commanded.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "counterpoint/model/mjcf/forces/muscles.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::mjcf {
namespace {

constexpr const char* kPid = "mujoco.pid";

/// Offsets [m, rad] of a coupling up to this are rounding.
constexpr double kNoOffset = 1e-12;

bool is_plugin(const Element& e) { return e.Attribute("plugin") || e.Attribute("instance"); }

/// Returns the element with the <config>s of a plugin: its instance, or the actuator itself.
const Element* config_of(const Document& document, const Element& e, std::string& plugin) {
  if (e.Attribute("plugin")) plugin = e.Attribute("plugin");
  if (!e.Attribute("instance")) return &e;
  const std::string wanted = e.Attribute("instance");
  for (const Element* of : document.section_children("extension")) {
    for (const Element* instance : document.children(*of)) {
      if (Values(document, *instance).text("name", "") != wanted) continue;
      if (of->Attribute("plugin")) plugin = of->Attribute("plugin");
      return instance;
    }
  }
  document.fail(e, fmt::format("there is no instance '{}' of a plugin in <extension>", wanted));
}

/// Reads a PID law; `constant`: part of its length that does not change. Returns false after a
/// refusal.
bool read_pid(const CommandedElement& from, double constant, Actuator& a) {
  Document& document = from.document;
  std::string plugin;
  const Element* config = config_of(document, from.element, plugin);
  std::map<std::string, double*> keys = {{"kp", &a.kp},
                                         {"ki", &a.ki},
                                         {"kd", &a.kd},
                                         {"imax", &a.integral_limit},
                                         {"slewmax", &a.slew}};
  a.law = ActuatorLaw::kPid;
  for (const Element* e : document.children(*config)) {
    const Values v(document, *e);
    const std::string key = v.text("key");
    const auto found = keys.find(key);
    if (found == keys.end())
      document.fail(*e, "kp, ki, kd, imax or slewmax is expected as key, not " + key);
    *found->second = v.number("value", 0.0);
  }
  const auto refuse = [&](const std::string& what) {
    document.refuse(from.element, LeaveOut::kActuators, what);
    return false;
  };
  if (std::abs(constant) > kNoOffset)
    return refuse(
        fmt::format("its joint follows another one with an offset, which adds {:.6g} to the length "
                    "that the plugin controls; this is not supported: let it drive the joint that "
                    "is followed, or couple the joints without an offset",
                    constant));
  if (from.law.integrates())
    return refuse("a PID plugin with dyntype=\"integrator\" is not supported: give it the angle");
  if (from.law.is_filtered() && a.has_slew())
    return refuse("slewmax behind a filter is not supported: leave out slewmax or dyntype");
  if (a.kd > 0.0 && !from.law.is_filtered())
    document.note(from.element,
                  "kd also acts on the rate of the command; in MuJoCo only behind a filter");
  return true;
}

/// Sets what the actuator acts on; returns the part of its length that does not change.
double set_transmission(const CommandedElement& from, ActuatorSpec& spec, const MjcfModel& model) {
  Actuator& a = spec.actuator;
  const Values v(from.document, from.element);
  if (v.has("body")) {
    const int body = from.bodies.body(from.document, from.element, v.text("body"));
    a.transmission = Transmission::kAdhesion;
    a.reach = kAdhesionReach;
    spec.link = from.bodies.bodies[static_cast<std::size_t>(body)].link;
    return 0.0;
  }
  if (v.has("site")) {
    const auto site = from.bodies.sites.find(v.text("site"));
    if (site == from.bodies.sites.end())
      from.document.fail(from.element, fmt::format("there is no site '{}'", v.text("site")));
    std::vector<double> gear = from.law.gear;
    gear.resize(6, 0.0);
    const Pose& X_LS = site->second.X_BS;
    a.transmission = Transmission::kLink;
    a.point = X_LS.translation;
    a.direction = {X_LS.rotation * Vector3(gear[3], gear[4], gear[5]),
                   X_LS.rotation * Vector3(gear[0], gear[1], gear[2])};
    spec.link = from.bodies.bodies[static_cast<std::size_t>(site->second.body)].link;
    return 0.0;
  }
  if (from.tendon) {
    a.transmission = Transmission::kTendon;
    spec.tendon = from.tendon->name;
    a.gear = from.law.gear[0];
    return 0.0;
  }
  const auto& [joint, c] = from.length.sum[0];
  spec.joint = model.robot.joints[static_cast<std::size_t>(joint)].name;
  a.gear = from.law.gear[0] * c;
  return from.law.gear[0] * from.length.constant;
}

void set_affine(const CommandedElement& from, double constant, Actuator& a) {
  const Law& law = from.law;
  const bool pushes = law.bias_number(1) > 0.0 || law.bias_number(2) > 0.0;
  if (law.damping_ratio > 0.0 || pushes)
    from.document.refuse(from.element, LeaveOut::kActuators,
                         "a damping ratio, or a bias that pushes on, is not supported here: give "
                         "kv");
  a.gain = law.gain[0];
  a.command_damping = law.command_damping();
  a.bias = law.bias_number(0) + law.bias_number(1) * constant;
  a.stiffness = std::max(-law.bias_number(1), 0.0);
  a.damping = std::max(-law.bias_number(2), 0.0);
}

/// Bounds the command by ctrlrange, and by actrange: a lag keeps within the range of its input.
void bound(const CommandedElement& from, const MjcfModel::Actuator& given, Actuator& a) {
  if (a.law == ActuatorLaw::kMuscle) {
    a.least_command = 0.0;
    a.most_command = 1.0;
  }
  if (given.least) {
    a.least_command = std::max(a.least_command, *given.least);
    a.most_command = std::min(a.most_command, *given.most);
  }
  const Law& law = from.law;
  if (is_limited(from.document, from.element, law.activation_limited, law.activation_range)) {
    if (a.integrates) {
      std::tie(a.least_setpoint, a.most_setpoint) = *law.activation_range;
    } else {
      a.least_command = std::max(a.least_command, law.activation_range->first);
      a.most_command = std::min(a.most_command, law.activation_range->second);
    }
  }
  if (is_limited(from.document, from.element, law.force_limited, law.force_range))
    std::tie(a.least, a.most) = *law.force_range;
}

}  // namespace

bool needs_command(const Element& e, const Law& law) {
  return law.dynamics != "none" || law.command_damping() > 0.0 || is_plugin(e) ||
         e.Attribute("site") || e.Attribute("body");
}

bool is_pid_plugin(const Document& document, const Element& e) {
  std::string plugin;
  config_of(document, e, plugin);
  return plugin == kPid;
}

void read_commanded(const CommandedElement& from, MjcfModel::Actuator& actuator, MjcfModel& model) {
  ActuatorSpec spec;
  Actuator& a = spec.actuator;
  spec.where = from.document.where(from.element);
  a.name =
      actuator.name.empty() ? fmt::format("actuator{}", model.actuators.size()) : actuator.name;
  const double constant = set_transmission(from, spec, model);
  if (is_plugin(from.element)) {
    if (!read_pid(from, constant, a)) return;
  } else if (from.law.is_muscle()) {
    const JointSpec* joint =
        spec.joint.empty()
            ? nullptr
            : &model.robot.joints[static_cast<std::size_t>(from.length.sum[0].first)];
    const std::optional<Muscle> muscle =
        read_muscle(from.document, from.levels, {joint, from.tendon, a.gear, constant}, model);
    if (!muscle) return;
    a.law = ActuatorLaw::kMuscle;
    a.muscle = *muscle;
  } else {
    set_affine(from, constant, a);
  }
  if (from.law.is_filtered()) a.lag = from.law.dynamics_numbers[0];
  a.integrates = from.law.integrates();
  bound(from, actuator, a);
  actuator.commanded = static_cast<int>(model.commanded.size());
  model.commanded.push_back(std::move(spec));
}

}  // namespace counterpoint::mjcf
