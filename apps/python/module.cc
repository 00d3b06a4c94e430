// counterpoint._core: the compiled module that the Python package `counterpoint` re-exports.
#include "bindings.h"

PYBIND11_MODULE(_core, m) {
  using namespace counterpoint::python;
  py::options options;
  // The stubs have the signatures: make_stubs.py reads them from docstrings, users do not.
  if (!has_signatures()) options.disable_function_signatures();
  m.doc() = "Rigid-body physics with convex, smooth, invertible contact.";
  m.attr("__version__") = COUNTERPOINT_VERSION;
  // A default argument is converted when its function is bound, so its type must be bound before.
  bind_exceptions(m);
  bind_pose(m);
  bind_shapes(m);
  bind_options(m);
  bind_contact(m);
  bind_coordinates(m);
  bind_model(m);
  bind_state(m);
  bind_builder(m);
  bind_scene(m);
  bind_reports(m);
  bind_step(m);
  bind_derivatives(m);
  bind_parameters(m);
  bind_trajectory(m);
  bind_sensors(m);
  bind_frames(m);
  bind_simulator(m);
  bind_batch(m);
  bind_dynamics(m);
  bind_dynamics_derivatives(m);
  bind_collision(m);
  bind_recordings(m);
  bind_optimization(m);
  bind_view(m);
  bind_live(m);
}
