// Sensors of a model: their columns, values in a step, and readings along a trajectory.
#include <pybind11/stl.h>

#include "counterpoint/engine/sensors/sensor_derivatives.h"
#include "objects/trajectories.h"
#include "objects/typed.h"

namespace counterpoint::python {
namespace {

using Derivatives = Typed<py::tuple, "Tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray]">;
using ReadingsByName = Typed<py::dict, "Dict[str, numpy.ndarray]">;

/// A table with the model that it refers to, and a copy of the input of the step.
struct SensorTableHandle {
  SensorTableHandle(ModelPtr m, const SimulationOptions& o)
      : model(std::move(m)), options(o), table(model->model, options) {}
  ModelPtr model;
  SimulationOptions options;
  SensorTable table;
  Guard guard;
};
using SensorTablePtr = std::shared_ptr<SensorTableHandle>;

void check_model(const ModelPtr& model, const StateHandle& state, const char* name) {
  if (state.value().q.size() != model->model.nq() || state.value().v.size() != model->model.nv())
    throw py::value_error(std::string(name) + ": it is of another model");
}

py::array evaluate(const SensorTablePtr& t, const StateHandle& state, const StateHandle& next,
                   const InputPtr& input, const std::optional<double>& time_step) {
  check_model(t->model, state, "state");
  check_model(t->model, next, "next");
  if (input && input->model != t->model) throw py::value_error("input: it is of another model");
  const Guard::Lock lock(t->guard, "SensorTable");
  const State before = state.value(), after = next.value();
  const Input known = input ? input->value() : Input();
  VectorX values(t->table.size());
  {
    const py::gil_scoped_release release;
    t->table.evaluate(
        {before.q, before.v, after.q, after.v, known, time_step.value_or(t->options.time_step)},
        values);
  }
  return copy(values);
}

Derivatives derivatives(const SensorTablePtr& t, const StateHandle& state, const InputPtr& input) {
  check_model(t->model, state, "state");
  if (input && input->model != t->model) throw py::value_error("input: it is of another model");
  const Guard::Lock lock(t->guard, "SensorTable");
  const State before = state.value();
  const Input known = input ? input->value() : Input();
  SensorDerivatives d;
  {
    const py::gil_scoped_release release;
    Workspace workspace(t->model->model);
    sensor_derivatives(t->model->model, t->options, before, known, workspace, t->table, d);
  }
  return py::make_tuple(copy_matrix(d.dq), copy_matrix(d.dv), copy_matrix(d.du));
}

/// Values of all columns (rows of the result) in all steps of a trajectory.
MatrixX readings_of(const Scene& scene, const Trajectory& x, const std::vector<double>& lengths,
                    bool errors, std::uint64_t seed) {
  SensorTable table(scene.model, scene.options);
  SensorSampler readings(scene.model, seed);
  MatrixX out(table.size(), x.num_steps());
  VectorX exact(table.size()), row(table.size());
  Input known;
  for (int k = 0; k < x.num_steps(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    x.set_known(scene.model, k, known);
    table.evaluate({x.q.col(k), x.v.col(k), x.q.col(k + 1), x.v.col(k + 1), known, lengths[i]},
                   exact);
    if (errors) readings.read(x.time[i], exact, row);
    out.col(k) = errors ? row : exact;
  }
  return out;
}

ReadingsByName sensor_readings(const ScenePtr& scene, const TrajectoryPtr& trajectory, bool errors,
                               std::uint64_t seed) {
  if (trajectory->model != scene->model)
    throw py::value_error("trajectory: it is of another model");
  const Trajectory& x = trajectory->trajectory;
  MatrixX values;
  {
    const Scene own = scene->scene();
    const py::gil_scoped_release release;
    const std::vector<double> lengths = step_lengths(x, std::nullopt, own.options.time_step);
    values = readings_of(own, x, lengths, errors, seed);
  }
  ReadingsByName out;
  out["time"] = py::array_t<double>(static_cast<py::ssize_t>(x.num_steps()), x.time.data());
  const std::vector<SensorColumn> columns = sensor_columns(scene->model->model);
  for (std::size_t i = 0; i < columns.size(); ++i)
    out[py::str(columns[i].name)] = copy(VectorX(values.row(static_cast<Eigen::Index>(i))));
  return out;
}

}  // namespace

constexpr const char* kTableDoc = R"(
Computes exact values of all sensors in a step.

Parameters
----------
model : Model
options : SimulationOptions
    As the steps have them.

Raises
------
InputError
    If a sensor has no value under these options, as a wrench under runge_kutta_4.
)";

constexpr const char* kEvaluateDoc = R"(
Computes the values in the step from `state` to `next`.

Parameters
----------
state : State
next : State
input : Input, optional
    Of the step: wrenches and servo targets. Default: those of the model, and no wrenches.
time_step : float, optional
    Length of the step [s]; default: that of the options.

Returns
-------
numpy.ndarray, shape (len(columns),)
    In the units of the columns. NaN where there is no value: a ray that meets nothing.
)";

constexpr const char* kDerivativesDoc = R"(
Differentiates the values in the forward step from `state`, by extrapolated differences of steps.

Parameters
----------
state : State
input : Input, optional
    Of the step: applied force, wrenches, targets. Default: none, and the targets of the model.

Returns
-------
tuple of three numpy.ndarray, each of shape (len(columns), nv)
    By displacements of the configuration, by the velocity, and by the applied force.
)";

constexpr const char* kReadingsDoc = R"(
Computes the readings of all sensors along a trajectory, one row for each of its steps.

Parameters
----------
scene : Scene
trajectory : Trajectory
    Of the model of the scene.
errors : bool
    False: exact values, without bias, noise, rounding, rate and delay.
seed : int
    Of the noise.

Returns
-------
dict of str to numpy.ndarray
    "time" [s], and an array for each column; NaN where there is no reading.
)";

void bind_sensors(py::module_& m) {
  py::class_<SensorColumn>(m, "SensorColumn", "A column of sensor readings.")
      .def_readonly("name", &SensorColumn::name, "\"SENSOR.fx\".")
      .def_readonly("unit", &SensorColumn::unit,
                    "\"m/s^2\"; \"1\" for a component of a quaternion.")
      .def_readonly("frame", &SensorColumn::frame,
                    "Axes of the component: \"world\", \"sensor\", a link, or empty.")
      .def_readonly("sensor", &SensorColumn::sensor, "Index into Model.sensors.")
      .def("__repr__",
           [](const SensorColumn& c) { return "<SensorColumn: " + c.name + " [" + c.unit + "]>"; });
  py::class_<SensorTableHandle, SensorTablePtr>(m, "SensorTable", kTableDoc)
      .def(py::init<ModelPtr, const SimulationOptions&>(), py::arg("model"),
           py::arg("options") = SimulationOptions())
      .def_property_readonly(
          "columns", [](const SensorTableHandle& t) { return t.table.columns(); },
          "List of SensorColumn.")
      .def("evaluate", &evaluate, py::arg("state"), py::arg("next"),
           py::arg("input").none(true) = py::none(), py::arg("time_step") = py::none(),
           kEvaluateDoc)
      .def("derivatives", &derivatives, py::arg("state"), py::arg("input").none(true) = py::none(),
           kDerivativesDoc)
      .def("__repr__", [](const SensorTableHandle& t) {
        return "<SensorTable: " + std::to_string(t.table.size()) + " columns>";
      });
  m.def("sensor_readings", &sensor_readings, py::arg("scene"), py::arg("trajectory"), py::kw_only(),
        py::arg("errors") = true, py::arg("seed") = 0, kReadingsDoc);
}

}  // namespace counterpoint::python
