// Poses and velocities of frames, by name.
#include "counterpoint/engine/dynamics.h"
#include "objects/handles.h"
#include "objects/properties.h"

namespace counterpoint::python {

constexpr const char* kFrameMotionDoc = R"(
Pose and velocity in the world of the frame of a link at a state.

Parameters
----------
model : Model
state : State
name : str
    Of a link as its URDF has it, or of a body of the scene (model.frames).

Returns
-------
FrameMotion
)";

void bind_frames(py::module_& m) {
  using F = FrameMotion;
  py::class_<F>(m, "FrameMotion", "Where the frame of a link is, and how it moves, in the world.")
      .def_readonly("pose", &F::X_WF, "X_WF: of the frame in the world.")
      .def_property_readonly("velocity", copy_of(&F::velocity),
                             "Of the frame's origin, in world axes [m/s], shape (3,).")
      .def_property_readonly("angular_velocity", copy_of(&F::angular_velocity),
                             "In world axes [rad/s], shape (3,).")
      .def("__repr__", [](const F& f) {
        return py::str("<FrameMotion at {}, {} m/s>")
            .format(copy(VectorX(f.X_WF.translation)), copy(VectorX(f.velocity)));
      });
  m.def(
      "frame_motion",
      [](const ModelHandle& model, const StateHandle& state, const std::string& name) {
        check_frame(model, name);
        const State own = state.value();  // NOLINT: a copy, which no other thread changes
        const py::gil_scoped_release release;
        return frame_motion(model.model, own, name);
      },
      py::arg("model"), py::arg("state"), py::arg("name"), kFrameMotionDoc);
}

}  // namespace counterpoint::python
