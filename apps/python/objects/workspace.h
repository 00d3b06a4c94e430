// Working memory of steps without a simulator.
#pragma once

#include "counterpoint/engine/step.h"
#include "handles.h"

namespace counterpoint::python {

/// A Workspace, and copies of a step's arguments, so that the step can run without the GIL.
struct WorkspaceHandle {
  explicit WorkspaceHandle(ModelPtr m) : model(std::move(m)), workspace(model->model) {}
  ModelPtr model;
  Workspace workspace;
  Guard guard;
  State state, next;
  Input input;
  VectorX q, v, q_next, v_next;

  void set_input(const InputPtr& given) {
    if (given && given->model != model) throw py::value_error("input: it is of another model");
    if (given)
      input = given->value();
    else
      input = Input();
  }
  /// Takes the arguments of an inverse; q_next_given: an array, or None.
  void set_motion(const Array& q_given, const Array& v_given, const py::object& q_next_given,
                  const Array& v_next_given, const InputPtr& known) {
    const Model& m = model->model;
    q = vector(q_given, m.nq(), "q");
    v = vector(v_given, m.nv(), "v");
    v_next = vector(v_next_given, m.nv(), "v_next");
    set_input(known);
    if (q_next_given.is_none())
      q_next.resize(0);
    else
      q_next = vector(Array(q_next_given), m.nq(), "q_next");
  }
};
using WorkspacePtr = std::shared_ptr<WorkspaceHandle>;

}  // namespace counterpoint::python
