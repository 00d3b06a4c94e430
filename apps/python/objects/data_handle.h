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

inline DataPtr data_for(const ModelPtr& model, const DataPtr& given) {
  if (!given) return std::make_shared<DataHandle>(model);
  if (given->model != model) throw py::value_error("data: it is of another model");
  return given;
}

/// Runs task(dynamics) without the GIL and with exclusive use of `data`.
template <class Task>
void compute(const ModelPtr& model, const DataPtr& given, Task task) {
  const DataPtr d = data_for(model, given);
  const Guard::Lock lock(d->guard, "Data");
  const py::gil_scoped_release release;
  task(d->dynamics);
}

}  // namespace counterpoint::python
