// Trajectories and states, in memory and in files.
#include "counterpoint/engine/trajectory.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "objects/exceptions.h"
#include "objects/properties.h"
#include "objects/trajectories.h"
#include "objects/typed.h"

namespace counterpoint::python {
namespace {

using ArraysByName = Typed<py::dict, "Dict[str, numpy.ndarray]">;

TrajectoryPtr read_trajectory_of(const std::filesystem::path& file, const py::object& of) {
  auto out = std::make_shared<TrajectoryHandle>();
  if (py::isinstance<SceneHandle>(of)) {
    out->scene = of.cast<ScenePtr>();
    out->model = out->scene->model;
  } else {
    out->model = of.cast<ModelPtr>();
  }
  out->trajectory = reading(file, [&] { return read_trajectory(file, out->model->model); });
  return out;
}

Input input_of_step(const TrajectoryHandle& t, int step) {
  Input input;
  t.trajectory.set_known(t.model->model, step, input);
  if (t.trajectory.applied_force.size() > 0)
    input.applied_force = t.trajectory.applied_force.col(step);
  return input;
}

int checked_row(py::ssize_t row, int count) {
  const auto index = row < 0 ? row + count : row;
  if (index < 0 || index >= count)
    throw py::index_error("row " + std::to_string(row) + ": there are " + std::to_string(count));
  return static_cast<int>(index);
}

void write(const TrajectoryHandle& t, const std::filesystem::path& file) {
  const Trajectory& x = t.trajectory;
  if (static_cast<int>(x.time_step.size()) != x.num_steps())
    throw py::value_error("the lengths of the steps are not known: nothing to write in time_step");
  const py::gil_scoped_release release;
  TrajectoryWriter writer(file, t.model->model, x.columns);
  const auto state = [&](int k) {
    return State{x.time[static_cast<size_t>(k)], x.q.col(k), x.v.col(k)};
  };
  for (int k = 0; k < x.num_steps(); ++k)
    writer.write_step(
        state(k), input_of_step(t, k), x.time_step[static_cast<size_t>(k)],
        x.softening.empty() ? Softening() : x.softening[static_cast<size_t>(k)],
        x.taut_links.empty() ? std::vector<TautLink>() : x.taut_links[static_cast<size_t>(k)]);
  writer.write_end(state(x.num_steps()));
}

/// Returns every column by name, for tables. Inputs have one row less, so their last entry is NaN.
ArraysByName to_dict(const TrajectoryPtr& t) {
  const Trajectory& x = t->trajectory;
  const CoordinateNames& names = t->model->coordinates->names;
  const py::object self = py::cast(t);
  ArraysByName out;
  out["time"] = view(x.time, self);
  const auto add = [&](const std::vector<std::string>& list, const MatrixX& m) {
    for (size_t i = 0; i < list.size(); ++i) {
      py::array_t<double> column(x.num_rows());
      for (int k = 0; k < x.num_rows(); ++k)
        column.mutable_at(k) = k < m.cols() ? m(static_cast<Eigen::Index>(i), k)
                                            : std::numeric_limits<double>::quiet_NaN();
      out[py::str(list[i])] = column;
    }
  };
  add(names.q, x.q);
  add(names.v, x.v);
  if (x.applied_force.size() > 0) add(names.force, x.applied_force);
  if (!x.columns.empty()) add(x.columns.names(t->model->model), x.known);
  return out;
}

void bind_writer(py::module_& m) {
  struct Writer {
    ModelPtr model;
    std::unique_ptr<TrajectoryWriter> writer;
    TrajectoryWriter& open() const {
      if (!writer) throw py::value_error("the trajectory is already written");
      return *writer;
    }
  };
  py::class_<Writer>(m, "TrajectoryWriter", R"(
Writes a trajectory to a file as it is computed.

Parameters
----------
file : path
model : Model
links : sequence of str
    Links whose wrenches (Input.add_wrench at their origins, in this order) are written.
)")
      .def(py::init([](const std::filesystem::path& file, const ModelPtr& model,
                       const std::vector<std::string>& links) {
             InputColumns columns = InputColumns::of(model->model);
             for (const std::string& link : links) {
               const int frame = model->model.find_frame(link);
               if (frame < 0) throw py::key_error("no link '" + link + "'");
               columns.links.push_back(frame);
             }
             return Writer{model, std::make_unique<TrajectoryWriter>(file, model->model, columns)};
           }),
           py::arg("file"), py::arg("model"), py::arg("links") = std::vector<std::string>())
      .def(
          "write_step",
          [](const Writer& w, const StateHandle& state, const InputHandle& input, double time_step,
             std::pair<double, int> softening,
             const std::vector<std::tuple<int, double, double>>& taut_links) {
            w.open().write_step(state.value(), input.value(), time_step,
                                {softening.first, softening.second},
                                taut_links_of(w.model->model, taut_links));
          },
          py::arg("state"), py::arg("input"), py::arg("time_step"),
          py::arg("softening") = std::pair<double, int>(1.0, -1),
          py::arg("taut_links") = std::vector<std::tuple<int, double, double>>(),
          "A state, what is applied during the step from it, its length [s], its report's "
          "softening, and the taut_links of the state that it led to.")
      .def(
          "write_end",
          [](Writer& w, const StateHandle& state) {
            w.open().write_end(state.value());
            w.writer.reset();
          },
          py::arg("state"), "The last state; closes the file.");
}

void bind_state_files(py::module_& m) {
  m.def(
      "write_state",
      [](const std::filesystem::path& file, const SceneHandle& scene, const StateHandle& state,
         std::optional<double> next_step) {
        write_state(file, scene.model->model, scene.options, state.value(), next_step);
      },
      py::arg("file"), py::arg("scene"), py::arg("state"), py::arg("next_step") = py::none(), R"(
Writes a state, to go on from to the same bits.

Parameters
----------
file : path
scene : Scene
state : State
next_step : float, optional
    Length that the next controlled step will try [s].
)");
  m.def(
      "read_state",
      [](const std::filesystem::path& file, const SceneHandle& scene, bool changed_scene) {
        State state = reading(file, [&] {
          return read_state(file, scene.model->model, scene.options,
                            changed_scene ? SceneCheck::kAny : SceneCheck::kSame);
        });
        return std::make_shared<StateHandle>(scene.model->coordinates, std::move(state), false);
      },
      py::arg("file"), py::arg("scene"), py::kw_only(), py::arg("changed_scene") = false, R"(
Reads a state of this scene, bit for bit as written; of a trajectory, its last row.

Parameters
----------
file : path
scene : Scene
changed_scene : bool
    Model and options may be others than those the state was saved from.

Returns
-------
State

Raises
------
InputError
    When the numbers are not those that were written, or the scene is another.
FileNotFoundError
)");
}

}  // namespace

MotionRecorder::MotionRecorder(const Model& model, InputColumns columns, size_t steps)
    : model_(model), columns_(std::move(columns)) {
  const auto nq = static_cast<size_t>(model.nq()), nv = static_cast<size_t>(model.nv());
  time_.reserve(steps + 1);
  h_.reserve(steps);
  q_.reserve((steps + 1) * nq);
  v_.reserve((steps + 1) * nv);
  force_.reserve(steps * nv);
  softening_.reserve(steps);
}

void MotionRecorder::add(const State& state) {
  time_.push_back(state.time);
  q_.insert(q_.end(), state.q.begin(), state.q.end());
  v_.insert(v_.end(), state.v.begin(), state.v.end());
}

void MotionRecorder::step(const State& before, const Input& input, double h,
                          const Softening& softening, const State& after) {
  add(before);
  h_.push_back(h);
  force_.insert(force_.end(), input.applied_force.begin(), input.applied_force.end());
  if (!columns_.empty()) {
    const VectorX known = columns_.values(model_, input);
    known_.insert(known_.end(), known.begin(), known.end());
  }
  softening_.push_back(softening);
  find_taut_links(after, taut_links_.emplace_back());
}

Trajectory MotionRecorder::finish(const State& last) {
  add(last);
  Trajectory out;
  const auto count = static_cast<Eigen::Index>(time_.size());
  const auto steps = count - 1;
  out.time = std::move(time_);
  out.time_step = std::move(h_);
  out.q = Eigen::Map<const MatrixX>(q_.data(), model_.nq(), count);
  out.v = Eigen::Map<const MatrixX>(v_.data(), model_.nv(), count);
  out.applied_force = Eigen::Map<const MatrixX>(force_.data(), model_.nv(), steps);
  if (!columns_.empty() && steps > 0)
    out.known = Eigen::Map<const MatrixX>(known_.data(),
                                          static_cast<Eigen::Index>(known_.size()) / steps, steps);
  out.columns = columns_;
  out.softening = std::move(softening_);
  out.taut_links = std::move(taut_links_);
  return out;
}

constexpr const char* kTrajectoryDoc = R"(
States and applied forces over time, in memory: row k is where step k starts.

Made by Simulator.run and read_trajectory. Arrays are views, read-only.
)";

constexpr const char* kReadTrajectoryDoc = R"(
Reads a trajectory, bit for bit as written.

Parameters
----------
file : path
of : Scene or Model
    What moves; with a Scene the trajectory can be shown.

Returns
-------
Trajectory

Raises
------
InputError
    Naming file, line and column.
FileNotFoundError
)";

void bind_rows(py::class_<TrajectoryHandle, TrajectoryPtr>& trajectory) {
  trajectory.def("__len__", [](const TrajectoryHandle& t) { return t.trajectory.num_rows(); })
      .def(
          "state",
          [](const TrajectoryHandle& t, py::ssize_t row) {
            const int k = checked_row(row, t.trajectory.num_rows());
            return std::make_shared<StateHandle>(
                t.model->coordinates,
                State{t.trajectory.time[static_cast<size_t>(k)], t.trajectory.q.col(k),
                      t.trajectory.v.col(k)},
                false);
          },
          py::arg("row"), "The State of a row, without memory.")
      .def(
          "input",
          [](const TrajectoryHandle& t, py::ssize_t step) {
            auto input = std::make_shared<InputHandle>(t.model);
            input->assign(input_of_step(t, checked_row(step, t.trajectory.num_steps())));
            return input;
          },
          py::arg("step"), "The Input of a step, as far as it is known.")
      .def("write", &write, py::arg("file"),
           "Writes the trajectory (docs/reference/trajectory-format.md).")
      .def("to_dict", &to_dict, "Columns by name, for pandas.DataFrame.")
      .def("__repr__", [](const TrajectoryHandle& t) {
        const auto& time = t.trajectory.time;
        return py::str("<Trajectory: {} rows, {:.6g} to {:.6g} s>")
            .format(time.size(), time.empty() ? 0.0 : time.front(),
                    time.empty() ? 0.0 : time.back());
      });
}

void bind_trajectory(py::module_& m) {
  using Self = TrajectoryPtr;
  py::class_<TrajectoryHandle, Self> trajectory(m, "Trajectory", kTrajectoryDoc);
  trajectory.def_readonly("model", &TrajectoryHandle::model, "Model.")
      .def_readonly("scene", &TrajectoryHandle::scene, "Scene it was made from, or None.")
      .def_property_readonly(
          "time", [](const Self& t) { return view(t->trajectory.time, py::cast(t)); },
          "[s], shape (rows,).")
      .def_property_readonly(
          "time_step", [](const Self& t) { return view(t->trajectory.time_step, py::cast(t)); },
          "Lengths of the steps [s], shape (rows - 1,); empty where unknown.")
      .def_property_readonly(
          "q", [](const Self& t) { return view_columns(t->trajectory.q, py::cast(t)); },
          "Shape (rows, nq).")
      .def_property_readonly(
          "v", [](const Self& t) { return view_columns(t->trajectory.v, py::cast(t)); },
          "[m/s, rad/s], shape (rows, nv).")
      .def_property_readonly(
          "applied_force",
          [](const Self& t) { return view_columns(t->trajectory.applied_force, py::cast(t)); },
          "[N, N m], shape (rows - 1, nv); (0, 0) where unknown.")
      .def_property_readonly("altered_rows",
                             through(&TrajectoryHandle::trajectory, &Trajectory::altered_rows),
                             "Rows whose numbers are not those that were written.")
      .def_property_readonly("num_steps",
                             through(&TrajectoryHandle::trajectory, &Trajectory::num_steps),
                             "One fewer than rows.");
  bind_rows(trajectory);
  m.def("read_trajectory", &read_trajectory_of, py::arg("file"), py::arg("of"), kReadTrajectoryDoc);
  bind_writer(m);
  bind_state_files(m);
}

}  // namespace counterpoint::python
