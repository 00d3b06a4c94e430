// Motion optimization as Python objects.
#pragma once

#include "counterpoint/engine/optimize/optimize.h"
#include "objects/handles.h"

namespace counterpoint::python {

namespace opt = optimization;

/// A problem file; its model belongs to the scene's handle.
struct ProblemHandle {
  ScenePtr scene;  ///< with the problem's own options
  opt::ProblemFile file;
};
using ProblemPtr = std::shared_ptr<ProblemHandle>;

/// Constant once a Python object holds it.
struct ResultHandle {
  ProblemPtr problem;
  opt::Result result;
};
using ResultPtr = std::shared_ptr<ResultHandle>;

/// Convert frames to rows of an array and back. @throws py::value_error.
py::array rows_from(const std::vector<VectorX>& list, Eigen::Index width);
std::vector<VectorX> frames_from(const Array& array, Eigen::Index width, const char* name);

/// Values by row: one number for all, one per row, or by names of coordinates with zero for the
/// others. @throws py::value_error, py::key_error, py::type_error.
VectorX by_row(const ModelHandle& model, opt::Quantity quantity, const py::object& given,
               const char* name);
/// Handle of a problem file, with a handle of its scene.
ProblemPtr handle_of(opt::ProblemFile file);

void bind_optimization_problem(py::module_& o);  ///< Problem, Settings, Continuation
void bind_optimization_result(py::module_& o);   ///< optimize, Result, verify
void bind_control(py::module_& o);               ///< Planner, load_control
void bind_feedback(py::module_& o);              ///< compute_feedback, repeated, following_force

}  // namespace counterpoint::python
