#include "handles.h"

#include <algorithm>
#include <limits>

#include "counterpoint/model/text_files.h"

namespace counterpoint::python {

std::string suggestion(const std::string& name, const std::vector<std::string>& names) {
  const auto near = std::min_element(names.begin(), names.end(), [&](const auto& a, const auto& b) {
    return edit_distance(a, name) < edit_distance(b, name);
  });
  if (near != names.end() && 3 * static_cast<size_t>(edit_distance(*near, name)) <= near->size())
    return "did you mean '" + *near + "'?";
  std::string text = names.empty() ? "there are none" : "there are";
  constexpr size_t kMost = 8;
  for (size_t i = 0; i < std::min(names.size(), kMost); ++i) text += " '" + names[i] + "'";
  if (names.size() > kMost) text += " and " + std::to_string(names.size() - kMost) + " more";
  return text;
}

void throw_unknown(const char* what, const std::string& name,
                   const std::vector<std::string>& names) {
  throw py::key_error("no " + std::string(what) + " '" + name + "'; " + suggestion(name, names));
}

Coordinates::Coordinates(CoordinateNames given) : names(std::move(given)) {
  const auto add = [&](const std::vector<std::string>& list, Kind kind) {
    for (size_t i = 0; i < list.size(); ++i)
      places.emplace(list[i], Place{kind, static_cast<int>(i)});
  };
  add(names.q, Kind::kPosition);
  add(names.v, Kind::kVelocity);
  add(names.force, Kind::kForce);
}

Coordinates::Place Coordinates::find(const std::string& name) const {
  const auto found = places.find(name);
  if (found != places.end()) return found->second;
  std::vector<std::string> all;
  for (const auto& [known, place] : places) all.push_back(known);
  throw_unknown("coordinate", name, all);
}

int check_frame(const ModelHandle& model, const std::string& name) {
  const int index = model.model.find_frame(name);
  if (index >= 0) return index;
  throw_unknown("frame", name, names_of(model.model.frames()));
}

int geometry_index(const ModelHandle& model, py::handle key) {
  const auto& all = model.model.geometries();
  const auto find = [&](const std::string& name) {
    for (size_t i = 0; i < all.size(); ++i)
      if (all[i].name == name) return static_cast<int>(i);
    return -1;
  };
  return index_from(key, static_cast<int>(all.size()), "geometry", find,
                    [&] { return names_of(all); });
}

ScenePtr handle_of(Scene&& scene) {
  return std::make_shared<SceneHandle>(
      SceneHandle{std::move(scene.name), std::make_shared<ModelHandle>(std::move(scene.model)),
                  std::move(scene.q), std::move(scene.v), scene.options});
}

ModelHandle::ModelHandle(Model m)
    : model(std::move(m)), coordinates(std::make_shared<Coordinates>(coordinate_names(model))) {}

StateHandle::StateHandle(CoordinatesPtr names, State state, bool only)
    : coordinates(std::move(names)),
      read_only(only),
      state_(std::make_shared<State>(std::move(state))) {
  const py::capsule owner = keep(state_);
  q = view(state_->q, owner, !read_only);
  v = view(state_->v, owner, !read_only);
}

void StateHandle::assign(const State& other) {
  if (other.q.size() != state_->q.size() || other.v.size() != state_->v.size())
    throw py::value_error("the states are of different models: nq, nv are " +
                          std::to_string(state_->q.size()) + ", " +
                          std::to_string(state_->v.size()) + " and " +
                          std::to_string(other.q.size()) + ", " + std::to_string(other.v.size()));
  *state_ = other;
}

double& StateHandle::at(const std::string& name) const {
  const Coordinates::Place place = coordinates->find(name);
  if (place.kind == Coordinates::Kind::kForce)
    throw py::key_error("'" + name + "' is an applied force: it is in an Input, not in a State");
  return (place.kind == Coordinates::Kind::kPosition ? state_->q : state_->v)[place.index];
}

void StateHandle::check_writable() const {
  if (read_only)
    throw py::value_error(
        "the state of a simulator is set as a whole: change a copy(), then assign it to "
        "simulator.state");
}

InputHandle::InputHandle(ModelPtr m) : model(std::move(m)), input_(std::make_shared<Input>()) {
  const auto& servos = model->model.servos();
  const auto count = static_cast<Eigen::Index>(servos.size());
  input_->applied_force = VectorX::Zero(model->model.nv());
  input_->servo_position.resize(count);
  input_->servo_velocity.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    input_->servo_position[i] = servos[static_cast<size_t>(i)].position;
    input_->servo_velocity[i] = servos[static_cast<size_t>(i)].velocity;
  }
  const auto& tendons = model->model.tendons();
  input_->tendon_force = input_->tendon_target =
      VectorX::Zero(static_cast<Eigen::Index>(tendons.size()));
  for (size_t i = 0; i < tendons.size(); ++i)
    input_->tendon_target[static_cast<Eigen::Index>(i)] = tendons[i].servo.target;
  const auto& actuators = model->model.actuators();
  input_->command.resize(static_cast<Eigen::Index>(actuators.size()));
  for (size_t i = 0; i < actuators.size(); ++i)
    input_->command[static_cast<Eigen::Index>(i)] = actuators[i].command;
  input_->attach.setConstant(static_cast<Eigen::Index>(model->model.closures().size()),
                             std::numeric_limits<double>::quiet_NaN());
  input_->prescribed.setConstant(model->model.nq(), std::numeric_limits<double>::quiet_NaN());
  const py::capsule owner = keep(input_);
  command = view(input_->command, owner, true);
  attach = view(input_->attach, owner, true);
  prescribed = view(input_->prescribed, owner, true);
  tendon_force = view(input_->tendon_force, owner, true);
  tendon_target = view(input_->tendon_target, owner, true);
  applied_force = view(input_->applied_force, owner, true);
  servo_position = view(input_->servo_position, owner, true);
  servo_velocity = view(input_->servo_velocity, owner, true);
}

double& InputHandle::at(const std::string& name) const {
  const Model& m = model->model;
  const auto found = model->coordinates->places.find(name);
  if (found != model->coordinates->places.end() && found->second.kind == Coordinates::Kind::kForce)
    return input_->applied_force[found->second.index];
  std::vector<std::string> names = model->coordinates->names.force;
  for (size_t i = 0; i < m.servos().size(); ++i) {
    const std::string& joint = m.joint(m.servos()[i].joint).name;
    const auto index = static_cast<Eigen::Index>(i);
    if (name == joint + ".target") return input_->servo_position[index];
    if (name == joint + ".target_velocity") return input_->servo_velocity[index];
    names.push_back(joint + ".target");
  }
  for (size_t i = 0; i < m.tendons().size(); ++i) {
    const std::string& tendon = m.tendons()[i].name;
    const auto index = static_cast<Eigen::Index>(i);
    if (name == tendon + ".tendon_force") return input_->tendon_force[index];
    if (name == tendon + ".tendon_target") return input_->tendon_target[index];
    names.push_back(tendon + ".tendon_force");
  }
  for (size_t i = 0; i < m.actuators().size(); ++i) {
    names.push_back(m.actuators()[i].name + ".command");
    if (name == names.back()) return input_->command[static_cast<Eigen::Index>(i)];
  }
  for (size_t i = 0; i < m.closures().size(); ++i) {
    if (!m.closures()[i].switched) continue;
    names.push_back(m.closures()[i].name + ".attach");
    if (name == names.back()) return input_->attach[static_cast<Eigen::Index>(i)];
  }
  throw_unknown("applied force or other input", name, names);
}

const Input& input_of(const InputPtr& input, const Input& none) {
  return input ? input->value() : none;
}

std::vector<std::tuple<int, double, double>> tuples_of(const std::vector<TautLink>& links) {
  std::vector<std::tuple<int, double, double>> tuples;
  for (const TautLink& link : links) tuples.emplace_back(link.body, link.factor, link.kept);
  return tuples;
}

std::vector<TautLink> taut_links_of(const Model& model,
                                    const std::vector<std::tuple<int, double, double>>& tuples) {
  std::vector<TautLink> links;
  for (const auto& [body, factor, kept] : tuples) {
    if (body < 1 || body >= model.num_bodies())
      throw py::value_error("taut_links: the model has no body " + std::to_string(body));
    links.push_back({body, factor, kept});
  }
  return links;
}

}  // namespace counterpoint::python
