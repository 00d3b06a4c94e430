#include "counterpoint/model/export/mjcf_actuators.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/model/mjcf/forces/commanded.h"

namespace counterpoint {
namespace {

/// Returns a name in <actuator>; a servo has that of its joint or tendon.
std::string servo_name(const Model& model, const std::string& name) {
  return model.find_actuator(name) < 0 ? name : name + "/servo";
}

/// The law gain u + bias - stiffness x - (damping + command_damping u) y.
struct AffineLaw {
  double gain = 0.0, bias = 0.0, stiffness = 0.0, damping = 0.0, command_damping = 0.0;
};

void write_law(const AffineLaw& law, MjcfXml& xml) {
  if (law.command_damping > 0.0) xml.set("gaintype", "affine");
  xml.set("gainprm", export_numbers({law.gain, 0.0, -law.command_damping}));
  xml.set("biastype", "affine");
  xml.set("biasprm", export_numbers({law.bias, -law.stiffness, -law.damping}));
}

/// Writes the law stiffness (position - x) + damping (speed - y) with the position as its control,
/// or the speed where there is no stiffness. Returns the control.
double write_servo(double stiffness, double damping, double position, double speed, MjcfXml& xml) {
  const bool by_speed = stiffness == 0.0;
  write_law({by_speed ? damping : stiffness, by_speed ? 0.0 : damping * speed, stiffness, damping},
            xml);
  return by_speed ? speed : position;
}

void write_bounds(const char* limited, const char* range, double least, double most, MjcfXml& xml) {
  if (!std::isfinite(least) && !std::isfinite(most)) return;
  xml.set(limited, "true");
  xml.set(range, mjcf_range(least, most));
}

void write_force_bounds(double least, double most, MjcfXml& xml) {
  write_bounds("forcelimited", "forcerange", least, most, xml);
}

void write_servos(const Model& model, EffectSet on, MjcfXml& xml, MjcfControls& out) {
  const bool limited = on.has(Effect::kEffortLimits) && has_drives_in_mjcf(model, on);
  for (const JointServo& servo : model.servos()) {
    if (!on.has(Effect::kServos)) break;
    xml.open("general");
    xml.set("name", servo_name(model, model.joint(servo.joint).name));
    xml.set("joint", mjcf_joint_name(model, servo.joint));
    out.control.push_back(
        write_servo(servo.stiffness, servo.damping, servo.position, servo.velocity, xml));
    const double effort = model.joint(servo.joint).effort_limit;
    if (limited) write_force_bounds(-effort, effort, xml);
    xml.close();
  }
  for (const Tendon& tendon : model.tendons()) {
    const TendonServo& servo = tendon.servo;
    if (!on.has(Effect::kTendons) || !servo.any()) continue;
    xml.open("general");
    xml.set("name", servo_name(model, tendon.name));
    xml.set("tendon", tendon.name);
    out.control.push_back(
        write_servo(servo.stiffness, servo.damping, servo.target, servo.speed, xml));
    write_force_bounds(servo.least, servo.most, xml);
    xml.close();
  }
}

/// Whether geometries of other links of its body would attract too.
bool adheres_by_other_links(const Model& model, const Actuator& a) {
  const auto& all = model.geometries();
  return std::any_of(all.begin(), all.end(),
                     [&](const Geometry& g) { return g.body == a.body && g.frame != a.frame; });
}

/// Returns the reason why MJCF has no such actuator, or "".
std::string actuator_lack(const Model& model, const Actuator& a) {
  switch (a.law) {
    case ActuatorLaw::kPid:
      return "a PID law";
    case ActuatorLaw::kPropeller:
      return "a propeller";
    case ActuatorLaw::kDcMotor:
      if (a.inductance > 0.0) return "a DC motor with an inductance";
      break;
    case ActuatorLaw::kMuscle:
      if (a.muscle.curves != Muscle::Curves::kMujoco) return "a muscle with the curves of Millard";
      if (a.lag > 0.0) return "a muscle behind a lag";
      break;
    case ActuatorLaw::kAffine:
      if (a.integrates && a.lag > 0.0) return "an integral behind a lag";
      break;
  }
  if (a.transmission != Transmission::kAdhesion) return "";
  if (a.lag > 0.0 || a.integrates || a.bias != 0.0)
    return "adhesion with a lag, an integral or a bias";
  if (a.gear * a.gain < 0.0 || a.command < 0.0) return "adhesion that pushes";
  return adheres_by_other_links(model, a) ? "adhesion of one of several links of a body" : "";
}

/// Names the parts of an actuator that is written without them.
void note_lost_parts(const Actuator& a, std::vector<Note>& lost) {
  const auto lose = [&](bool has, const char* what) {
    if (has) lost.push_back({"actuator '" + a.name + "'", what});
  };
  lose(a.delay_samples > 0, "its delay");
  lose(a.has_slew(), "its slew limit");
  lose(a.transmission == Transmission::kAdhesion && a.reach > mjcf::kAdhesionReach,
       "the reach of its adhesion");
}

std::string site_of(const Actuator& a) { return a.name + "/at"; }

void write_transmission(const Model& model, const Actuator& a, MjcfXml& xml) {
  if (a.transmission == Transmission::kJoint)
    xml.set("joint", mjcf_joint_name(model, a.joint));
  else if (a.transmission == Transmission::kTendon)
    xml.set("tendon", model.tendons()[static_cast<std::size_t>(a.tendon)].name);
  else
    xml.set("site", site_of(a));
  if (a.transmission != Transmission::kLink) return xml.set("gear", a.gear);
  xml.set("gear", export_numbers(Vector3(a.gear * a.direction.force)) + " " +
                      export_numbers(Vector3(a.gear * a.direction.torque)));
}

/// Writes a muscle; at range 0 ... 1 its lengths are those from no fibre to the optimal one.
void write_muscle(const Muscle& m, MjcfXml& xml) {
  for (const char* type : {"dyntype", "gaintype", "biastype"}) xml.set(type, "muscle");
  xml.set("dynprm",
          export_numbers({m.activation_time, m.deactivation_time, m.activation_smoothing}));
  xml.set("lengthrange", export_numbers({m.slack_length, m.slack_length + m.optimal_length}));
  constexpr double kScale = 200.0;  // without effect where the force is given
  const std::string numbers = export_numbers({0.0, 1.0, m.max_force, kScale, m.shortest, m.longest,
                                              m.max_speed, m.passive_force, m.eccentric_force});
  for (const char* what : {"gainprm", "biasprm"}) xml.set(what, numbers);
}

/// Returns the law of an actuator that is affine. A DC motor without inductance is: its current is
/// (u - K y) / R.
AffineLaw affine_law(const Actuator& a) {
  if (a.law == ActuatorLaw::kAffine)
    return {a.gain, a.bias, a.stiffness, a.damping, a.command_damping};
  const double gain = a.torque_constant / a.resistance;
  return {gain, 0.0, 0.0, gain * a.torque_constant};
}

void write_adhesion(const Model& model, const Actuator& a, MjcfXml& xml) {
  xml.open("adhesion");
  xml.set("name", a.name);
  xml.set("body", mjcf_body_name(model, a.body));
  xml.set("gain", a.gear * a.gain);
  // MuJoCo wants a range, and none below zero.
  write_bounds("ctrllimited", "ctrlrange", std::max(a.least_command, 0.0), a.most_command, xml);
  write_force_bounds(std::abs(a.gear) * a.least, std::abs(a.gear) * a.most, xml);
  xml.close();
}

void write_actuator(const Model& model, const Actuator& a, MjcfXml& xml) {
  if (a.transmission == Transmission::kAdhesion) return write_adhesion(model, a, xml);
  xml.open("general");
  xml.set("name", a.name);
  write_transmission(model, a, xml);
  write_bounds("ctrllimited", "ctrlrange", a.least_command, a.most_command, xml);
  double least = a.least, most = a.most;
  if (a.law == ActuatorLaw::kDcMotor) {
    least = std::max(least, -a.torque_constant * a.current_limit);
    most = std::min(most, a.torque_constant * a.current_limit);
  }
  write_force_bounds(least, most, xml);
  if (a.lag > 0.0) {
    xml.set("dyntype", "filterexact");
    xml.set("dynprm", a.lag);
  }
  if (a.integrates) {
    xml.set("dyntype", "integrator");
    write_bounds("actlimited", "actrange", a.least_setpoint, a.most_setpoint, xml);
  }
  if (a.law == ActuatorLaw::kMuscle)
    write_muscle(a.muscle, xml);
  else
    write_law(affine_law(a), xml);
  xml.close();
}

}  // namespace

bool has_drives_in_mjcf(const Model& model, EffectSet on) {
  const auto& tendons = model.tendons();
  return (on.has(Effect::kActuators) && !model.actuators().empty()) ||
         (on.has(Effect::kTendons) && std::any_of(tendons.begin(), tendons.end(),
                                                  [](const Tendon& t) { return t.servo.any(); }));
}

void write_mjcf_actuator_sites(const Model& model, EffectSet on, int body, MjcfXml& xml) {
  if (!on.has(Effect::kActuators)) return;
  for (const Actuator& a : model.actuators())
    if (a.transmission == Transmission::kLink && a.body == body && actuator_lack(model, a).empty())
      xml.site(site_of(a), {Matrix3::Identity(), a.point});
}

MjcfControls write_mjcf_actuators(const Model& model, EffectSet on, MjcfXml& xml,
                                  std::vector<Note>& lost) {
  MjcfControls out;
  out.written.assign(model.actuators().size(), 0);
  xml.open("actuator");
  write_servos(model, on, xml, out);
  for (const Actuator& a : model.actuators()) {
    if (!on.has(Effect::kActuators)) break;
    const std::string lack = actuator_lack(model, a);
    if (!lack.empty()) {
      lost.push_back({"actuator '" + a.name + "'", lack});
      continue;
    }
    out.written[static_cast<std::size_t>(&a - model.actuators().data())] = 1;
    write_actuator(model, a, xml);
    note_lost_parts(a, lost);
    const double command = std::clamp(a.command, a.least_command, a.most_command);
    out.control.push_back(command);
    if (a.law == ActuatorLaw::kMuscle) out.activation.push_back(std::clamp(command, 0.0, 1.0));
    if (a.lag > 0.0) out.activation.push_back(command);
    if (a.integrates) out.activation.push_back(std::clamp(0.0, a.least_setpoint, a.most_setpoint));
  }
  xml.close();
  return out;
}

}  // namespace counterpoint
