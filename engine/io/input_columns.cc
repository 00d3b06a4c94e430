#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/fault.h"
#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/special_values.h"

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

std::string attach_name(const Closure& closure) { return closure.name + ".attach"; }

/// Returns the indices of the switched closures.
std::vector<int> switched_closures(const Model& model) {
  std::vector<int> indices;
  for (size_t i = 0; i < model.closures().size(); ++i)
    if (model.closures()[i].switched) indices.push_back(static_cast<int>(i));
  return indices;
}

/// Returns the indices in q of the coordinates whose motion is prescribed.
std::vector<int> prescribed_coordinates(const Model& model) {
  std::vector<int> indices;
  for (int i = 0; i < model.num_joints(); ++i) {
    if (!model.joint(i).prescribed) continue;
    const Body& body = model.body(i + 1);
    for (int k = 0; k < joint_nq(body.joint_type); ++k) indices.push_back(body.q_index + k);
  }
  return indices;
}

/// Returns the names of their columns: "J.target" for "J.q", "L.target_qw" for "L.qw".
std::vector<std::string> prescribed_names(const Model& model) {
  std::vector<std::string> names;
  const std::vector<int> coordinates = prescribed_coordinates(model);
  if (coordinates.empty()) return names;
  const std::vector<std::string> all = coordinate_names(model).q;
  for (const int k : coordinates) {
    const std::string& name = all[static_cast<size_t>(k)];
    const size_t dot = name.rfind('.');
    const std::string part = name.substr(dot + 1);
    names.push_back(name.substr(0, dot) + ".target" + (part == "q" ? "" : "_" + part));
  }
  return names;
}

/// Scales the quaternions of prescribed joints to unit length: those between two rows have less.
void normalize_quaternions(const Model& model, VectorX& q) {
  for (int i = 0; i < model.num_joints(); ++i) {
    const Body& body = model.body(i + 1);
    if (!model.joint(i).prescribed || joint_nq(body.joint_type) == joint_nv(body.joint_type))
      continue;
    auto turn = q.segment<4>(body.q_index + joint_nq(body.joint_type) - 4);
    if (std::abs(turn.norm() - 1.0) > kQuaternionTolerance) turn.normalize();
  }
}

/// Returns the first part of the names of a link's wrench columns.
std::string wrench_stem(const Model& model, int frame) {
  const Frame& link = model.frames()[frame];
  const bool takes_names = joint_nv(model.body(link.body).joint_type) > 1 &&
                           model.joint(link.body - 1).link == link.name;
  return takes_names ? link.name + ".wrench" : link.name;
}

bool has_wrench_column(const std::function<bool(const std::string&)>& has,
                       const std::string& stem) {
  return std::any_of(std::begin(kComponents), std::end(kComponents),
                     [&](const char* c) { return has(stem + c); });
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

InputColumns InputColumns::of(const Model& model) {
  InputColumns columns;
  columns.targets = !model.servos().empty();
  columns.tendons = !model.tendons().empty();
  columns.actuators = !model.actuators().empty();
  columns.closures = !switched_closures(model).empty();
  columns.prescribed = !prescribed_coordinates(model).empty();
  return columns;
}

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
  for (const int i : switched_closures(model))
    if (closures) names.push_back(attach_name(model.closures()[static_cast<size_t>(i)]));
  if (prescribed) {
    const std::vector<std::string> targets_of = prescribed_names(model);
    names.insert(names.end(), targets_of.begin(), targets_of.end());
  }
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
    // A wrench, even of zero, would keep its body awake.
    if (!values.segment<6>(next).isZero(0.0)) input.wrenches.push_back(wrench);
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
  if (actuators) {
    const auto count = static_cast<Eigen::Index>(model.actuators().size());
    input.command = values.segment(next, count);
    next += static_cast<int>(count);
  }
  if (closures) {
    input.attach.setConstant(static_cast<Eigen::Index>(model.closures().size()), kNaN);
    for (const int closure : switched_closures(model)) input.attach[closure] = values[next++];
  }
  if (prescribed) {
    input.prescribed.setConstant(model.nq(), kNaN);
    for (const int k : prescribed_coordinates(model)) input.prescribed[k] = values[next++];
    normalize_quaternions(model, input.prescribed);
  }
}

VectorX InputColumns::values(const Model& model, const Input& input) const {
  std::vector<double> values;
  const auto add = [&](const VectorX& given, Eigen::Index i, double otherwise) {
    values.push_back(given.size() > 0 ? given[i] : otherwise);
  };
  Eigen::Index i = 0;
  for (const JointServo& servo : model.servos()) {
    if (!targets) break;
    add(input.servo_position, i, servo.position);
    add(input.servo_velocity, i++, servo.velocity);
  }
  for (const int link : links) {
    const auto found = std::find_if(input.wrenches.begin(), input.wrenches.end(),
                                    [&](const ExternalWrench& w) { return w.frame == link; });
    const Force wrench = found != input.wrenches.end() ? found->wrench : Force();
    values.insert(values.end(), wrench.force.begin(), wrench.force.end());
    values.insert(values.end(), wrench.torque.begin(), wrench.torque.end());
  }
  i = 0;
  for (const Tendon& tendon : model.tendons()) {
    if (!tendons) break;
    add(input.tendon_force, i, 0.0);
    add(input.tendon_target, i++, tendon.servo.target);
  }
  i = 0;
  for (const Actuator& actuator : model.actuators())
    if (actuators) add(input.command, i++, actuator.command);
  for (const int closure : switched_closures(model))
    if (closures) add(input.attach, closure, kNaN);
  for (const int k : prescribed_coordinates(model))
    if (prescribed) add(input.prescribed, k, kNaN);
  return Eigen::Map<const VectorX>(values.data(), static_cast<Eigen::Index>(values.size()));
}

bool is_input_column(const Model& model, const std::string& name) {
  const std::vector<std::string> all =
      InputColumns{true, moving_links(model), true, true, true, true}.names(model);
  return std::find(all.begin(), all.end(), name) != all.end();
}

InputColumns find_input_columns(const std::function<bool(const std::string&)>& has,
                                const Model& model) {
  InputColumns columns;
  for (const JointServo& servo : model.servos()) {
    columns.targets = columns.targets || has(target_name(model, servo)) ||
                      has(target_velocity_name(model, servo));
  }
  for (const Tendon& tendon : model.tendons())
    columns.tendons =
        columns.tendons || has(tendon_force_name(tendon)) || has(tendon_target_name(tendon));
  for (const Actuator& actuator : model.actuators())
    columns.actuators = columns.actuators || has(command_name(actuator));
  for (const int i : switched_closures(model))
    columns.closures =
        columns.closures || has(attach_name(model.closures()[static_cast<size_t>(i)]));
  for (const std::string& name : prescribed_names(model))
    columns.prescribed = columns.prescribed || has(name);
  for (const int link : moving_links(model))
    if (has_wrench_column(has, wrench_stem(model, link))) columns.links.push_back(link);
  return columns;
}

InputColumns find_input_columns(const Table& table, const Model& model) {
  return find_input_columns([&](const std::string& name) { return table.find_column(name) >= 0; },
                            model);
}

MatrixX read_input_columns(const InputColumns& columns, const Table& table, const Model& model,
                           int steps) {
  const std::vector<std::string> names = columns.names(model);
  MatrixX values = defaults(columns, model).replicate(1, steps);
  // An empty cell leaves a closure as it is, and a joint where it stands.
  const size_t moved = columns.prescribed ? prescribed_coordinates(model).size() : 0;
  const size_t switches = names.size() - moved;
  const size_t filled = switches - (columns.closures ? switched_closures(model).size() : 0);
  for (size_t i = 0; i < names.size(); ++i) {
    const int column = table.find_column(names[i]);
    for (int row = 0; column >= 0 && row < steps; ++row) {
      const bool may_be_empty = row + 1 == table.num_rows() || i >= filled;
      if (may_be_empty && std::isnan(table.cell(row, column))) continue;
      const double value = table.value(row, column);
      if (i >= filled && i < switches && value != 0.0 && value != 1.0)
        throw InputError(
            fmt::format("{}: column '{}' is {}; 1 (attach), 0 (release) or an empty "
                        "cell (as it is) is expected",
                        table.where(row), names[i], value));
      values(static_cast<Eigen::Index>(i), row) = value;
    }
  }
  return values;
}

}  // namespace counterpoint
