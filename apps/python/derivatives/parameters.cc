// Derivatives of steps by parameters of the model and of the contact laws.
#include <pybind11/stl.h>

#include "counterpoint/engine/derivatives.h"
#include "motion/reports.h"
#include "objects/derivative_method.h"
#include "objects/properties.h"
#include "objects/typed.h"
#include "objects/workspace.h"

namespace counterpoint::python {
namespace {

using Kind = StepParameterKind;
constexpr const char* kKinds[] = {"inertia",
                                  "friction",
                                  "restitution",
                                  "torsional_friction",
                                  "rolling_friction",
                                  "height",
                                  "damping",
                                  "dry_friction",
                                  "breakaway_friction",
                                  "stribeck_speed",
                                  "armature",
                                  "gravity",
                                  "compliance",
                                  "smoothing",
                                  "stabilization",
                                  "max_recovery_speed"};
constexpr int kNumKinds = sizeof(kKinds) / sizeof(kKinds[0]);
static_assert(kNumKinds == static_cast<int>(Kind::kMaxRecoverySpeed) + 1);
const char* kind_name(Kind kind) { return kKinds[static_cast<int>(kind)]; }

Kind kind_from(const std::string& word) {
  return from_word<Kind>(
      word, "kind", [](const std::string& w) { return find_word<Kind>(w, kind_name, kNumKinds); },
      kind_name, kNumKinds);
}

/// A parameter of one model; its targets are bodies, geometries or coordinates.
struct ParameterHandle {
  ModelPtr model;
  StepParameter parameter;
};

/// Index of a body, geometry or velocity coordinate, by name or number.
int target_index(const ModelPtr& model, Kind kind, py::handle key) {
  const auto index = [&](const char* find) {
    return py::cast(model).attr(find)(key).attr("index").cast<int>();
  };
  switch (kind) {
    case Kind::kInertia:
      return index("body");
    case Kind::kFriction:
    case Kind::kRestitution:
    case Kind::kTorsionalFriction:
    case Kind::kRollingFriction:
    case Kind::kHeight:
      return index("geometry");
    case Kind::kDamping:
    case Kind::kDryFriction:
    case Kind::kBreakawayFriction:
    case Kind::kStribeckSpeed:
    case Kind::kArmature: {
      const std::vector<std::string>& names = model->coordinates->names.v;
      return index_from(
          key, static_cast<int>(names.size()), "coordinate",
          [&](const std::string& name) {
            const auto found = std::find(names.begin(), names.end(), name);
            return found == names.end() ? -1 : static_cast<int>(found - names.begin());
          },
          [&] { return names; });
    }
    default:
      throw py::value_error(std::string("kind '") + kind_name(kind) + "' has no targets");
  }
}

ParameterHandle make_parameter(const ModelPtr& model, const std::string& word,
                               const py::iterable& targets, const py::object& changes) {
  ParameterHandle out{model, {}};
  out.parameter.kind = kind_from(word);
  for (const py::handle key : targets)
    out.parameter.targets.push_back(target_index(model, out.parameter.kind, key));
  if (changes.is_none()) return out;
  const Array array(changes);
  const auto rows =
      matrix(array, static_cast<Eigen::Index>(out.parameter.targets.size()), 10, "changes");
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    out.parameter.changes.push_back(rows.row(i).transpose());
  return out;
}

int body_index(const ModelPtr& model, py::handle key) {
  return target_index(model, Kind::kInertia, key);
}

struct DerivatorHandle {
  ModelPtr model;
  ParameterDerivator derivator;
  Guard guard;
};

std::shared_ptr<DerivatorHandle> make_derivator(const ModelPtr& model,
                                                const std::vector<ParameterHandle>& parameters) {
  std::vector<StepParameter> list;
  for (const ParameterHandle& p : parameters) {
    if (p.model != model) throw py::value_error("parameters: one is of another model");
    list.push_back(p.parameter);
  }
  const py::gil_scoped_release release;
  return std::shared_ptr<DerivatorHandle>(
      new DerivatorHandle{model, ParameterDerivator(model->model, std::move(list)), {}});
}

py::tuple inverse_by_parameters(DerivatorHandle& d, const SimulationOptions& options,
                                const Array& q, const Array& v, const Array& v_next,
                                const InputPtr& known, const WorkspacePtr& given,
                                const std::string& method) {
  const DerivativeMethod how = method_from(method);
  const WorkspacePtr w = given_or_new(given, d.model, "workspace");
  const Guard::Lock own_lock(d.guard, "ParameterDerivator");
  const Guard::Lock lock(w->guard, "Workspace");
  w->set_motion(q, v, py::none(), v_next, known);
  auto out = std::make_shared<InverseHandle>();
  out->model = d.model;
  auto found = std::make_shared<InverseParameterDerivatives>();
  {
    const SimulationOptions own = options;
    const py::gil_scoped_release release;
    d.derivator.inverse(d.model->model, own, w->q, w->v, w->v_next, w->input, w->workspace,
                        out->inverse, *found, how);
  }
  return py::make_tuple(out, found);
}

py::tuple forward_by_parameters(const ForwardDerivatives& d, const Array& du) {
  const MatrixX by = matrix(du, d.dv_du.rows(), -1, "du");
  MatrixX dv_dp, dq_dp;
  forward_parameter_derivatives(d, by, dv_dp, dq_dp);
  return py::make_tuple(copy_matrix(dv_dp), copy_matrix(dq_dp));
}

constexpr const char* kParameterDoc = R"(
One figure of a model or of its laws, of all targets together.

Parameters
----------
model : Model
kind : {'inertia', 'friction', 'restitution', 'torsional_friction', 'rolling_friction', 'height',
        'damping', 'dry_friction', 'breakaway_friction', 'stribeck_speed', 'armature', 'gravity',
        'compliance', 'smoothing', 'stabilization', 'max_recovery_speed'}
    inertia, of bodies; friction, restitution, torsional_friction, rolling_friction [m], height [m]
    of geometries; damping, dry_friction, breakaway_friction, stribeck_speed, armature of
    coordinates; without targets gravity [m/s^2], compliance, smoothing [m], stabilization, max_recovery_speed [m/s].
targets : iterable of str or int
    Names or numbers of bodies, geometries, or coordinates of v.
changes : array_like, shape (targets, 10), optional
    Of 'inertia': what a unit of the parameter adds to inertial_parameters of each target.
)";

constexpr const char* kDerivatorDoc = R"(
Derivatives of steps by parameters; scratch of one thread, made once for many steps.

Parameters
----------
model : Model
parameters : sequence of StepParameter
)";

constexpr const char* kInverseByParametersDoc = R"(
What a step recovers, as step_inverse, and its derivatives by the parameters.

Parameters
----------
options : SimulationOptions
q : array_like, shape (nq,)
v, v_next : array_like, shape (nv,)
    At the start and the end of the step [m/s, rad/s].
known : Input, optional
workspace : Workspace, optional
method : {'analytic', 'central_differences', 'extrapolated'}

Returns
-------
inverse : Inverse
derivatives : InverseParameterDerivatives
)";

constexpr const char* kForwardByParametersDoc = R"(
Derivatives of a step's end by parameters.

Parameters
----------
derivatives : ForwardDerivatives
    Of the step.
du : array_like, shape (nv, n)
    InverseParameterDerivatives.du of the same step.

Returns
-------
dv_dp : ndarray, shape (nv, n)
    Of the velocity at the end.
dq_dp : ndarray, shape (nv, n)
    Of the configuration there, as displacements.
)";

}  // namespace

// Long: declarations of classes and functions.
void bind_parameters(py::module_& m) {
  using P = ParameterHandle;
  py::class_<P>(m, "StepParameter", kParameterDoc)
      .def(py::init(&make_parameter), py::arg("model"), py::arg("kind"),
           py::arg("targets") = py::tuple(), py::arg("changes") = py::none())
      .def_property_readonly(
          "kind", [](const P& p) { return kind_name(p.parameter.kind); }, "A word, see above.")
      .def_property_readonly(
          "targets", [](const P& p) { return p.parameter.targets; },
          "Indices of bodies, geometries or coordinates.")
      .def("__repr__", [](const P& p) {
        return py::str("<StepParameter {} of {}>")
            .format(kind_name(p.parameter.kind), p.parameter.targets);
      });
  using I = InverseParameterDerivatives;
  using Self = std::shared_ptr<I>;
  py::class_<I, Self>(m, "InverseParameterDerivatives",
                      "Of the applied force that step_inverse recovers, by parameters.")
      .def_property_readonly(
          "du", view_of(&I::du),
          "[N, N m over the parameter's unit], shape (nv, number of parameters).")
      .def_property_readonly(
          "by_differences",
          [](const I& d) {
            return std::vector<bool>(d.by_differences.begin(), d.by_differences.end());
          },
          "By parameter: something acts that has no closed form.")
      .def("__repr__", [](const I& d) {
        return py::str("<InverseParameterDerivatives: {} x {}>").format(d.du.rows(), d.du.cols());
      });
  using D = DerivatorHandle;
  py::class_<D, std::shared_ptr<D>>(m, "ParameterDerivator", kDerivatorDoc)
      .def(py::init(&make_derivator), py::arg("model"), py::arg("parameters"))
      .def("inverse", &inverse_by_parameters, py::arg("options"), py::arg("q"), py::arg("v"),
           py::arg("v_next"), py::kw_only(), py::arg("known").none(true) = py::none(),
           py::arg("workspace").none(true) = py::none(), py::arg("method") = "analytic",
           kInverseByParametersDoc)
      .def("__repr__", [](const D& d) {
        return py::str("<ParameterDerivator of {} parameters>")
            .format(d.derivator.parameters().size());
      });
  m.def(
      "mass_parameter",
      [](const ModelPtr& model, const Key& body) {
        return P{model, mass_parameter(model->model, body_index(model, body))};
      },
      py::arg("model"), py::arg("body"),
      "StepParameter: the mass of a body [kg], centre and radii of gyration held.");
  m.def(
      "inertia_scale_parameter",
      [](const ModelPtr& model, const Key& body) {
        return P{model, inertia_scale_parameter(model->model, body_index(model, body))};
      },
      py::arg("model"), py::arg("body"),
      "StepParameter: a factor of a body's rotational inertia about its centre of mass [-].");
  m.def(
      "inertial_step_parameters",
      [](const ModelPtr& model) {
        std::vector<P> out;
        for (StepParameter& p : inertial_step_parameters(model->model))
          out.push_back({model, std::move(p)});
        return out;
      },
      py::arg("model"),
      "List of StepParameter: all of inertial_parameters(model), in their order.");
  m.def("forward_parameter_derivatives", &forward_by_parameters, py::arg("derivatives"),
        py::arg("du"), kForwardByParametersDoc);
}

}  // namespace counterpoint::python
