#include "counterpoint/model/export/mjcf_actuators.h"

#include <cmath>

namespace counterpoint {
namespace {

/// Names in <actuator>: servos have those of what they act on.
std::string servo_name(const Model& model, const std::string& name) {
  return model.find_actuator(name) < 0 ? name : name + "/servo";
}

/// Writes gains of the law gain u + bias - stiffness x - damping y.
void write_affine(double gain, double bias, double stiffness, double damping, MjcfXml& xml) {
  xml.set("gainprm", export_numbers({gain, 0.0, 0.0}));
  xml.set("biastype", "affine");
  xml.set("biasprm", export_numbers({bias, -stiffness, -damping}));
}

/// Writes the law stiffness (position - x) + damping (speed - y) with the position as its control,
/// or the speed where there is no stiffness. Returns the control.
double write_servo(double stiffness, double damping, double position, double speed, MjcfXml& xml) {
  const bool of_speed = stiffness == 0.0;
  write_affine(of_speed ? damping : stiffness, of_speed ? 0.0 : damping * speed, stiffness, damping,
               xml);
  return of_speed ? speed : position;
}

}  // namespace

std::vector<double> write_mjcf_actuators(const Model& model, EffectSet on, MjcfXml& xml) {
  std::vector<double> controls;
  xml.open("actuator");
  for (const JointServo& servo : model.servos()) {
    if (!on.has(Effect::kServos)) break;
    xml.open("general");
    xml.set("name", servo_name(model, model.joint(servo.joint).name));
    xml.set("joint", mjcf_joint_name(model, servo.joint));
    controls.push_back(
        write_servo(servo.stiffness, servo.damping, servo.position, servo.velocity, xml));
    xml.close();
  }
  for (const Tendon& tendon : model.tendons()) {
    const TendonServo& servo = tendon.servo;
    if (!on.has(Effect::kTendons) || !servo.any()) continue;
    xml.open("general");
    xml.set("name", servo_name(model, tendon.name));
    xml.set("tendon", tendon.name);
    controls.push_back(write_servo(servo.stiffness, servo.damping, servo.target, servo.speed, xml));
    if (std::isfinite(servo.least)) {
      xml.set("forcelimited", "true");
      xml.set("forcerange", export_numbers({servo.least, servo.most}));
    }
    xml.close();
  }
  xml.close();
  return controls;
}

}  // namespace counterpoint
