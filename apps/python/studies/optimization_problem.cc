// counterpoint.optimization: the problem, with its conditions and costs.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "counterpoint/engine/optimize/reference.h"
#include "objects/exceptions.h"
#include "objects/typed.h"
#include "optimization.h"

namespace counterpoint::python {
namespace {

std::vector<VectorX> straight_guess(const ProblemHandle& p) {
  const opt::Problem& problem = p.file.problem;
  const Model& model = *problem.model;
  VectorX end = problem.goal_q.value_or(problem.start_q);
  if (problem.periodic)
    for (int i = 1; i < model.num_bodies(); ++i)
      if (model.body(i).joint_type == JointType::kFloating)
        end.segment<3>(model.body(i).q_index) += problem.displacement;
  return opt::straight_line(model, problem.start_q, end, problem.steps);
}

ProblemPtr load_problem(const std::filesystem::path& file, std::optional<int> steps) {
  return handle_of(reading(file, [&] { return opt::load_problem(file, steps); }));
}

void set_passive(const std::vector<std::string>& joints, const Model& model,
                 std::vector<char>& motors) {
  for (const std::string& name : joints) {
    const int joint = model.find_joint(name);
    if (joint < 0) throw_unknown("joint", name, names_of(model.joints()));
    const Body& body = model.body(joint + 1);
    for (int k = 0; k < joint_nv(body.joint_type); ++k)
      motors[static_cast<size_t>(body.v_index + k)] = 0;
  }
}

ProblemPtr make_problem(const SceneHandle& scene, int steps, const py::object& start_q,
                        const py::object& start_v, const py::object& goal_q,
                        const py::object& goal_v, bool settle, bool periodic,
                        const Array& displacement,
                        const std::optional<std::pair<std::string, std::string>>& mirror,
                        const std::vector<std::string>& passive,
                        const std::optional<std::pair<double, double>>& duration) {
  auto out = std::make_shared<ProblemHandle>();
  out->scene = std::make_shared<SceneHandle>(scene);
  out->file.name = scene.name;
  const Model& model = scene.model->model;
  const VectorX still = VectorX::Zero(model.nv());
  opt::Problem& p = out->file.problem;
  p.model = &out->scene->model->model;
  p.options = scene.options;
  p.steps = steps;
  p.start_q = vector_or(start_q, scene.q, "start_q");
  p.start_v = vector_or(start_v, still, "start_v");
  if (!goal_q.is_none()) p.goal_q = vector_or(goal_q, scene.q, "goal_q");
  p.goal_v = vector_or(goal_v, still, "goal_v");
  p.settle = settle;
  p.periodic = periodic;
  p.displacement = vector3(displacement, "displacement");
  if (mirror) p.mirror = opt::make_mirror(model, mirror->first, mirror->second);
  if (duration) p.duration = {duration->first, duration->second};
  p.motors = opt::motors_of(model);
  set_passive(passive, model, p.motors);
  p.terms.push_back(opt::unactuated_condition(model, p.motors));
  opt::check_problem(p);
  out->file.guess = straight_guess(*out);
  return out;
}

void set_frame(const ModelHandle& model, const std::string& link, const Pose& target,
               opt::Term& term) {
  const auto index = static_cast<size_t>(check_frame(model, link));
  const Frame& at = model.model.frames()[index];
  term.body = at.body;
  term.point = at.X_BF * term.point;
  term.axis = at.X_BF.rotation * term.axis;
  term.orientation = target.rotation * at.X_BF.rotation.transpose();
}

void add_term(ProblemHandle& p, const std::string& word, const py::object& weight,
              const py::object& target, const std::string& link, const Array& point,
              const PoseLike& orientation, const Array& axis, double radius, double length,
              std::pair<int, int> frames, std::optional<bool> condition, double late_weight,
              const std::string& name, const py::object& targets) {
  const auto quantity = opt::quantity_from_name(word);
  if (!quantity)
    throw py::value_error("quantity '" + word + "': expected one of " + opt::quantity_names());
  const ModelHandle& model = *p.scene->model;
  opt::Problem& problem = p.file.problem;
  opt::Term term;
  term.quantity = *quantity;
  term.name = name.empty() ? word : name;
  const bool pushes = *quantity == opt::Quantity::kUnactuatedForce;
  term.weight =
      weight.is_none() && pushes
          ? opt::unactuated_weights(model.model, problem.motors)
          : by_row(model, *quantity, weight.is_none() ? py::float_(1.0) : weight, "weight");
  // The force of a coordinate without a motor must vanish, so it has no weight as effort.
  if (*quantity == opt::Quantity::kAppliedForce)
    for (Eigen::Index i = 0; i < term.weight.size(); ++i)
      if (!problem.motors[static_cast<size_t>(i)]) term.weight[i] = 0.0;
  if (*quantity == opt::Quantity::kConfiguration)
    term.target = vector_or(target, problem.start_q, "target");
  else if (!target.is_none() || *quantity == opt::Quantity::kClearance)
    term.target = by_row(model, *quantity, target.is_none() ? py::float_(0.0) : target, "target");
  if (!targets.is_none())
    for (const py::handle row : targets)
      term.targets.push_back(
          vector(py::cast<Array>(row), opt::target_size(model.model, *quantity), "targets"));
  term.point = vector3(point, "point");
  term.axis = vector3(axis, "axis").normalized();
  term.radius = radius;
  term.length = length;
  term.frames = {frames.first, frames.second};
  term.condition = condition.value_or(pushes);
  term.late_weight = late_weight;
  if (!link.empty()) set_frame(model, link, pose_from(orientation, "orientation"), term);
  opt::Problem changed = problem;
  if (pushes)
    std::erase_if(changed.terms,
                  [](const opt::Term& t) { return t.quantity == opt::Quantity::kUnactuatedForce; });
  changed.terms.push_back(term);
  opt::check_problem(changed);
  problem = std::move(changed);
}

void bind_optimization_settings(py::module_& o) {
  using C = opt::Continuation;
  py::class_<C>(o, "Continuation",
                "How smoothing falls, from far-reaching soft contacts to those of the problem.")
      .def_readwrite("start", &C::start, "Smoothing of the first stage [m].")
      .def_readwrite("end", &C::end, "Of the last [m]; None: that of the problem's options.")
      .def_readwrite("resume_at", &C::resume_at,
                     "Where to go on, of a motion that was stopped [m], or None.")
      .def_readwrite("factor", &C::factor, "From stage to stage, at first.")
      .def_readwrite("max_factor", &C::max_factor, "While stages need few iterations.")
      .def_readwrite("hard_factor", &C::hard_factor, "Below 2e-9 m.")
      .def_readwrite("compliance_per_metre", &C::compliance_per_metre,
                     "Compliance over smoothing, no lower than the problem's [1/m].")
      .def_readwrite("margin_per_smoothing", &C::margin_per_smoothing,
                     "Contacts exist so many smoothings away.")
      .def_readwrite("quick_recovery_above", &C::quick_recovery_above,
                     "Smoothing down to which overlaps are recovered in a step [m].")
      .def_readwrite("extrapolate", &C::extrapolate,
                     "A stage starts from the line through the ends of the last two.")
      .def_readwrite("limits_below", &C::limits_below,
                     "Joint limits act from this smoothing on [m].")
      .def_readwrite("penalty_start", &C::penalty_start, "Of conditions, at first.")
      .def_readwrite("penalty_end", &C::penalty_end, "Of conditions, from 1e-6 m on.")
      .def_readwrite("rounds", &C::rounds, "Of minimization and multipliers, a stage.")
      .def_readwrite("multiplier_limit", &C::multiplier_limit,
                     "Multipliers move only where conditions are this near.")
      .def_readwrite("contact_damping", &C::contact_damping,
                     "Weight of relative changes of contact forces in the damping; 0: none.");
  using S = opt::Settings;
  py::class_<S>(o, "Settings", "How a motion is looked for.")
      .def(py::init<>())
      .def_readwrite("threads", &S::threads, "0: one a core; no result depends on it.")
      .def_readwrite("max_iterations", &S::max_iterations, "Newton steps of all stages.")
      .def_readwrite("stage_iterations", &S::stage_iterations, "Of one minimization.")
      .def_readwrite("tolerance", &S::tolerance,
                     "A minimization ends where a step lowers the cost by less of it.")
      .def_readwrite("violation_tolerance", &S::violation_tolerance, "Of conditions, at the end.")
      .def_readwrite("continuation", &S::continuation, "Continuation.");
}

constexpr const char* kProblemDoc = R"(
What is wanted of a motion, its frames being the variables (docs/guide/trajectory-optimization.md).

Forces follow from the frames by the inverse; that nothing pushes where no motor is, is a condition
of every problem.

Parameters
----------
scene : Scene
    Model, and contacts at the end of the continuation; copied. time_step is that between frames.
steps : int
    N, 4 or more: frames 0 ... N.
start_q, start_v : array_like, optional
    Frame 0, and its velocity; default: the scene's q, at rest.
goal_q, goal_v : array_like, optional
    Frame N, and its velocity; default: free.
settle : bool
    Start and goal stand: floating bodies are raised or lowered until contacts carry them.
periodic : bool
    Frame t + N is frame t, displaced.
displacement : array_like, shape (3,)
    Of a period [m].
mirror : pair of str, optional
    Words for left and right in joints' names: frame t + N is frame t's mirror image.
passive : sequence of str
    Joints whose motors do nothing.
duration : pair of float, optional
    Least and most [s]: the time step is an unknown, too, and Result.options has the one found.
    Default: steps times the scene's time_step.
)";

constexpr const char* kTermDoc = R"(
Adds a term, 1/2 |weight (value - target)|^2 over frames, or a condition (docs/reference/optimization-format.md).

Parameters
----------
quantity : {'configuration', 'velocity', 'joint_limits', 'acceleration', 'applied_force',
            'unactuated_force', 'position', 'orientation', 'point_velocity', 'clearance', 'sliding',
            'tilt', 'center_of_mass', 'momentum', 'angular_momentum', 'contact_force', 'duration'}
weight : float, array_like or dict of str to float, optional
    For all rows, by row, or by coordinate ('elbow.u'), the others zero; default 1.
target : float, array_like or dict of str to float, optional
    As weight; of configuration q, shape (nq,), by default the start. Else zero.
link : str
    What the term is about, of quantities of points and bodies.
point : array_like, shape (3,)
    In the link's frame [m].
orientation : Pose or array_like, shape (3, 3), optional
    Target of `orientation`.
axis : array_like, shape (3,)
    Of `tilt`, in the link's frame.
radius, length : float
    See the page named above [m, rad].
frames : pair of int
    First and last; negative ones from the end.
condition : bool, optional
    Driven to zero; default: for unactuated_force only, in place of the problem's own.
late_weight : float
    The weight grows by this factor as smoothing falls.
name : str
    In reports.
targets : array_like, shape (steps + 1, rows), optional
    Targets of frames 0 ... steps in place of `target`; configuration: rows of q; orientation: unit
    quaternions w, x, y, z of the link's body.
)";

// Long: declarations of the members of a class.
void bind_problem(py::module_& o) {
  using P = ProblemHandle;
  py::class_<P, ProblemPtr>(o, "Problem", kProblemDoc)
      .def(py::init(&make_problem), py::arg("scene"), py::arg("steps"), py::kw_only(),
           py::arg("start_q") = py::none(), py::arg("start_v") = py::none(),
           py::arg("goal_q") = py::none(), py::arg("goal_v") = py::none(),
           py::arg("settle") = false, py::arg("periodic") = false,
           py::arg("displacement") = py::make_tuple(0, 0, 0), py::arg("mirror") = py::none(),
           py::arg("passive") = std::vector<std::string>(), py::arg("duration") = py::none())
      .def("add_term", &add_term, py::arg("quantity"), py::kw_only(),
           py::arg("weight") = py::none(), py::arg("target") = py::none(), py::arg("link") = "",
           py::arg("point") = py::make_tuple(0, 0, 0), py::arg("orientation") = py::none(),
           py::arg("axis") = py::make_tuple(0, 0, 1), py::arg("radius") = 0.0,
           py::arg("length") = 0.05, py::arg("frames") = std::pair(0, -1),
           py::arg("condition") = py::none(), py::arg("late_weight") = 1.0, py::arg("name") = "",
           py::arg("targets") = py::none(), kTermDoc)
      .def_property_readonly(
          "name", [](const P& p) { return p.file.name; }, "The file's, or the scene's.")
      .def_readonly("scene", &P::scene,
                    "Scene, with the time step between frames; changing it has no effect here.")
      .def_property_readonly(
          "model", [](const P& p) { return p.scene->model; }, "Model.")
      .def_property_readonly(
          "steps", [](const P& p) { return p.file.problem.steps; }, "N: frames 0 ... N.")
      .def_property_readonly(
          "time_step", [](const P& p) { return p.file.problem.h(); }, "Between frames [s].")
      .def_property_readonly(
          "periodic", [](const P& p) { return p.file.problem.periodic; }, "Is it a cycle?")
      .def_property_readonly(
          "terms", [](const P& p) { return names_of(p.file.problem.terms); }, "Their names.")
      .def_property_readonly(
          "motors",
          [](const P& p) {
            const auto& motors = p.file.problem.motors;
            py::array_t<bool> out(static_cast<py::ssize_t>(motors.size()));
            std::copy(motors.begin(), motors.end(), out.mutable_data());
            return out;
          },
          "By coordinate of v: is a motor there? Shape (nv,).")
      .def_property(
          "settings", [](P& p) -> opt::Settings& { return p.file.settings; },
          [](P& p, const opt::Settings& settings) { p.file.settings = settings; },
          py::return_value_policy::reference_internal, "Settings, as the file has them; live.")
      .def_property_readonly(
          "guess", [](const P& p) { return rows_from(p.file.guess, p.file.problem.model->nq()); },
          "Frames to begin with, shape (steps + 1, nq): the file's, or straight to the goal.")
      .def_property(
          "noise", [](const P& p) { return p.file.noise; },
          [](P& p, double noise) { p.file.noise = noise; },
          "Standard deviation of what seeds add to joints [rad, m].")
      .def(
          "seeded_guess",
          [](const P& p, std::uint64_t seed) {
            return rows_from(opt::seeded_guess(p.file, seed), p.file.problem.model->nq());
          },
          py::arg("seed"),
          "The guess with the noise of a seed, shape (steps + 1, nq); seed 0: as it is.")
      .def("__repr__", [](const P& p) {
        return py::str("<Problem '{}': {} steps of {:.6g} s, {} terms>")
            .format(p.file.name, p.file.problem.steps, p.file.problem.h(),
                    p.file.problem.terms.size());
      });
}

constexpr const char* kLoadDoc = R"(
Reads a problem file (docs/reference/optimization-format.md).

Parameters
----------
file : path
steps : int, optional
    In place of the file's.

Returns
-------
Problem

Raises
------
InputError
    Naming file, line, element, what was expected and what to do.
FileNotFoundError
)";

}  // namespace

VectorX by_row(const ModelHandle& model, opt::Quantity quantity, const py::object& given,
               const char* name) {
  const int rows = opt::rows_of(model.model, quantity);
  if (py::isinstance<py::float_>(given) || py::isinstance<py::int_>(given))
    return VectorX::Constant(rows, given.cast<double>());
  if (!py::isinstance<py::dict>(given)) return vector(Array(given), rows, name);
  if (!opt::of_coordinates(quantity))
    throw py::type_error(std::string(name) + ": names are of coordinates; " +
                         opt::quantity_name(quantity) + " has none");
  VectorX out = VectorX::Zero(rows);
  for (const auto& [key, value] : given.cast<py::dict>()) {
    const auto place = model.coordinates->find(key.cast<std::string>());
    if (place.kind == Coordinates::Kind::kPosition)
      throw py::key_error(std::string(name) + ": '" + key.cast<std::string>() +
                          "' is of q; rows are those of v and of forces");
    out[place.index] = value.cast<double>();
  }
  return out;
}

ProblemPtr handle_of(opt::ProblemFile file) {
  auto out = std::make_shared<ProblemHandle>();
  out->file = std::move(file);
  const Scene& scene = *out->file.scene;
  out->scene = std::make_shared<SceneHandle>(
      SceneHandle{scene.name, std::make_shared<ModelHandle>(scene.model), scene.q, scene.v,
                  out->file.problem.options});
  out->file.problem.model = &out->scene->model->model;
  return out;
}

py::array rows_from(const std::vector<VectorX>& list, Eigen::Index width) {
  py::array_t<double> out({static_cast<py::ssize_t>(list.size()), width});
  double* row = out.mutable_data();
  for (const VectorX& x : list) row = std::copy_n(x.data(), width, row);
  return out;
}

std::vector<VectorX> frames_from(const Array& array, Eigen::Index width, const char* name) {
  const auto rows = matrix(array, -1, width, name);
  std::vector<VectorX> out;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) out.emplace_back(rows.row(i));
  return out;
}

void bind_optimization_problem(py::module_& o) {
  bind_optimization_settings(o);
  bind_problem(o);
  o.def("load_problem", &load_problem, py::arg("file"), py::arg("steps") = py::none(), kLoadDoc);
}

}  // namespace counterpoint::python
