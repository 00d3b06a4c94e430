#include "input_map.h"

#include <algorithm>
#include <map>

namespace counterpoint::python {
namespace {

/// Index of the first link that has a wrench column with this name; -1 if none.
int link_of(const Model& model, const std::string& name) {
  for (int i = 0; i < static_cast<int>(model.frames().size()); ++i) {
    const std::vector<std::string> names = InputColumns{false, {i}}.names(model);
    if (model.frames()[static_cast<size_t>(i)].body != 0 &&
        std::find(names.begin(), names.end(), name) != names.end())
      return i;
  }
  return -1;
}

bool is_target(const Model& model, const std::string& name) {
  const std::vector<std::string> names = InputColumns::of(model).names(model);
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

InputMap::InputMap(const ModelHandle& handle, const std::vector<std::string>& names)
    : size_(static_cast<int>(names.size())) {
  const Model& model = handle.model;
  columns_ = InputColumns::of(model);
  if (names.empty()) {
    plain_ = true;
    size_ = model.nv();
    return;
  }
  const auto& forces = handle.coordinates->names.force;
  const auto force = [&](const std::string& name) {
    return static_cast<int>(std::find(forces.begin(), forces.end(), name) - forces.begin());
  };
  for (const std::string& name : names) {
    if (force(name) < static_cast<int>(forces.size()) || is_target(model, name)) continue;
    const int link = link_of(model, name);
    if (link < 0) throw_unknown("input column", name, forces);
    columns_.links.push_back(link);
  }
  std::sort(columns_.links.begin(), columns_.links.end());
  columns_.links.erase(std::unique(columns_.links.begin(), columns_.links.end()),
                       columns_.links.end());
  const std::vector<std::string> known = columns_.names(model);
  for (const std::string& name : names) {
    const int index = force(name);
    if (index < static_cast<int>(forces.size()))
      places_.push_back({true, index});
    else
      places_.push_back(
          {false, static_cast<int>(std::find(known.begin(), known.end(), name) - known.begin())});
  }
}

void InputMap::apply(const Model& model, const double* row, Values& values, Input& input) const {
  if (plain_) {
    std::copy_n(row, size_, input.applied_force.data());
    return;
  }
  bool others = false;
  for (int i = 0; i < size_; ++i) {
    const Place place = places_[static_cast<size_t>(i)];
    (place.force ? input.applied_force : values.known)[place.index] = row[i];
    others = others || !place.force;
  }
  if (others) columns_.set(model, values.known, input);
}

InputTable::InputTable(const py::object& inputs, int motions, py::ssize_t steps,
                       const InputMap& map)
    : steps_(steps), size_(map.size()) {
  if (inputs.is_none()) {
    if (steps < 0) throw py::type_error("without inputs the number of steps must be given");
    return;
  }
  array_ = Array(inputs);
  const bool shared = array_.ndim() == 2;
  if (shared)
    check_shape(array_, {steps, size_}, "inputs");
  else
    check_shape(array_, {motions, steps, size_}, "inputs");
  steps_ = array_.shape(shared ? 0 : 1);
  motion_stride_ = shared ? 0 : steps_;
  data_ = array_.data();
}

}  // namespace counterpoint::python
