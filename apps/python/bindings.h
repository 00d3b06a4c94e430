// The Python module `counterpoint`: its binding functions and the classes and functions they bind.
//
// Rules for all bindings:
// * Names and semantics are those of C++. Getters become properties, enumerations the words of
//   scene files; docstrings state frames and units.
// * An array that shows memory of C++ keeps its owner alive, and is writable only where C++ permits
//   writing. Memory that an array may show is never resized.
// * Functions that compute release the GIL. They first copy the data they read from Python objects,
//   so that other threads may change these. A Guard protects objects that cannot be shared
//   (Simulator, Workspace).
// * Docstrings follow NumPy's style. make_stubs.py makes the type stubs of them and of signatures,
//   and fails where neither gives an exact type; objects/typed.h gives one to a py::object.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdlib>

namespace counterpoint::python {

namespace py = pybind11;

/// True while make_stubs.py reads the module: docstrings then begin with signatures.
inline bool has_signatures() { return std::getenv("COUNTERPOINT_SIGNATURES") != nullptr; }

void bind_exceptions(py::module_& m);
void bind_pose(py::module_& m);         ///< Pose, SpatialInertia
void bind_shapes(py::module_& m);       ///< Shape, Material
void bind_coordinates(py::module_& m);  ///< Coordinates
void bind_model(py::module_& m);        ///< Model, Joint, Body, Frame, Geometry
void bind_builder(py::module_& m);      ///< ModelBuilder and its specs
void bind_options(py::module_& m);      ///< SimulationOptions, ContactOptions, StepControlOptions
void bind_scene(py::module_& m);        ///< Scene, load_scene
void bind_state(py::module_& m);        ///< State, Input
void bind_reports(py::module_& m);      ///< StepReport, Fault, Inverse
void bind_step(py::module_& m);         ///< Workspace, step_forward, step_inverse
void bind_simulator(py::module_& m);    ///< Simulator
void bind_batch(py::module_& m);        ///< Batch, Rollout, rollout
void bind_frames(py::module_& m);       ///< FrameMotion
void bind_derivatives(py::module_& m);  ///< derivatives of steps
void bind_parameters(py::module_& m);   ///< StepParameter, ParameterDerivator
void bind_dynamics(py::module_& m);     ///< Data, rnea, aba, crba, energies
void bind_dynamics_derivatives(py::module_& m);  ///< derivatives of rnea and aba, inertia_regressor
void bind_collision(py::module_& m);             ///< counterpoint.collision
void bind_contact(py::module_& m);               ///< counterpoint.contact
void bind_sensors(py::module_& m);               ///< SensorTable, sensor_readings
void bind_trajectory(py::module_& m);            ///< Trajectory, TrajectoryWriter, state files
void bind_recordings(py::module_& m);            ///< counterpoint.recordings
void bind_optimization(py::module_& m);          ///< counterpoint.optimization
void bind_view(py::module_& m);                  ///< counterpoint.view
void bind_live(py::module_& m);                  ///< LiveView, live

}  // namespace counterpoint::python
