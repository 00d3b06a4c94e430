// Per-body results and scratch of the recursive algorithms.
#pragma once

#include "counterpoint/engine/dynamics/data.h"
#include "handles.h"

namespace counterpoint::python {

/// Scratch and results, filled by the functions that it is passed to.
struct DataHandle {
  explicit DataHandle(ModelPtr m) : model(std::move(m)), data(model->model) {}
  ModelPtr model;
  Data data;
  Guard guard;
};
using DataPtr = std::shared_ptr<DataHandle>;

inline DataPtr data_for(const ModelPtr& model, const DataPtr& given) {
  if (!given) return std::make_shared<DataHandle>(model);
  if (given->model != model) throw py::value_error("data: it is of another model");
  return given;
}

/// Runs task(model, data) without the GIL, alone in `data`.
template <class Task>
void compute(const ModelPtr& model, const DataPtr& given, Task task) {
  const DataPtr d = data_for(model, given);
  const Guard::Lock lock(d->guard, "Data");
  const py::gil_scoped_release release;
  task(model->model, d->data);
}

}  // namespace counterpoint::python
