// counterpoint.optimization: the submodule.
#include "optimization.h"

#include "bindings.h"

namespace counterpoint::python {

void bind_optimization(py::module_& m) {
  py::module_ o = m.def_submodule(
      "optimization",
      "Motions of robots that push against the world, found by their positions alone.");
  bind_optimization_problem(o);
  bind_optimization_result(o);
  bind_feedback(o);
  bind_control(o);
}

}  // namespace counterpoint::python
