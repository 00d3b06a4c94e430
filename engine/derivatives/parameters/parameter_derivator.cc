// ParameterDerivator: closed forms for each part of a step; differences of the whole step where
// there is none.
#include <algorithm>

#include "counterpoint/engine/derivatives/parameters/parameter_constraints.h"
#include "counterpoint/engine/derivatives/parameters/parameter_dynamics.h"
#include "counterpoint/engine/derivatives/step/center_terms.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

using K = StepParameterKind;

/// A step with one parameter changed, with its own model and workspace.
struct ChangedStep {
  explicit ChangedStep(Model changed) : model(std::move(changed)), workspace(model) {}
  Model model;
  Workspace workspace;
  Inverse out;
};

/// The steps of `scheme`, made when first needed.
struct ChangedSteps {
  std::vector<ChangedStep> steps;
  DifferenceScheme scheme;
};

bool is_of_options(const StepParameter& parameter) {
  return parameter.targets.empty() && parameter.kind != K::kGravity;
}

/// Whether everything that acts has a closed form by this parameter.
bool is_closed(K kind, const Model& model, const SimulationOptions& options, const Input& known,
               EffectSet called, const InvertedStep& inverted) {
  if (options.integrator != Integrator::kSemiImplicitEuler) return false;
  if (known.softening.any() && !inverted.constraints->empty()) return false;
  if (!known.taut_links.empty()) return false;
  const bool of_motion = changes_mass_matrix(kind) || kind == K::kGravity || kind == K::kDamping;
  const bool of_equalities = of_motion || kind == K::kCompliance || kind == K::kStabilization ||
                             kind == K::kMaxRecoverySpeed;
  // Predicted velocities depend on these parameters through the equalities.
  if (of_equalities && has_equalities(*inverted.constraints)) return false;
  // The acceleration of a falling body whose weight is carried in part depends on its mass.
  if (changes_mass_matrix(kind) && !model.gravity_compensations().empty() &&
      called.has(Effect::kRestitution))
    return false;
  for (int t = 0; of_motion && t < model.num_trees(); ++t) {
    if (tree_terms(model, t, inverted) != TreeTerms::kProjected) continue;
    if (changes_mass_matrix(kind) || inverted.start.predictor().covers(t)) return false;
  }
  return true;
}

}  // namespace

struct ParameterDerivator::Impl {
  Impl(const Model& model, std::vector<StepParameter> list)
      : parameters(std::move(list)),
        dynamics(model, parameters.size()),
        changed(parameters.size()) {
    for (const StepParameter& parameter : parameters) prepared.emplace_back(parameter, model);
  }

  void differentiate(size_t k, const InverseArguments& of, VectorOut du) {
    const Model& model = of.model;
    const SimulationOptions& options = of.options;
    const StepParameter& parameter = parameters[k];
    ChangedSteps& c = changed[k];
    // For options the model is the same, and they may have changed since the last call.
    const bool of_options = is_of_options(parameter);
    if (c.steps.empty() || of_options) c.scheme = difference_scheme(parameter, model, options);
    if (c.steps.empty()) {
      c.steps.reserve(c.scheme.at.size());
      for (const double by : c.scheme.at) {
        Model to = model;
        SimulationOptions unused = options;
        change_parameter(parameter, by, to, unused);
        c.steps.emplace_back(std::move(to));
      }
    }
    du.setZero();
    for (size_t i = 0; i < c.steps.size(); ++i) {
      ChangedStep& step = c.steps[i];
      SimulationOptions with = options;
      if (of_options) change_parameter(parameter, c.scheme.at[i], step.model, with);
      step_inverse(step.model, with, of.q, of.v, of.v_next, of.known, step.workspace, step.out);
      du += c.scheme.weight[i] * step.out.applied_force;
    }
  }

  std::vector<StepParameter> parameters;
  std::vector<PreparedParameter> prepared;
  ParameterDynamics dynamics;
  ParameterConstraints constraints;
  std::vector<ChangedSteps> changed;
  std::optional<CenterTerms> center;  ///< set once there were free groups
};

ParameterDerivator::ParameterDerivator(const Model& model, std::vector<StepParameter> parameters)
    : impl_(std::make_unique<Impl>(model, std::move(parameters))) {}
ParameterDerivator::~ParameterDerivator() = default;
ParameterDerivator::ParameterDerivator(ParameterDerivator&&) noexcept = default;
ParameterDerivator& ParameterDerivator::operator=(ParameterDerivator&&) noexcept = default;

const std::vector<StepParameter>& ParameterDerivator::parameters() const {
  return impl_->parameters;
}

void ParameterDerivator::inverse(const Model& model, const SimulationOptions& options, VectorRef q,
                                 VectorRef v, VectorRef v_next, const Input& known,
                                 Workspace& workspace, Inverse& out, InverseParameterDerivatives& d,
                                 DerivativeMethod method) {
  step_inverse(model, options, q, v, v_next, known, workspace, out);
  const size_t count = impl_->parameters.size();
  const auto columns = static_cast<Eigen::Index>(count);
  if (d.du.rows() != model.nv() || d.du.cols() != columns) d.du.resize(model.nv(), columns);
  d.by_differences.assign(count, 0);
  if (out.fault.any()) {
    d.du.setConstant(kNaN);
    return;
  }
  Workspace::Impl& ws = workspace.impl();
  const InvertedStep inverted(ws);
  // The model does not call for effects of parameters that are zero, but their derivatives count.
  const EffectSet effects = options.effects;
  const bool analytic =
      method == DerivativeMethod::kAnalytic && options.integrator == Integrator::kSemiImplicitEuler;
  d.du.setZero();
  const VectorX none;
  const VectorRef no_pose(none);
  const InverseArguments of{model, options, q, v, no_pose, v_next, known, effects, ws.z};
  const bool free = analytic && !inverted.free_groups.groups().empty();
  if (free && !impl_->center) impl_->center.emplace(model);
  const VectorRef w =
      free ? VectorRef(impl_->center->find_step_velocity(of, ws.free_groups, ws.start.kinematics(),
                                                         ws.inverse, ws.midpoint.w_m))
           : v_next;
  const InverseArguments alone{model, options, q, v, no_pose, w, known, effects, ws.z};
  if (analytic) impl_->dynamics.add(impl_->prepared, alone, inverted, d.du);
  for (size_t k = 0; k < count; ++k) {
    const PreparedParameter& p = impl_->prepared[k];
    auto column = d.du.col(static_cast<Eigen::Index>(k));
    if (analytic && is_closed(p.kind(), model, options, known, ws.called, inverted) &&
        impl_->constraints.add_contacts(p, model, options, effects, inverted, column)) {
      ParameterConstraints::add_joint_rows(p, of, inverted, column);
      ParameterConstraints::add_first_friction(p, of, inverted, column);
    } else {
      impl_->differentiate(k, of, column);
      d.by_differences[k] = 1;
    }
  }
  if (free)
    impl_->center->correct_parameters(impl_->parameters, of, inverted, d.by_differences, d.du);
}

}  // namespace counterpoint
