// Many motions of one scene in parallel, with the same bits as one after the other.
#include <pybind11/stl.h>

#include "objects/batch_handle.h"
#include "objects/input_map.h"
#include "objects/interrupts.h"
#include "reports.h"

namespace counterpoint::python {
namespace {

/// Results of rollouts.
struct RolloutHandle {
  ModelPtr model;
  py::array_t<double> states;  ///< (motions, steps, nq + nv)
  std::vector<long> steps;     ///< number of successful steps, by motion
  std::vector<StepReport> reports;
  std::vector<State> ends;
};

}  // namespace

std::vector<State> states_from(const ModelHandle& handle, const py::object& states) {
  const Model& m = handle.model;
  std::vector<State> out;
  if (py::isinstance<py::list>(states) || py::isinstance<py::tuple>(states)) {
    const py::sequence list = states;
    if (list.empty() || py::isinstance<StateHandle>(list[0])) {
      for (const py::handle item : list) {
        const State& state = item.cast<StateHandle&>().value();
        if (state.q.size() != m.nq() || state.v.size() != m.nv())
          throw py::value_error("states: a state is of another model");
        out.push_back(state);
      }
      return out;
    }
  }
  const Array array(states);
  const auto rows = matrix(array, -1, m.nq() + m.nv(), "states");
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    out.push_back({0.0, rows.row(i).head(m.nq()), rows.row(i).tail(m.nv())});
  return out;
}

namespace {

/// Computes one motion. Writes its states to `out`, NaN after a failed step or a stop.
void roll_out(int motion, const InputTable& table, const InputMap& map,
              const std::atomic<bool>& stop, Simulator& simulator, RolloutHandle& result,
              double* out) {
  const Model& model = simulator.model();
  const auto i = static_cast<size_t>(motion);
  const auto nq = model.nq(), width = model.nq() + model.nv();
  simulator.set_state(result.ends[i]);
  simulator.input() = Input{VectorX::Zero(model.nv()), {}};
  InputMap::Values values = map.start(model);
  StepReport& report = result.reports[i];
  for (py::ssize_t k = 0; k < table.steps(); ++k, out += width) {
    const bool going = report.succeeded() && !stop.load(std::memory_order_relaxed);
    if (going) {
      if (const double* row = table.row(motion, k))
        map.apply(model, row, values, simulator.input());
      report = simulator.step();
      if (report.succeeded()) ++result.steps[i];
    }
    if (going && report.succeeded()) {
      std::copy_n(simulator.state().q.data(), nq, out);
      std::copy_n(simulator.state().v.data(), model.nv(), out + nq);
    } else {
      std::fill_n(out, width, std::numeric_limits<double>::quiet_NaN());
    }
  }
  result.ends[i] = simulator.state();
}

std::shared_ptr<RolloutHandle> rollout(BatchHandle& b, const py::object& states,
                                       const py::object& inputs, std::optional<py::ssize_t> steps,
                                       const std::vector<std::string>& columns,
                                       const py::object& out) {
  const Guard::Lock lock(b.guard, kBatch);
  const InputMap map(*b.model, columns);
  auto result = std::make_shared<RolloutHandle>();
  result->model = b.model;
  result->ends = states_from(*b.model, states);
  const auto motions = static_cast<int>(result->ends.size());
  const InputTable table(inputs, motions, steps.value_or(-1), map);
  const py::ssize_t width = b.model->model.nq() + b.model->model.nv();
  result->states = output(out, {motions, table.steps(), width}, "out");
  result->steps.assign(static_cast<size_t>(motions), 0);
  result->reports.resize(static_cast<size_t>(motions));
  double* const begin = result->states.mutable_data();
  SignalWatch watch;
  std::atomic<bool> stop = false;
  run_interruptibly(watch, stop, [&] {
    b.batch.run(motions, [&](int i, Simulator& simulator) {
      roll_out(i, table, map, stop, simulator, *result, begin + i * table.steps() * width);
    });
  });
  watch.raise_if_interrupted(py::cast(result));
  return result;
}

std::vector<ReportHandle> step(BatchHandle& b, const std::vector<StatePtr>& states,
                               const std::vector<InputPtr>& inputs) {
  const Guard::Lock lock(b.guard, kBatch);
  if (!inputs.empty() && inputs.size() != states.size())
    throw py::value_error("inputs: expected none, or one a state");
  std::vector<State> own;
  std::vector<Input> acting;
  for (size_t i = 0; i < states.size(); ++i) {
    states[i]->check_writable();
    own.push_back(states[i]->value());
    acting.push_back(inputs.empty() ? Input() : inputs[i]->value());
  }
  std::vector<StepReport> reports(states.size());
  {
    const py::gil_scoped_release release;
    b.batch.step(own, acting, reports);
  }
  std::vector<ReportHandle> out;
  for (size_t i = 0; i < states.size(); ++i) {
    states[i]->assign(own[i]);
    out.push_back({b.model, reports[i]});
  }
  return out;
}

/// @throws py::index_error.
size_t checked(const RolloutHandle& r, size_t motion) {
  if (motion < r.ends.size()) return motion;
  throw py::index_error("motion " + std::to_string(motion) + ": there are " +
                        std::to_string(r.ends.size()));
}

/// View of the columns begin ... begin + size - 1 of the states.
py::array part(const RolloutHandle& r, int begin, int size) {
  return py::array(r.states[py::make_tuple(py::ellipsis(), py::slice(begin, begin + size, 1))]);
}

void bind_rollout(py::module_& m) {
  using R = RolloutHandle;
  py::class_<R, std::shared_ptr<R>>(m, "Rollout", "What the motions of a rollout came to.")
      .def_readonly("states", &R::states,
                    "q, then v, after every step, shape (motions, steps, nq + nv); NaN from "
                    "where a step failed.")
      .def_property_readonly(
          "q", [](const R& r) { return part(r, 0, r.model->model.nq()); },
          "Shape (motions, steps, nq), a view of states.")
      .def_property_readonly(
          "v", [](const R& r) { return part(r, r.model->model.nq(), r.model->model.nv()); },
          "[m/s, rad/s], shape (motions, steps, nv), a view of states.")
      .def_property_readonly(
          "steps",
          [](const R& r) {
            return py::array_t<long>(static_cast<py::ssize_t>(r.steps.size()), r.steps.data());
          },
          "Steps that succeeded, by motion.")
      .def_property_readonly(
          "succeeded",
          [](const R& r) {
            py::array_t<bool> out(static_cast<py::ssize_t>(r.reports.size()));
            for (size_t i = 0; i < r.reports.size(); ++i)
              out.mutable_at(static_cast<py::ssize_t>(i)) = r.reports[i].succeeded();
            return out;
          },
          "By motion: did all steps succeed?")
      .def(
          "report",
          [](const R& r, size_t i) {
            return ReportHandle{r.model, r.reports[checked(r, i)]};
          },
          py::arg("motion"), "StepReport of the last step of a motion, or of the one that failed.")
      .def(
          "end",
          [](const R& r, size_t i) {
            return std::make_shared<StateHandle>(r.model->coordinates, r.ends[checked(r, i)],
                                                 false);
          },
          py::arg("motion"), "The last good State of a motion, with its memory, to go on from.")
      .def("__len__", [](const R& r) { return r.ends.size(); })
      .def("__repr__", [](const R& r) {
        const auto failed = std::count_if(r.reports.begin(), r.reports.end(),
                                          [](const StepReport& x) { return !x.succeeded(); });
        return py::str("<Rollout: {} motions of {} steps, {} failed>")
            .format(r.ends.size(), r.states.shape(1), failed);
      });
}

constexpr const char* kRolloutDoc = R"(
Many motions at once, each to the bits of the same motion by itself.

Parameters
----------
states : array_like, shape (motions, nq + nv), or sequence of State
    Where each starts; of an array at time 0 and without memory.
inputs : array_like, shape (motions, steps, nu) or (steps, nu), optional
    What acts in each step; in the second form for all motions.
steps : int, optional
    Needed where there are no inputs.
columns : sequence of str
    What the columns of inputs are: 'elbow.u', 'elbow.target', 'hand.fx' ...; default: the applied
    forces, in the order of model.coordinates.force.
out : ndarray, shape (motions, steps, nq + nv), optional
    Where the states go: float64, C-contiguous.

Returns
-------
Rollout
    A motion whose step fails ends there; nothing is raised.

Raises
------
KeyboardInterrupt
    Ctrl-C, within a tenth of a second; its attribute `partial` is the Rollout so far, motions NaN
    from where they were stopped.
)";

}  // namespace

constexpr const char* kBatchDoc = R"(
Threads that share a scene's definition. Results do not depend on their number.

Parameters
----------
scene : Scene
    Copied.
num_threads : int
    0: one for every core.
)";

constexpr const char* kStepDoc = R"(
One step of every state, in place. A state whose step fails stays as it was.

Parameters
----------
states : sequence of State
inputs : sequence of Input
    One a state, or none.

Returns
-------
list of StepReport
)";

void bind_batch(py::module_& m) {
  bind_rollout(m);
  using B = BatchHandle;
  py::class_<B, std::shared_ptr<B>> batch(m, "Batch", kBatchDoc);
  batch
      .def(py::init([](const SceneHandle& s, int n) { return std::make_shared<B>(s, n); }),
           py::arg("scene"), py::arg("num_threads") = 0)
      .def_property_readonly(
          "num_threads", [](const B& b) { return b.batch.num_threads(); }, "How many there are.")
      .def_readonly("model", &B::model, "Model.")
      .def_property(
          "options", [](const B& b) { return SimulationOptions(b.scene.options); },
          [](B& b, const SimulationOptions& options) {
            const Guard::Lock lock(b.guard, kBatch);
            b.scene.options = options;
            b.batch.set_options(options);
          },
          "A copy of the SimulationOptions of all; assign to change them.")
      .def(
          "set_settings",
          [](B& b, const contact::Settings& settings) {
            const Guard::Lock lock(b.guard, kBatch);
            b.batch.set_settings(settings);
          },
          py::arg("settings"), "contact.Settings of all steps that follow.")
      .def("rollout", &rollout, py::arg("states"), py::arg("inputs") = py::none(), py::kw_only(),
           py::arg("steps") = py::none(), py::arg("columns") = std::vector<std::string>(),
           py::arg("out") = py::none(), kRolloutDoc)
      .def("step", &step, py::arg("states"), py::arg("inputs") = std::vector<InputPtr>(), kStepDoc)
      .def("__repr__", [](const B& b) {
        return py::str("<Batch of '{}' over {} threads>")
            .format(b.scene.name, b.batch.num_threads());
      });
  bind_batch_derivatives(m, batch);
  m.def(
      "rollout",
      [](const SceneHandle& scene, const py::object& states, const py::object& inputs,
         std::optional<py::ssize_t> steps, const std::vector<std::string>& columns,
         const py::object& out, int num_threads) {
        BatchHandle own(scene, num_threads);
        return rollout(own, states, inputs, steps, columns, out);
      },
      py::arg("scene"), py::arg("states"), py::arg("inputs") = py::none(), py::kw_only(),
      py::arg("steps") = py::none(), py::arg("columns") = std::vector<std::string>(),
      py::arg("out") = py::none(), py::arg("num_threads") = 0, kRolloutDoc);
}

}  // namespace counterpoint::python
