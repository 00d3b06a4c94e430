// Threads that share a scene, as a Python object.
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
/// Name in the messages of Guard.
inline constexpr const char* kBatch = "Batch";

/// States from a sequence of State, or from an array with rows (q, v); these have time 0 and no
/// remembered forces. @throws py::value_error.
std::vector<State> states_from(const ModelHandle& handle, const py::object& states);

/// Binds Batch.inverse_derivatives and Batch.forward_derivatives.
void bind_batch_derivatives(py::module_& m,
                            py::class_<BatchHandle, std::shared_ptr<BatchHandle>>& batch);

}  // namespace counterpoint::python
