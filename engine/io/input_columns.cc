#include <algorithm>
#include <cmath>

#include "counterpoint/engine/trajectory.h"

namespace counterpoint {
namespace {

constexpr const char* kComponents[] = {".fx", ".fy", ".fz", ".tx", ".ty", ".tz"};

std::string target_name(const Model& model, const JointServo& servo) {
  return model.joint(servo.joint).name + ".target";
}
std::string target_velocity_name(const Model& model, const JointServo& servo) {
  return model.joint(servo.joint).name + ".target_velocity";
}

std::string tendon_force_name(const Tendon& tendon) { return tendon.name + ".tendon_force"; }
std::string command_name(const Actuator& actuator) { return actuator.name + ".command"; }
std::string tendon_target_name(const Tendon& tendon) { return tendon.name + ".tendon_target"; }

/// Returns the first part of the names of a link's wrench columns.
std::string wrench_stem(const Model& model, int frame) {
  const Frame& link = model.frames()[frame];
  const bool takes_names = joint_nv(model.body(link.body).joint_type) > 1 &&
                           model.joint(link.body - 1).link == link.name;
  return takes_names ? link.name + ".wrench" : link.name;
}

bool has_wrench_column(const Table& table, const std::string& stem) {
  return std::any_of(std::begin(kComponents), std::end(kComponents),
                     [&](const char* c) { return table.find_column(stem + c) >= 0; });
}

/// Returns the links that move with a body.
std::vector<int> moving_links(const Model& model) {
  std::vector<int> links;
  for (int i = 0; i < static_cast<int>(model.frames().size()); ++i)
    if (model.frames()[i].body != 0) links.push_back(i);
  return links;
}

/// Returns the values of columns that a file does not have.
VectorX defaults(const InputColumns& columns, const Model& model) {
  return columns.values(model, Input());
}

}  // namespace

std::vector<std::string> InputColumns::names(const Model& model) const {
  std::vector<std::string> names;
  for (const JointServo& servo : model.servos()) {
    if (!targets) break;
    names.push_back(target_name(model, servo));
    names.push_back(target_velocity_name(model, servo));
  }
  for (const int link : links) {
    const std::string stem = wrench_stem(model, link);
    for (const char* component : kComponents) names.push_back(stem + component);
  }
  for (const Tendon& tendon : model.tendons()) {
    if (!tendons) break;
    names.push_back(tendon_force_name(tendon));
    names.push_back(tendon_target_name(tendon));
  }
  for (const Actuator& actuator : model.actuators())
    if (actuators) names.push_back(command_name(actuator));
  return names;
}

void InputColumns::set(const Model& model, const VectorRef& values, Input& input) const {
  int next = 0;
  if (targets) {
    const auto servos = static_cast<Eigen::Index>(model.servos().size());
    input.servo_position.resize(servos);
    input.servo_velocity.resize(servos);
    for (Eigen::Index i = 0; i < servos; ++i) {
      input.servo_position[i] = values[next++];
      input.servo_velocity[i] = values[next++];
    }
  }
  input.wrenches.clear();
  for (const int link : links) {
    const Frame& frame = model.frames()[link];
    ExternalWrench wrench;
    wrench.body = frame.body;
    wrench.point = frame.X_BF.translation;
    wrench.frame = link;
    wrench.wrench = {values.segment<3>(next + 3), values.segment<3>(next)};
    input.wrenches.push_back(wrench);
    next += 6;
  }
  if (tendons) {
    const auto count = static_cast<Eigen::Index>(model.tendons().size());
    input.tendon_force.resize(count);
    input.tendon_target.resize(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      input.tendon_force[i] = values[next++];
      input.tendon_target[i] = values[next++];
    }
  }
  if (!actuators) return;
  const auto count = static_cast<Eigen::Index>(model.actuators().size());
  input.command = values.segment(next, count);
}

VectorX InputColumns::values(const Model& model, const Input& input) const {
  const Eigen::Index servos = targets ? static_cast<Eigen::Index>(model.servos().size()) : 0;
  const size_t count = tendons ? model.tendons().size() : 0;
  const size_t commands = actuators ? model.actuators().size() : 0;
  VectorX values = VectorX::Zero(2 * servos + 6 * static_cast<Eigen::Index>(links.size()) +
                                 static_cast<Eigen::Index>(2 * count + commands));
  Eigen::Index next = 0;
  for (Eigen::Index i = 0; i < servos; ++i) {
    const JointServo& servo = model.servos()[i];
    values[next++] = input.servo_position.size() > 0 ? input.servo_position[i] : servo.position;
    values[next++] = input.servo_velocity.size() > 0 ? input.servo_velocity[i] : servo.velocity;
  }
  for (size_t i = 0; i < links.size() && i < input.wrenches.size(); ++i, next += 6)
    values.segment<6>(next) << input.wrenches[i].wrench.force, input.wrenches[i].wrench.torque;
  next = values.size() - static_cast<Eigen::Index>(2 * count + commands);
  for (size_t i = 0; i < count; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    values[next++] = input.tendon_force.size() > 0 ? input.tendon_force[k] : 0.0;
    values[next++] =
        input.tendon_target.size() > 0 ? input.tendon_target[k] : model.tendons()[i].servo.target;
  }
  for (size_t i = 0; i < commands; ++i)
    values[next++] = input.command.size() > 0 ? input.command[static_cast<Eigen::Index>(i)]
                                              : model.actuators()[i].command;
  return values;
}

bool is_input_column(const Model& model, const std::string& name) {
  const std::vector<std::string> all =
      InputColumns{true, moving_links(model), true, true, true, true}.names(model);
  return std::find(all.begin(), all.end(), name) != all.end();
}

InputColumns find_input_columns(const Table& table, const Model& model) {
  InputColumns columns;
  for (const JointServo& servo : model.servos()) {
    columns.targets = columns.targets || table.find_column(target_name(model, servo)) >= 0 ||
                      table.find_column(target_velocity_name(model, servo)) >= 0;
  }
  for (const Tendon& tendon : model.tendons())
    columns.tendons = columns.tendons || table.find_column(tendon_force_name(tendon)) >= 0 ||
                      table.find_column(tendon_target_name(tendon)) >= 0;
  for (const Actuator& actuator : model.actuators())
    columns.actuators = columns.actuators || table.find_column(command_name(actuator)) >= 0;
  for (const int link : moving_links(model))
    if (has_wrench_column(table, wrench_stem(model, link))) columns.links.push_back(link);
  return columns;
}

MatrixX read_input_columns(const InputColumns& columns, const Table& table, const Model& model,
                           int steps) {
  const std::vector<std::string> names = columns.names(model);
  MatrixX values = defaults(columns, model).replicate(1, steps);
  for (size_t i = 0; i < names.size(); ++i) {
    const int column = table.find_column(names[i]);
    for (int row = 0; column >= 0 && row < steps; ++row) {
      const bool may_be_empty = row + 1 == table.num_rows();
      if (may_be_empty && std::isnan(table.cell(row, column))) continue;
      values(static_cast<Eigen::Index>(i), row) = table.value(row, column);
    }
  }
  return values;
}

}  // namespace counterpoint
