// counterpoint.optimization: plans made anew from the present state, many times a second.
#include "counterpoint/engine/optimize/control.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "objects/exceptions.h"
#include "objects/properties.h"
#include "optimization.h"

namespace counterpoint::python {
namespace {

/// A control problem; the model of its problem belongs to the problem's scene.
struct ControlHandle {
  ProblemPtr problem;
  ScenePtr world;
  opt::ControlFile control;
};
using ControlPtr = std::shared_ptr<ControlHandle>;

struct PlannerHandle {
  PlannerHandle(const ProblemHandle& given, const opt::PlannerSettings& settings)
      : problem(std::make_shared<ProblemHandle>(given)),  // other threads may add terms
        planner(problem->file.problem, settings) {}

  const Model& model() const { return *problem->file.problem.model; }

  ProblemPtr problem;
  opt::Planner planner;
  Guard guard;
};
using PlannerPtr = std::shared_ptr<PlannerHandle>;

constexpr const char* kPlanner = "Planner";

ControlPtr load_control(const std::filesystem::path& file) {
  auto out = std::make_shared<ControlHandle>();
  out->control = reading(file, [&] { return opt::load_control(file); });
  out->problem = handle_of(out->control.file);
  Scene world = *out->control.world;
  world.options.time_step = out->control.plant_step;
  world.q = opt::control_start(out->control, world);
  world.v = out->control.file.problem.start_v;
  out->world = handle_of(std::move(world));
  return out;
}

VectorX finite(const Array& array, Eigen::Index size, const char* name) {
  VectorX values = vector(array, size, name);
  if (!values.allFinite()) throw py::value_error(std::string(name) + ": expected finite numbers");
  return values;
}

opt::ReplanReport replan(PlannerHandle& p, double time, const Array& q, const Array& v) {
  const VectorX from_q = finite(q, p.model().nq(), "q"), from_v = finite(v, p.model().nv(), "v");
  const Guard::Lock lock(p.guard, kPlanner);
  const py::gil_scoped_release release;
  return p.planner.replan(time, from_q, from_v);
}

py::array planned_force(PlannerHandle& p, double time, const opt::FeedbackGains& gains,
                        const Array& q, const Array& v) {
  const int nv = p.model().nv();
  if (gains.stiffness.size() != nv || gains.damping.size() != nv)
    throw py::value_error("gains: expected stiffness and damping of shape (" + std::to_string(nv) +
                          ",)");
  const VectorX at_q = finite(q, p.model().nq(), "q"), at_v = finite(v, nv, "v");
  const Guard::Lock lock(p.guard, kPlanner);
  VectorX out(nv);
  p.planner.force(time, gains, at_q, at_v, out);
  return copy(out);
}

std::tuple<py::array, py::array, py::array> sample(PlannerHandle& p, double time) {
  const Guard::Lock lock(p.guard, kPlanner);
  VectorX q, v, force;
  p.planner.sample(time, q, v, force);
  return {copy(q), copy(v), copy(force)};
}

void set_target(PlannerHandle& p, const std::string& name, const py::object& target) {
  const std::vector<opt::Term>& terms = p.planner.problem().terms;
  const auto term = std::find_if(terms.begin(), terms.end(),
                                 [&](const opt::Term& known) { return known.name == name; });
  if (term == terms.end()) throw_unknown("term", name, names_of(terms));
  const VectorX values = term->quantity == opt::Quantity::kConfiguration
                             ? VectorX(vector(Array(target), p.model().nq(), "target"))
                             : by_row(*p.problem->scene->model, term->quantity, target, "target");
  const Guard::Lock lock(p.guard, kPlanner);
  p.planner.set_target(name, values);
}

void bind_settings(py::module_& o) {
  using S = opt::PlannerSettings;
  py::class_<S>(o, "PlannerSettings", "Accuracy and effort of the plans.")
      .def(py::init<>())
      .def_readwrite("smoothing", &S::smoothing, "Smoothing of the plan's contacts [m].")
      .def_readwrite("compliance_per_metre", &S::compliance_per_metre,
                     "Compliance over smoothing [1/m].")
      .def_readwrite("margin_per_smoothing", &S::margin_per_smoothing,
                     "Contacts exist so many smoothings away.")
      .def_readwrite("penalty", &S::penalty, "Penalty of conditions.")
      .def_readwrite("iterations", &S::iterations, "Gauss-Newton steps that a replan tries.")
      .def_readwrite("first_iterations", &S::first_iterations, "The same for a plan from rest.")
      .def_readwrite("disturbance_time", &S::disturbance_time,
                     "Time constant of the estimate of forces that the plan does not know [s]; 0: "
                     "no estimate.")
      .def_readwrite("threads", &S::threads, "0: one a core; no result depends on it.")
      .def_readwrite("contact_damping", &S::contact_damping,
                     "Weight of relative changes of contact forces in the damping; 0: none.")
      .def_readwrite("least_damping", &S::least_damping, "Least damping, over the diagonal.")
      .def_readwrite("lost_above", &S::lost_above,
                     "A plan whose mean violation exceeds this is made anew from rest.");
}

void bind_gains(py::module_& o) {
  using G = opt::FeedbackGains;
  py::class_<G>(o, "FeedbackGains", R"(
Gains of the joints' feedback towards the plan; zero without a motor.

Parameters
----------
stiffness : array_like, shape (nv,)
    [N m/rad, N/m].
damping : array_like, shape (nv,)
    [N m s/rad, N s/m].
)")
      .def(py::init([](const Array& stiffness, const Array& damping) {
             return G{vector(stiffness, stiffness.size(), "stiffness"),
                      vector(damping, stiffness.size(), "damping")};
           }),
           py::arg("stiffness"), py::arg("damping"))
      .def_property_readonly("stiffness", copy_of(&G::stiffness), "A copy [N m/rad, N/m].")
      .def_property_readonly("damping", copy_of(&G::damping), "A copy [N m s/rad, N s/m].");
}

void bind_report(py::module_& o) {
  using R = opt::ReplanReport;
  py::class_<R>(o, "ReplanReport", "Figures of a replan.")
      .def_readonly("cost", &R::cost, "Cost of the plan.")
      .def_property_readonly(
          "violation", [](const R& r) { return std::pair(r.violation.max, r.violation.mean); },
          "(largest, mean) of all conditions; forces where no motor is, over the weight.")
      .def_readonly("iterations", &R::iterations, "Gauss-Newton steps taken.")
      .def_readonly("restarted", &R::restarted, "Was the plan lost and made anew?")
      .def("__repr__", [](const R& r) {
        return py::str("<ReplanReport: cost {:.6g}, violation {:.2e}>")
            .format(r.cost, r.violation.mean);
      });
}

void bind_control_problem(py::module_& o) {
  using C = ControlHandle;
  py::class_<C, ControlPtr>(o, "ControlProblem", "A problem file with the key `control`.")
      .def_readonly("problem", &C::problem, "Problem.")
      .def_readonly("world", &C::world,
                    "Scene that is simulated, at the start of a run and with the time step of the "
                    "world.")
      .def_property_readonly(
          "settings", [](C& c) -> opt::PlannerSettings& { return c.control.planner; },
          py::return_value_policy::reference_internal, "PlannerSettings, as in the file; live.")
      .def_property_readonly(
          "gains", [](C& c) -> opt::FeedbackGains& { return c.control.gains; },
          py::return_value_policy::reference_internal, "FeedbackGains.")
      .def_property_readonly(
          "interval", [](const C& c) { return c.control.interval; }, "Between replans [s].")
      .def_property_readonly(
          "duration", [](const C& c) { return c.control.duration; }, "Length of a run [s].")
      .def("__repr__", [](const C& c) {
        return py::str("<ControlProblem '{}': replans every {:.6g} s>")
            .format(c.problem->file.name, c.control.interval);
      });
  o.def("load_control", &load_control, py::arg("file"), R"(
Reads a control problem (docs/reference/optimization-format.md).

Parameters
----------
file : path

Returns
-------
ControlProblem

Raises
------
InputError
    Naming file, line, element and what was expected.
FileNotFoundError
)");
}

constexpr const char* kPlannerDoc = R"(
Plans made anew from the present state, many times a second (docs/guide/control.md).

Parameters
----------
problem : Problem
    Copied. It must not be periodic, and its goal must be free.
settings : PlannerSettings, optional
    Default: those of PlannerSettings().
)";

constexpr const char* kReplanDoc = R"(
Plans from the present state; the first call plans from rest.

Parameters
----------
time : float
    Time of the state [s].
q : array_like, shape (nq,)
v : array_like, shape (nv,)

Returns
-------
ReplanReport
)";

constexpr const char* kPlannedForceDoc = R"(
The force of the plan and of the feedback towards it, within effort limits; zero without a motor.

Parameters
----------
time : float
    Time of the state [s].
gains : FeedbackGains
q : array_like, shape (nq,)
v : array_like, shape (nv,)

Returns
-------
ndarray, shape (nv,)
    [N, N m].
)";

constexpr const char* kSampleDoc = R"(
The plan at a time; beyond its end, the last frame at rest.

Parameters
----------
time : float
    [s].

Returns
-------
tuple of ndarray
    q, shape (nq,); v, shape (nv,); applied force, shape (nv,) [N, N m].
)";

constexpr const char* kTargetDoc = R"(
Changes the target of a term, for commands such as a speed.

Parameters
----------
term : str
    Its name.
target : float, array_like or dict of str to float
    As in Problem.add_term.

Raises
------
KeyError
    Where no term has this name.
)";

void bind_planner(py::module_& o) {
  using P = PlannerHandle;
  py::class_<P, PlannerPtr>(o, "Planner", kPlannerDoc)
      .def(py::init(
               [](const ProblemPtr& problem, const std::optional<opt::PlannerSettings>& settings) {
                 return std::make_shared<P>(*problem, settings.value_or(opt::PlannerSettings()));
               }),
           py::arg("problem"), py::arg("settings") = py::none())
      .def("replan", &replan, py::arg("time"), py::arg("q"), py::arg("v"), kReplanDoc)
      .def("force", &planned_force, py::arg("time"), py::arg("gains"), py::arg("q"), py::arg("v"),
           kPlannedForceDoc)
      .def("sample", &sample, py::arg("time"), kSampleDoc)
      .def("set_target", &set_target, py::arg("term"), py::arg("target"), kTargetDoc)
      .def(
          "forget",
          [](P& p) {
            const Guard::Lock lock(p.guard, kPlanner);
            p.planner.forget();
          },
          "Forgets the plan: the next replan starts from rest.")
      .def_property_readonly(
          "frames",
          [](P& p) {
            const Guard::Lock lock(p.guard, kPlanner);
            return rows_from(p.planner.frames(), p.model().nq());
          },
          "A copy of the plan, shape (steps + 1, nq).")
      .def_property_readonly(
          "time", [](const P& p) { return p.planner.time(); }, "Time of frame 0 [s].")
      .def_readonly("problem", &P::problem, "Problem; changing it has no effect here.")
      .def("__repr__", [](const P& p) {
        return py::str("<Planner '{}': {} steps of {:.6g} s>")
            .format(p.problem->file.name, p.problem->file.problem.steps,
                    p.problem->file.problem.h());
      });
}

}  // namespace

void bind_control(py::module_& o) {
  bind_settings(o);
  bind_gains(o);
  bind_report(o);
  bind_control_problem(o);
  bind_planner(o);
}

}  // namespace counterpoint::python
