// counterpoint.optimization: feedback along a motion, and repeated motions.
#include "counterpoint/engine/optimize/feedback.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "objects/exceptions.h"
#include "objects/properties.h"
#include "optimization.h"

namespace counterpoint::python {
namespace {

struct FeedbackHandle {
  ModelPtr model;
  opt::Feedback feedback;
};
using FeedbackPtr = std::shared_ptr<FeedbackHandle>;

struct RepeatedHandle {
  ModelPtr model;
  opt::RepeatedMotion motion;
};

/// Copies gains to an array of shape (steps, nv, 2 nv).
py::array gains_of(const std::vector<MatrixX>& gains, Eigen::Index nv) {
  py::array_t<double> out({static_cast<py::ssize_t>(gains.size()), nv, 2 * nv});
  double* at = out.mutable_data();
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const MatrixX& gain : gains) {
    Eigen::Map<RowMajor>(at, nv, 2 * nv) = gain;
    at += 2 * nv * nv;
  }
  return out;
}

FeedbackPtr compute_feedback_of(const ResultHandle& r, const opt::FeedbackSettings& settings) {
  auto out = std::make_shared<FeedbackHandle>();
  out->model = r.problem->scene->model;
  const opt::ProblemFile& file = r.problem->file;
  const py::gil_scoped_release release;
  out->feedback = opt::compute_feedback(file.problem, file.settings, r.result, settings);
  return out;
}

RepeatedHandle repeat(const ResultHandle& r, int cycles, const FeedbackPtr& feedback) {
  if (cycles < 1) throw py::value_error("cycles: expected 1 or more");
  return {r.problem->scene->model, opt::repeated(r.problem->file.problem, r.result,
                                                 feedback ? &feedback->feedback : nullptr, cycles)};
}

py::array force(const ModelHandle& model, const Array& q_plan, const Array& v_plan,
                const Array& u_plan, const Array& gain, const Array& q, const Array& v) {
  const Model& m = model.model;
  return copy(opt::following_force(
      m, vector(q_plan, m.nq(), "q_plan"), vector(v_plan, m.nv(), "v_plan"),
      vector(u_plan, m.nv(), "u_plan"), matrix(gain, m.nv(), 2 * m.nv(), "gain"),
      vector(q, m.nq(), "q"), vector(v, m.nv(), "v")));
}

constexpr const char* kComputeDoc = R"(
Feedback along a motion: the finite-horizon linear-quadratic regulator of the steps' derivatives.

Parameters
----------
result : Result
settings : FeedbackSettings, optional

Returns
-------
Feedback
)";

constexpr const char* kRepeatedDoc = R"(
A periodic motion so many times over, mirrored and displaced as its problem says; others as they are.

Parameters
----------
result : Result
cycles : int
feedback : Feedback, optional

Returns
-------
RepeatedMotion
)";

constexpr const char* kForceDoc = R"(
u = u_plan - gain (q (-) q_plan, v - v_plan), within effort limits.

Parameters
----------
model : Model
q_plan : array_like, shape (nq,)
v_plan, u_plan : array_like, shape (nv,)
    [m/s, rad/s], [N, N m]
gain : array_like, shape (nv, 2 nv)
q : array_like, shape (nq,)
v : array_like, shape (nv,)

Returns
-------
ndarray, shape (nv,)
    [N, N m]
)";

void bind_feedback_settings(py::module_& o) {
  using S = opt::FeedbackSettings;
  py::class_<S>(o, "FeedbackSettings", "What feedback weighs.")
      .def(py::init<>())
      .def_readwrite("position_weight", &S::position_weight, "[1/rad, 1/m]")
      .def_readwrite("velocity_weight", &S::velocity_weight, "[s/rad, s/m]")
      .def_readwrite("effort_weight", &S::effort_weight,
                     "Of forces over their effort limit, or over 100 N, N m.")
      .def_readwrite("smoothing", &S::smoothing, "Contacts as soft as at this smoothing [m].")
      .def_readwrite("cycles", &S::cycles, "Of a periodic motion, until gains repeat.");
}

}  // namespace

void bind_feedback(py::module_& o) {
  bind_feedback_settings(o);
  using F = FeedbackHandle;
  py::class_<F, FeedbackPtr>(o, "Feedback", "Gains along a motion.")
      .def_property_readonly(
          "gains", [](const F& f) { return gains_of(f.feedback.gains, f.model->model.nv()); },
          "Of displacements and velocities, by step, shape (steps, nv, 2 nv); a copy.")
      .def_property_readonly("missing", through(&F::feedback, &opt::Feedback::missing),
                             "Steps without derivatives: their gain is that of the step behind.")
      .def(
          "write",
          [](const F& f, const std::filesystem::path& file) {
            opt::write_feedback(file, f.model->model, f.feedback.gains);
          },
          py::arg("file"), "As CSV, for `counterpoint simulate --follow`.")
      .def("__repr__", [](const F& f) {
        return py::str("<Feedback of {} steps>").format(f.feedback.gains.size());
      });
  using R = RepeatedHandle;
  py::class_<R>(o, "RepeatedMotion", "A motion so many times over; arrays are copies.")
      .def_property_readonly(
          "q", [](const R& r) { return rows_from(r.motion.q, r.model->model.nq()); },
          "Shape (steps + 1, nq).")
      .def_property_readonly(
          "v", [](const R& r) { return rows_from(r.motion.v, r.model->model.nv()); },
          "[m/s, rad/s], shape (steps + 1, nv).")
      .def_property_readonly(
          "applied_force",
          [](const R& r) { return rows_from(r.motion.applied_force, r.model->model.nv()); },
          "[N, N m], shape (steps, nv).")
      .def_property_readonly(
          "gains", [](const R& r) { return gains_of(r.motion.gains, r.model->model.nv()); },
          "Shape (steps, nv, 2 nv); (0, nv, 2 nv) without feedback.")
      .def("__repr__", [](const R& r) {
        return py::str("<RepeatedMotion of {} frames>").format(r.motion.q.size());
      });
  o.def("compute_feedback", &compute_feedback_of, py::arg("result"),
        py::arg("settings") = opt::FeedbackSettings(), kComputeDoc);
  o.def("repeated", &repeat, py::arg("result"), py::arg("cycles"),
        py::arg("feedback").none(true) = py::none(), kRepeatedDoc);
  o.def("following_force", &force, py::arg("model"), py::arg("q_plan"), py::arg("v_plan"),
        py::arg("u_plan"), py::arg("gain"), py::arg("q"), py::arg("v"), kForceDoc);
}

}  // namespace counterpoint::python
