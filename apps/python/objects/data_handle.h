// Dynamics of a model at a state, kept between calls.
#pragma once

#include "counterpoint/engine/dynamics.h"
#include "handles.h"

namespace counterpoint::python {

/// Intermediate results, filled by the functions to which it is passed.
struct DataHandle {
  explicit DataHandle(ModelPtr m) : model(std::move(m)), dynamics(model->model) {}
  ModelPtr model;
  Dynamics dynamics;
  Guard guard;
};
using DataPtr = std::shared_ptr<DataHandle>;

/// Runs task(dynamics) without the GIL and with exclusive use of `data`.
template <class Task>
void compute(const ModelPtr& model, const DataPtr& given, Task task) {
  const DataPtr d = given_or_new(given, model, "data");
  const Guard::Lock lock(d->guard, "Data");
  const py::gil_scoped_release release;
  task(d->dynamics);
}

/// @throws py::value_error; `body` has a joint that moves no inertia.
[[noreturn]] inline void throw_singular(const Model& m, int body) {
  throw py::value_error((body > 0 ? "what joint '" + m.joint(body - 1).name + "' moves"
                                  : std::string("what a joint moves")) +
                        " has no inertia along it: give it mass, or armature in `diagonal`");
}

}  // namespace counterpoint::python
