// Scenes: from files, from models, and pickled.
#include "counterpoint/model/scene.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "objects/exceptions.h"
#include "objects/handles.h"
#include "objects/words.h"

namespace counterpoint::python {
namespace {

ScenePtr load(const std::filesystem::path& file,
              const std::map<std::string, std::filesystem::path>& packages,
              const std::optional<std::string>& base, bool ground,
              const std::optional<double>& ground_friction, bool repair_inertias,
              bool repair_joints, double fill_inertia,
              const std::optional<std::filesystem::path>& srdf, int hull_vertices) {
  SceneOverrides overrides;
  overrides.packages = packages;
  if (base) overrides.base = base_from(*base);
  overrides.ground = ground;
  overrides.ground_friction = ground_friction;
  overrides.repair_inertias = repair_inertias;
  overrides.repair_joints = repair_joints;
  overrides.fill_inertia = fill_inertia;
  overrides.srdf = srdf.value_or("");
  overrides.hull_vertices = hull_vertices;
  return handle_of(reading(file, [&] { return load_scene(file, overrides); }));
}

ScenePtr from_model(const ModelPtr& model, const py::object& q, const py::object& v,
                    const SimulationOptions& options, const std::string& name) {
  return std::make_shared<SceneHandle>(
      SceneHandle{name, model, vector_or(q, model->model.default_q(), "q"),
                  vector_or(v, VectorX::Zero(model->model.nv()), "v"), options});
}

void set(VectorX& x, const Array& values, const char* name) {
  x = vector(values, x.size(), name);  // the size stays the same, so views remain valid
}

}  // namespace

constexpr const char* kSceneDoc = R"(
A model, where it starts, and how it is to be stepped.

Parameters
----------
model : Model
q : array_like, shape (nq,), optional
    Coordinates at the start; default: the model's.
v : array_like, shape (nv,), optional
    Velocities at the start; default: zero.
options : SimulationOptions
name : str
)";

constexpr const char* kLoadSceneDoc = R"(
Reads a scene (.yaml, .yml) or a lone robot (.urdf).

Parameters
----------
file : path
packages : dict of str to path
    Folders of package:// names.
base : {'fixed', 'floating', 'spherical'}, optional
    Of a lone URDF, as all that follows; default fixed.
ground : bool
    A ground plane z = 0; a floating base then starts just above it.
ground_friction : float, optional
repair_inertias : bool
    Makes inertias physical that are not, and notes each.
repair_joints : bool
    Exchanges limits that are swapped, drops mimics between joints of different kinds, and notes each.
fill_inertia : float
    Mass [kg] of links without inertia that would have to move some; each is noted. 0: they are refused.
srdf : path, optional
    Pairs that never collide.
hull_vertices : int
    Limit of every hull, 4 or more; 0: none.

Returns
-------
Scene

Raises
------
InputError
    Naming file, line, element, what was expected and what to do.
FileNotFoundError
)";

void bind_scene(py::module_& m) {
  py::class_<SceneHandle, ScenePtr>(m, "Scene", kSceneDoc)
      .def(py::init(&from_model), py::arg("model"), py::arg("q") = py::none(),
           py::arg("v") = py::none(), py::arg("options") = SimulationOptions(),
           py::arg("name") = "")
      .def_readwrite("name", &SceneHandle::name, "For titles.")
      .def_readonly("model", &SceneHandle::model, "Model.")
      .def_property(
          "q", [](const ScenePtr& s) { return view(s->q, py::cast(s), true); },
          [](SceneHandle& s, const Array& q) { set(s.q, q, "q"); },
          "Coordinates at the start, shape (nq,), a view.")
      .def_property(
          "v", [](const ScenePtr& s) { return view(s->v, py::cast(s), true); },
          [](SceneHandle& s, const Array& v) { set(s.v, v, "v"); },
          "Velocities at the start, shape (nv,), a view.")
      .def_readwrite("options", &SceneHandle::options, "SimulationOptions, live.")
      .def(
          "state",
          [](const SceneHandle& s) {
            return std::make_shared<StateHandle>(s.model->coordinates, State{0.0, s.q, s.v}, false);
          },
          "A State of its own at the start of the scene.")
      .def(
          "copy", [](const SceneHandle& s) { return std::make_shared<SceneHandle>(s); },
          "A copy with options, q and v of its own; the model is shared.")
      .def("__repr__",
           [](const SceneHandle& s) {
             return py::str("<Scene '{}': {} bodies, nq {}, nv {}, {} {:g} s>")
                 .format(s.name, s.model->model.num_bodies() - 1, s.model->model.nq(),
                         s.model->model.nv(), integrator_name(s.options.integrator),
                         s.options.time_step);
           })
      .def(py::pickle(
          [](const SceneHandle& s) { return py::make_tuple(py::bytes(archive_scene(s.scene()))); },
          [](const py::tuple& t) { return handle_of(restore_scene(t[0].cast<std::string>())); }));
  m.def("load_scene", &load, py::arg("file"), py::kw_only(),
        py::arg("packages") = std::map<std::string, std::filesystem::path>(),
        py::arg("base") = py::none(), py::arg("ground") = false,
        py::arg("ground_friction") = py::none(), py::arg("repair_inertias") = false,
        py::arg("repair_joints") = false, py::arg("fill_inertia") = 0.0,
        py::arg("srdf") = py::none(), py::arg("hull_vertices") = 0, kLoadSceneDoc);
}

}  // namespace counterpoint::python
