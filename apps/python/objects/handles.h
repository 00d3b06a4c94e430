// Contents of the Python objects: models and states with their names, and guards against concurrent
// use.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>

#include "arrays.h"
#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::python {

/// Names of the coordinates and the index of each.
struct Coordinates {
  explicit Coordinates(CoordinateNames names);

  enum class Kind : unsigned char { kPosition, kVelocity, kForce };
  struct Place {
    Kind kind;
    int index;
  };
  /// @throws py::key_error suggesting similar names.
  Place find(const std::string& name) const;

  CoordinateNames names;
  std::map<std::string, Place> places;
};

using CoordinatesPtr = std::shared_ptr<Coordinates>;

/// Text for messages with names similar to `name`, or else the first few: "did you mean 'elbow'?".
std::string suggestion(const std::string& name, const std::vector<std::string>& names);
[[noreturn]] void throw_unknown(const char* what, const std::string& name,
                                const std::vector<std::string>& names);

/// An immutable model, shared by all objects made from it.
struct ModelHandle {
  explicit ModelHandle(Model m);
  Model model;
  CoordinatesPtr coordinates;
};
using ModelPtr = std::shared_ptr<ModelHandle>;

/// Taut links as tuples (body, factor, kept). @throws py::value_error if the model has no such
/// body.
std::vector<std::tuple<int, double, double>> tuples_of(const std::vector<TautLink>& links);
std::vector<TautLink> taut_links_of(const Model& model,
                                    const std::vector<std::tuple<int, double, double>>& tuples);

/// Names of the parts of a model.
template <class List>
std::vector<std::string> names_of(const List& list) {
  std::vector<std::string> names;
  for (const auto& item : list) names.push_back(item.name);
  return names;
}

/// Index of the frame with this name. @throws py::key_error suggesting similar names.
int check_frame(const ModelHandle& model, const std::string& name);
/// Index of a geometry from its name or index. @throws as index_from.
int geometry_index(const ModelHandle& model, py::handle key);

/// Returns the given scratch object of this model, or a new one. @throws py::value_error if it is
/// of another model.
template <class Scratch>
std::shared_ptr<Scratch> given_or_new(const std::shared_ptr<Scratch>& given, const ModelPtr& model,
                                      const char* name) {
  if (!given) return std::make_shared<Scratch>(model);
  if (given->model != model) throw py::value_error(std::string(name) + ": it is of another model");
  return given;
}

/// A Scene whose model is shared.
struct SceneHandle {
  std::string name;
  ModelPtr model;
  VectorX q, v;
  SimulationOptions options;

  Scene scene() const { return {name, model->model, q, v, options}; }
};
using ScenePtr = std::shared_ptr<SceneHandle>;
/// Handle of a scene, with a handle of its model.
ScenePtr handle_of(Scene&& scene);

/// A State whose arrays q and v are created once and show the memory of `value`, which is never
/// resized.
class StateHandle {
 public:
  StateHandle(CoordinatesPtr coordinates, State state, bool read_only);

  const State& value() const { return *state_; }
  /// Copies all of another state of the same sizes.
  void assign(const State& other);
  void set_time(double time) { state_->time = time; }
  void set_memory(std::vector<RememberedForce> memory) { state_->memory = std::move(memory); }
  /// The coordinate with this name.
  double& at(const std::string& name) const;
  /// @throws py::value_error if the state belongs to a simulator.
  void check_writable() const;

  CoordinatesPtr coordinates;
  py::array q, v;
  bool read_only;

 private:
  std::shared_ptr<State> state_;
};
using StatePtr = std::shared_ptr<StateHandle>;

/// An Input whose arrays are created once. Servo targets always exist, initially those of the
/// model.
class InputHandle {
 public:
  explicit InputHandle(ModelPtr model);

  const Input& value() const { return *input_; }
  Input& value() { return *input_; }
  void assign(const Input& other);
  double& at(const std::string& name) const;

  ModelPtr model;
  py::array applied_force, servo_position, servo_velocity, tendon_force, tendon_target, command,
      attach, prescribed;

 private:
  std::shared_ptr<Input> input_;
};
using InputPtr = std::shared_ptr<InputHandle>;

/// Returns the input from Python, or `none` if the argument was left out.
const Input& input_of(const InputPtr& input, const Input& none);

/// Raises an error if a second thread uses an object that is not thread-safe.
class Guard {
 public:
  class Lock {
   public:
    Lock(Guard& guard, const char* what) : guard_(guard) {
      if (guard_.taken_.exchange(true, std::memory_order_acquire))
        throw std::runtime_error(std::string("another thread is in this ") + what +
                                 ": give each thread its own");
    }
    ~Lock() { guard_.taken_.store(false, std::memory_order_release); }
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;

   private:
    Guard& guard_;
  };

 private:
  std::atomic<bool> taken_ = false;
};

/// Index among `count` from a name or a number; negative numbers count from the end. @throws
/// py::index_error, py::key_error, py::type_error.
template <class Find, class Names>
int index_from(py::handle key, int count, const char* what, Find find, Names names) {
  if (py::isinstance<py::str>(key)) {
    const auto name = key.cast<std::string>();
    const int index = find(name);
    if (index < 0) throw_unknown(what, name, names());
    return index;
  }
  if (PyIndex_Check(key.ptr()) == 0)
    throw py::type_error(std::string(what) + ": expected a name or a number");
  const py::ssize_t index = PyNumber_AsSsize_t(key.ptr(), PyExc_IndexError);
  if (PyErr_Occurred() != nullptr) throw py::error_already_set();
  const auto from_start = index < 0 ? index + count : index;
  if (from_start < 0 || from_start >= count)
    throw py::index_error(std::string(what) + " " + std::to_string(index) + ": there are " +
                          std::to_string(count));
  return static_cast<int>(from_start);
}

}  // namespace counterpoint::python
