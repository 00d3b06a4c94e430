#include "live/inputs/sliders.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "view/curves.h"

namespace counterpoint::live {
namespace {

/// Range of a value without limits: +- this many turns, metres, or units of a command.
constexpr double kRange = 1.0;
/// Range of a motor's torque without a limit: the weight of the links beyond it times this arm [m].
constexpr double kArm = 0.5;

double or_else(double value, double otherwise) { return std::isfinite(value) ? value : otherwise; }

/// Collects sliders of inputs, found by the names of their columns.
class Inputs {
 public:
  explicit Inputs(const Model& model) {
    const std::vector<std::string> names = InputColumns::of(model).names(model);
    for (size_t i = 0; i < names.size(); ++i) index_[names[i]] = static_cast<int>(i);
  }
  void add(const std::string& column, Slider slider) {
    slider.index = index_.at(column);
    out.push_back(std::move(slider));
  }
  std::vector<Slider> out;

 private:
  std::map<std::string, int> index_;
};

void add_servos(const Model& model, Inputs& inputs) {
  for (const JointServo& servo : model.servos()) {
    const JointInfo& joint = model.joint(servo.joint);
    const JointType type = model.body(servo.joint + 1).joint_type;
    const double range = kRange * (type == JointType::kPrismatic ? 1.0 : 2.0 * std::numbers::pi);
    Slider slider;
    slider.group = "targets of servos";
    slider.name = joint.name;
    slider.unit = view::joint_units(type).q;
    slider.lower = std::max(joint.lower, -range);
    slider.upper = std::min(joint.upper, range);
    slider.value = servo.position;
    inputs.add(joint.name + ".target", slider);
  }
}

void add_motors(const Model& model, std::vector<Slider>& out) {
  for (int j = 0; j < model.num_joints(); ++j) {
    const Body& body = model.body(j + 1);
    const JointInfo& joint = model.joint(j);
    if (joint_nv(body.joint_type) != 1 || !joint.actuated || joint.prescribed) continue;
    double mass = 0.0;
    for (int b = j + 1; b < body.subtree_end; ++b) mass += model.body(b).inertia.mass;
    const bool slides = body.joint_type == JointType::kPrismatic;
    const double load = mass * kStandardGravity * (slides ? 1.0 : kArm);
    Slider slider;
    slider.force = true;
    slider.index = body.v_index;
    slider.group = "forces of motors";
    slider.name = joint.name;
    slider.unit = view::joint_units(body.joint_type).force;
    slider.upper = or_else(joint.effort_limit, load);
    slider.lower = -slider.upper;
    out.push_back(slider);
  }
}

void add_tendons(const Model& model, Inputs& inputs) {
  double mass = 0.0;
  for (int b = 1; b < model.num_bodies(); ++b) mass += model.body(b).inertia.mass;
  for (const Tendon& tendon : model.tendons()) {
    Slider slider;
    slider.group = "tendons";
    slider.name = tendon.name + ": force";
    slider.unit = "N";
    slider.lower = or_else(tendon.servo.least, -mass * kStandardGravity);
    slider.upper = or_else(tendon.servo.most, mass * kStandardGravity);
    inputs.add(tendon.name + ".tendon_force", slider);
    if (tendon.servo.stiffness == 0.0) continue;
    slider.name = tendon.name + ": target";
    slider.unit = "m";
    slider.value = tendon.servo.target;
    slider.lower = or_else(tendon.lower, slider.value - kRange);
    slider.upper = or_else(tendon.upper, slider.value + kRange);
    inputs.add(tendon.name + ".tendon_target", slider);
  }
}

void add_actuators(const Model& model, Inputs& inputs) {
  for (const Actuator& actuator : model.actuators()) {
    if (actuator.law == ActuatorLaw::kPropeller) continue;
    Slider slider;
    slider.group = "commands of actuators";
    slider.name = actuator.name;
    slider.value = actuator.command;
    const bool muscle = actuator.law == ActuatorLaw::kMuscle;
    slider.lower = or_else(actuator.least_command, muscle ? 0.0 : slider.value - kRange);
    slider.upper = or_else(actuator.most_command, muscle ? 1.0 : slider.value + kRange);
    inputs.add(actuator.name + ".command", slider);
  }
}

void add_closures(const Model& model, const VectorX& z, Inputs& inputs) {
  for (size_t i = 0; i < model.closures().size(); ++i) {
    const Closure& closure = model.closures()[i];
    if (!closure.switched) continue;
    Slider slider;
    slider.group = "switched closures";
    slider.name = closure.name;
    slider.closure = static_cast<int>(i);
    slider.value = closure.acts(z) ? 1.0 : 0.0;
    inputs.add(closure.name + ".attach", slider);
  }
}

}  // namespace

std::vector<Slider> sliders_of(const Model& model, const VectorX& z) {
  Inputs inputs(model);
  add_servos(model, inputs);
  add_motors(model, inputs.out);
  add_tendons(model, inputs);
  add_actuators(model, inputs);
  add_closures(model, z, inputs);
  return std::move(inputs.out);
}

Wanted::Wanted(const Model& model, std::vector<Slider> sliders)
    : model_(model),
      sliders_(std::move(sliders)),
      columns_(InputColumns::of(model)),
      inputs_(columns_.values(model, Input{})),
      force_(VectorX::Zero(model.nv())) {}

void Wanted::set(bool force, int index, double value) {
  const auto found = std::find_if(sliders_.begin(), sliders_.end(), [&](const Slider& slider) {
    return slider.force == force && slider.index == index;
  });
  if (found == sliders_.end())
    throw InputError(force ? "message: 'coordinate': there is no such motor"
                           : "message: 'input': there is no such input");
  if (found->closure >= 0) value = value < 0.5 ? 0.0 : 1.0;
  (force ? force_ : inputs_)[index] = value;
}

void Wanted::apply(Input& input) const {
  columns_.set(model_, inputs_, input);
  input.applied_force = force_;
}

std::vector<double> Wanted::values(const VectorX& z) const {
  std::vector<double> out;
  for (const Slider& slider : sliders_) {
    const double value = slider.force ? force_[slider.index] : inputs_[slider.index];
    out.push_back(
        slider.closure < 0
            ? value
            : (model_.closures()[static_cast<size_t>(slider.closure)].acts(z) ? 1.0 : 0.0));
  }
  return out;
}

}  // namespace counterpoint::live
