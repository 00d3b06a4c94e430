// counterpoint.optimization: motions found, and their verification by simulation.
#include <pybind11/stl.h>

#include "counterpoint/engine/optimize/optimize.h"
#include "objects/interrupts.h"
#include "objects/properties.h"
#include "objects/trajectories.h"
#include "objects/typed.h"
#include "optimization.h"

namespace counterpoint::python {
namespace {

/// Called after Newton steps: checks for signals and calls the user's function.
class Observer {
 public:
  Observer(SignalWatch& watch, py::object function) : watch_(watch), call_(std::move(function)) {}

  bool operator()(const opt::Progress& progress) {
    const py::gil_scoped_acquire acquire;
    if (watch_.check()) return false;
    if (call_.is_none()) return true;
    try {
      const py::object more = call_(progress);
      return !(py::isinstance<py::bool_>(more) && !more.cast<bool>());
    } catch (py::error_already_set& error) {
      watch_.keep(error);
      return false;
    }
  }

 private:
  SignalWatch& watch_;
  py::object call_;
};

ResultPtr optimize(const ProblemPtr& problem, const py::object& start,
                   const std::optional<opt::Settings>& settings, const py::object& progress) {
  auto own = std::make_shared<ProblemHandle>(*problem);  // other threads may add terms
  const opt::Problem& p = own->file.problem;
  opt::Settings used = settings.value_or(own->file.settings);
  const std::vector<VectorX> frames =
      start.is_none() ? own->file.guess : frames_from(Array(start), p.model->nq(), "start");
  auto out = std::make_shared<ResultHandle>();
  out->problem = own;
  SignalWatch watch;
  Observer observer(watch, progress);
  used.progress = [&](const opt::Progress& step) { return observer(step); };
  {
    const py::gil_scoped_release release;
    out->result = opt::optimize(p, frames, used);
  }
  watch.raise_if_interrupted(py::cast(out));
  return out;
}

std::shared_ptr<opt::Verification> verify(const ResultPtr& r) {
  const opt::Result& result = r->result;
  const opt::Problem& p = r->problem->file.problem;
  const py::gil_scoped_release release;
  return std::make_shared<opt::Verification>(
      opt::verify(*p.model, result.options, p.motors, result.q, result.v.front()));
}

TrajectoryPtr trajectory(const ResultPtr& r) {
  const opt::Result& result = r->result;
  const SceneHandle& scene = *r->problem->scene;
  auto out = std::make_shared<TrajectoryHandle>();
  out->model = scene.model;
  out->scene = std::make_shared<SceneHandle>(scene);
  out->scene->options = result.options;
  MotionRecorder recorder(scene.model->model, {}, result.applied_force.size());
  const double h = result.options.time_step;
  Input input;
  const auto state = [&](size_t t) {
    return State{static_cast<double>(t) * h, result.q[t], result.v[t]};
  };
  for (size_t t = 0; t < result.applied_force.size(); ++t) {
    input.applied_force = result.applied_force[t];
    recorder.step(state(t), input, h, {}, state(t + 1));
  }
  out->trajectory = recorder.finish(state(result.q.size() - 1));
  return out;
}

std::pair<double, double> pair(const opt::Spread& spread) { return {spread.max, spread.mean}; }

void bind_progress(py::module_& o) {
  using P = opt::Progress;
  py::class_<P>(o, "Progress", "One Newton step of an optimization.")
      .def_readonly("iteration", &P::iteration, "Counted over all stages.")
      .def_readonly("stage", &P::stage, "Of the continuation.")
      .def_readonly("smoothing", &P::smoothing, "[m]")
      .def_readonly("penalty", &P::penalty, "Of conditions.")
      .def_readonly("cost", &P::cost, "Of all terms and conditions.")
      .def_readonly("seconds", &P::seconds, "Since the start [s].")
      .def_property_readonly(
          "unactuated", [](const P& p) { return pair(p.unactuated); },
          "(largest, mean) of forces where no motor is, over the weight of the tree.")
      .def_property_readonly(
          "violation", [](const P& p) { return pair(p.violation); },
          "(largest, mean) of all conditions.")
      .def_property_readonly("accepted", through(&P::step, &opt::Iteration::accepted),
                             "Was the step taken?")
      .def_property_readonly("decrease", through(&P::step, &opt::Iteration::decrease),
                             "Of the cost.")
      .def_property_readonly("step", through(&P::step, &opt::Iteration::step),
                             "Largest change of a coordinate [m, rad].")
      .def_property_readonly("damping", through(&P::step, &opt::Iteration::damping),
                             "Levenberg and Marquardt's.")
      .def_property_readonly("trials", through(&P::step, &opt::Iteration::trials), "Steps tried.")
      .def("__repr__", [](const P& p) {
        return py::str("<Progress {}: cost {:.6g}, unactuated {:.2e}, smoothing {:.1e} m>")
            .format(p.iteration, p.cost, p.unactuated.max, p.smoothing);
      });
}

void bind_verification(py::module_& o) {
  using V = opt::Verification;
  py::class_<V, std::shared_ptr<V>>(o, "Verification",
                                    "How far a motion is from what the engine does.")
      .def_readonly("forward_check_max", &V::forward_check_max,
                    "Largest difference of a coordinate from where a forward step leads [m, rad].")
      .def_readonly("forward_failures", &V::forward_failures,
                    "Steps that could not be done, or were softened.")
      .def_readonly("unactuated_max", &V::unactuated_max,
                    "Force where no motor is, over the weight of the tree.")
      .def_readonly("unactuated_mean", &V::unactuated_mean,
                    "Over the steps, of the largest in each.")
      .def_readonly("overlap_max", &V::overlap_max, "[m]")
      .def_readonly("cone_violation_max", &V::cone_violation_max,
                    "Friction beyond mu times the normal force, over the weight.")
      .def_readonly("stance_slip_max", &V::stance_slip_max,
                    "How far a contact that carries, and did so in the step before, slides in a "
                    "step [m].")
      .def_readonly("landing_slip_max", &V::landing_slip_max,
                    "How far one that carries, and did not in the step before, slides [m].")
      .def_readonly("effort_max", &V::effort_max, "Largest applied force over its effort limit.")
      .def_readonly("contact_force_max", &V::contact_force_max, "Normal, over the weight.")
      .def("__repr__", [](const V& v) {
        return py::str(
                   "<Verification: forward {:.1e}, unactuated {:.1e}, overlap {:.1e} m, slip "
                   "{:.1e} m>")
            .format(v.forward_check_max, v.unactuated_max, v.overlap_max, v.stance_slip_max);
      });
}

// Long: declarations of the members of a class.
void bind_result(py::module_& o) {
  using R = ResultHandle;
  py::class_<R, ResultPtr>(o, "Result", "A motion found.")
      .def_property_readonly(
          "outcome", [](const R& r) { return opt::outcome_name(r.result.outcome); },
          "converged, infeasible, iterations or stopped.")
      .def_property_readonly(
          "converged", [](const R& r) { return r.result.outcome == opt::Outcome::kConverged; },
          "Do all conditions hold at the last smoothing?")
      .def_readonly("problem", &R::problem, "Problem, as it was.")
      .def_property_readonly(
          "q", [](const R& r) { return rows_from(r.result.q, r.problem->scene->q.size()); },
          "Frames, shape (steps + 1, nq); a copy.")
      .def_property_readonly(
          "v", [](const R& r) { return rows_from(r.result.v, r.problem->scene->v.size()); },
          "Their velocities [m/s, rad/s], shape (steps + 1, nv); a copy.")
      .def_property_readonly(
          "applied_force",
          [](const R& r) { return rows_from(r.result.applied_force, r.problem->scene->v.size()); },
          "Of the steps between [N, N m], shape (steps, nv); a copy.")
      .def_property_readonly("trajectory", &trajectory,
                             "Trajectory of it, which shows its replay in a notebook.")
      .def_property_readonly("cost", through(&R::result, &opt::Result::cost),
                             "Conditions left out.")
      .def_property_readonly(
          "cost_by_term",
          [](const R& r) {
            NumbersByName out;
            const auto& terms = r.problem->file.problem.terms;
            for (size_t i = 0; i < terms.size(); ++i) {
              const py::str name(terms[i].name);
              const double share = r.result.cost_by_term[static_cast<Eigen::Index>(i)];
              out[name] = out.contains(name) ? out[name].cast<double>() + share : share;
            }
            return out;
          },
          "By name of the term, terms of one name together; of conditions their penalty.")
      .def_property_readonly(
          "unactuated", [](const R& r) { return pair(r.result.unactuated); },
          "(largest, mean) of forces where no motor is, over the weight of the tree.")
      .def_property_readonly(
          "violation", [](const R& r) { return pair(r.result.violation); },
          "(largest, mean) of all conditions.")
      .def_property_readonly("smoothing", through(&R::result, &opt::Result::smoothing),
                             "Of the last stage [m].")
      .def_property_readonly(
          "options", [](const R& r) { return SimulationOptions(r.result.options); },
          "SimulationOptions of the last stage; a copy.")
      .def_property_readonly("iterations", through(&R::result, &opt::Result::iterations),
                             "Newton steps.")
      .def_property_readonly("stages", through(&R::result, &opt::Result::stages),
                             "Of the continuation.")
      .def_property_readonly("refused_stages", through(&R::result, &opt::Result::refused_stages),
                             "Done anew with less of a change.")
      .def_property_readonly("history", through(&R::result, &opt::Result::history),
                             "List of Progress.")
      .def_property_readonly("seconds", through(&R::result, &opt::Result::seconds), "Taken [s].")
      .def("__repr__", [](const R& r) {
        return py::str("<Result {}: cost {:.6g} after {} Newton steps, unactuated {:.1e}>")
            .format(opt::outcome_name(r.result.outcome), r.result.cost, r.result.iterations,
                    r.result.unactuated.max);
      });
}

constexpr const char* kOptimizeDoc = R"(
Finds a motion, as `counterpoint optimize` does, to the same bits.

Parameters
----------
problem : Problem
start : array_like, shape (steps + 1, nq), optional
    Frames to begin with: an earlier result's; default: problem.guess.
settings : Settings, optional
    Default: the problem's.
progress : Callable[[Progress], object], optional
    Called after every Newton step; False stops.

Returns
-------
Result

Raises
------
KeyboardInterrupt
    Ctrl-C, after a Newton step; its attribute `partial` is the Result so far. What `progress`
    raises comes out in the same way.
)";

}  // namespace

void bind_optimization_result(py::module_& o) {
  bind_progress(o);
  bind_verification(o);
  bind_result(o);
  o.def("optimize", &optimize, py::arg("problem"), py::arg("start") = py::none(), py::kw_only(),
        py::arg("settings") = py::none(), py::arg("progress") = py::none(), kOptimizeDoc);
  o.def("verify", &verify, py::arg("result"),
        "Verification: every step of a Result done forward, and its forces looked at.");
}

}  // namespace counterpoint::python
