// Threads that share a scene, as Python has them.
#pragma once

#include <vector>

#include "counterpoint/engine/batch.h"
#include "handles.h"

namespace counterpoint::python {

struct BatchHandle {
  BatchHandle(const SceneHandle& s, int num_threads)
      : model(s.model), scene(s), batch(s.scene(), num_threads) {}
  ModelPtr model;
  SceneHandle scene;
  Batch batch;
  Guard guard;
};
/// How Guard calls it.
inline constexpr const char* kBatch = "Batch";

/// States from a sequence of State, or from an array of q and v by rows: at time 0, no memory.
/// @throws py::value_error.
std::vector<State> states_from(const ModelHandle& handle, const py::object& states);

/// Batch.inverse_derivatives, Batch.forward_derivatives.
void bind_batch_derivatives(py::module_& m,
                            py::class_<BatchHandle, std::shared_ptr<BatchHandle>>& batch);

}  // namespace counterpoint::python
