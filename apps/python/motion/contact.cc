// counterpoint.contact: contact problems given as matrices, and settings of their solver.
#include <pybind11/stl.h>

#include "counterpoint/contact/solver.h"
#include "objects/arrays.h"
#include "objects/properties.h"

namespace counterpoint::python {
namespace {

namespace ct = counterpoint::contact;

ct::ContactSpaceProblem problem_from(const Array& A, const Array& c, const Array& mu) {
  check_shape(mu, {-1}, "mu");
  const Eigen::Index n = mu.shape(0);
  ct::ContactSpaceProblem problem;
  problem.A = matrix(A, 3 * n, 3 * n, "A");
  problem.c = vector(c, 3 * n, "c");
  problem.mu.assign(mu.data(), mu.data() + n);
  return problem;
}

ct::ContactSpaceOptions options_from(bool coulomb, double compliance, double smoothing,
                                     double rank_tolerance) {
  ct::ContactSpaceOptions options;
  options.coulomb = coulomb;
  options.compliance = compliance;
  options.smoothing = smoothing;
  options.rank_tolerance = rank_tolerance;
  return options;
}

void bind_settings(py::module_& c) {
  using S = ct::Settings;
  py::class_<S>(c, "Settings", R"(
Speed and accuracy of the solver only; never the physics.

Parameters
----------
tolerance : float
    Converged when the relative residual is at most this.
max_iterations : int
    Newton steps, an island.
soften_after : int
    Newton steps after which an island is solved with softer laws; 0: never, what cannot be solved
    then fails.
)")
      .def(py::init([](double tolerance, int max_iterations, int soften_after) {
             S settings;
             settings.tolerance = tolerance;
             settings.max_iterations = max_iterations;
             settings.soften_after = soften_after;
             return settings;
           }),
           py::arg("tolerance") = S().tolerance, py::arg("max_iterations") = S().max_iterations,
           py::arg("soften_after") = S().soften_after)
      .def_readwrite("tolerance", &S::tolerance,
                     "Converged when the relative residual is at most this.")
      .def_readwrite("max_iterations", &S::max_iterations, "Newton steps, an island.")
      .def_readwrite("soften_after", &S::soften_after,
                     "Newton steps after which an island is solved with softer laws; 0: never.")
      .def("__eq__", [](const S& a, const S& b) { return a == b; })
      .def("__repr__", [](const S& s) {
        return py::str("Settings(tolerance={:g}, max_iterations={}, soften_after={})")
            .format(s.tolerance, s.max_iterations, s.soften_after);
      });
}

void bind_solution(py::module_& c) {
  using S = ct::ContactSpaceSolution;
  using Self = std::shared_ptr<S>;
  py::class_<S, Self>(c, "ContactSpaceSolution", "Impulses and velocities of a contact problem.")
      .def_property_readonly("f", view_of(&S::f),
                             "Impulses [N s], shape (3 n,), rows (normal, t1, t2) a contact.")
      .def_property_readonly("v", view_of(&S::v),
                             "Velocities at which the law gives f to the bit [m/s], shape (3 n,).")
      .def_property_readonly(
          "status", [](const S& s) { return status_name(s.report.status); },
          "converged, roundoff_floor, or why it failed.")
      .def_property_readonly(
          "succeeded", [](const S& s) { return succeeded(s.report.status); },
          "May the result be used?")
      .def_property_readonly("iterations", through(&S::report, &ct::Report::iterations),
                             "Newton steps.")
      .def_property_readonly("residual", through(&S::report, &ct::Report::residual), "Relative.")
      .def_readonly("rank", &S::rank, "Of A.")
      .def_readonly("asymmetry", &S::asymmetry,
                    "Largest |A - A'| over the largest |A|: what symmetrising changed.")
      .def("__repr__", [](const S& s) {
        return py::str("<ContactSpaceSolution {}: {} contacts, {} Newton steps>")
            .format(status_name(s.report.status), s.f.size() / 3, s.report.iterations);
      });
}

}  // namespace

constexpr const char* kSolveContactSpaceDoc = R"(
Solves (A, c, mu) for impulses f and velocities v = c + A f.

Parameters
----------
A : array_like, shape (3 n, 3 n)
    Symmetric positive semidefinite [1/kg], rows (normal, t1, t2) a contact; only its symmetric part
    is used.
c : array_like, shape (3 n,)
    Contact velocity without impulses [m/s].
mu : array_like, shape (n,)
    Coulomb coefficients.
coulomb : bool
    Regularized Coulomb friction; else the convex law.
compliance : float
    Regularizer over the mean diagonal of a contact's block of A [-].
smoothing : float
    Of every contact [N m].
rank_tolerance : float
    Pivots of A below this share of their own diagonal entry count as zero.
settings : Settings

Returns
-------
ContactSpaceSolution
    Nothing is raised for what cannot be solved: see succeeded.
)";

constexpr const char* kInvertContactSpaceDoc = R"(
The inverse, in closed form: impulses that make contact velocity v, and the c that they explain.

Parameters
----------
A, mu, coulomb, compliance, smoothing, rank_tolerance
    Those of the forward problem.
v : array_like, shape (3 n,)
    [m/s]

Returns
-------
f : ndarray, shape (3 n,)
    [N s]
c : ndarray, shape (3 n,)
    v - A f [m/s].
)";

constexpr const char* kContactSpaceResidualsDoc = R"(
Distances of f from the hard laws, computed from A, c, f alone.

Returns
-------
primal : float
    Largest distance of f from the friction cone, over the largest |f|.
dual : float
    Of v from the dual cone, over the largest |c|.
complementarity : float
    Largest power |f . v|, over the product of both scales.
)";

void bind_contact(py::module_& m) {
  py::module_ c = m.def_submodule("contact", "Contact problems without bodies, and their solver.");
  bind_settings(c);
  bind_solution(c);
  const ct::ContactSpaceOptions defaults;
  c.def(
      "solve_contact_space",
      [](const Array& A, const Array& c0, const Array& mu, bool coulomb, double compliance,
         double smoothing, double rank_tolerance, const ct::Settings& settings) {
        const ct::ContactSpaceProblem problem = problem_from(A, c0, mu);
        const auto options = options_from(coulomb, compliance, smoothing, rank_tolerance);
        const ct::Settings own = settings;
        const py::gil_scoped_release release;
        return std::make_shared<ct::ContactSpaceSolution>(
            solve_contact_space(problem, options, own));
      },
      py::arg("A"), py::arg("c"), py::arg("mu"), py::kw_only(),
      py::arg("coulomb") = defaults.coulomb, py::arg("compliance") = defaults.compliance,
      py::arg("smoothing") = defaults.smoothing,
      py::arg("rank_tolerance") = defaults.rank_tolerance, py::arg("settings") = ct::Settings(),
      kSolveContactSpaceDoc);
  c.def(
      "invert_contact_space",
      [](const Array& A, const Array& v, const Array& mu, bool coulomb, double compliance,
         double smoothing, double rank_tolerance) {
        const ct::ContactSpaceProblem problem = problem_from(A, v, mu);
        const auto options = options_from(coulomb, compliance, smoothing, rank_tolerance);
        ct::ContactSpaceInverse inverse;
        {
          const py::gil_scoped_release release;
          inverse = invert_contact_space(problem, problem.c, options);
        }
        return py::make_tuple(copy(inverse.f), copy(inverse.c));
      },
      py::arg("A"), py::arg("v"), py::arg("mu"), py::kw_only(),
      py::arg("coulomb") = defaults.coulomb, py::arg("compliance") = defaults.compliance,
      py::arg("smoothing") = defaults.smoothing,
      py::arg("rank_tolerance") = defaults.rank_tolerance, kInvertContactSpaceDoc);
  c.def(
      "contact_space_residuals",
      [](const Array& A, const Array& c0, const Array& mu, const Array& f, bool coulomb) {
        const ct::ContactSpaceProblem problem = problem_from(A, c0, mu);
        const VectorX impulse = vector(f, problem.c.size(), "f");
        ct::ContactSpaceResiduals r;
        {
          const py::gil_scoped_release release;
          r = contact_space_residuals(problem, impulse, coulomb);
        }
        return py::make_tuple(r.primal, r.dual, r.complementarity);
      },
      py::arg("A"), py::arg("c"), py::arg("mu"), py::arg("f"), py::arg("coulomb") = false,
      kContactSpaceResidualsDoc);
}

}  // namespace counterpoint::python
