#include <algorithm>
#include <cmath>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/parameters/perturbed.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {
namespace {

using K = StepParameterKind;

void change_target(const StepParameter& parameter, size_t i, double by, const Model& model,
                   ModelEditor& editor) {
  const int target = parameter.targets[i];
  if (parameter.kind == K::kInertia) {
    const InertialParameters now = inertial_parameters(model.body(target).inertia);
    return editor.set_inertia(target, spatial_inertia(now + by * parameter.changes[i]));
  }
  if (parameter.kind == K::kDamping)
    return editor.set_damping(target, model.damping()[target] + by);
  if (parameter.kind == K::kDryFriction)
    return editor.set_dry_friction(target, model.dry_friction()[target] + by);
  if (parameter.kind == K::kBreakawayFriction)
    return editor.set_breakaway_friction(target, model.breakaway_friction()[target] + by);
  if (parameter.kind == K::kStribeckSpeed)
    return editor.set_stribeck_speed(target, model.stribeck_speed()[target] + by);
  if (parameter.kind == K::kArmature)
    return editor.set_armature(target, model.armature()[target] + by);
  const Geometry& g = model.geometries()[static_cast<size_t>(target)];
  if (parameter.kind == K::kHeight) {
    Pose pose = g.X_BG;
    pose.translation += by * (pose.rotation * parameter.direction(i));
    return editor.set_pose(target, pose);
  }
  Material m = g.material;
  (parameter.kind == K::kFriction            ? m.friction
   : parameter.kind == K::kRestitution       ? m.restitution
   : parameter.kind == K::kTorsionalFriction ? m.torsional_friction
                                             : m.rolling_friction) += by;
  editor.set_material(target, m);
}

double value_at(StepParameterKind kind, int target, const Model& model) {
  if (kind == K::kDamping) return model.damping()[target];
  if (kind == K::kDryFriction) return model.dry_friction()[target];
  if (kind == K::kBreakawayFriction) return model.breakaway_friction()[target];
  if (kind == K::kStribeckSpeed) return model.stribeck_speed()[target];
  if (kind == K::kArmature) return model.armature()[target];
  const Material& m = model.geometries()[static_cast<size_t>(target)].material;
  return kind == K::kFriction            ? m.friction
         : kind == K::kRestitution       ? m.restitution
         : kind == K::kTorsionalFriction ? m.torsional_friction
                                         : m.rolling_friction;
}

/// Returns a change of the parameter by which no inertial entry of a target changes by more than
/// its body has.
double inertia_scale(const StepParameter& parameter, const Model& model) {
  double most = 0.0;
  for (size_t i = 0; i < parameter.targets.size(); ++i) {
    const SpatialInertia& inertia = model.body(parameter.targets[i]).inertia;
    const InertialParameters& change = parameter.changes[i];
    const double square = inertia.rotational.trace() / inertia.mass;
    const double offset = inertia.center.norm();
    // The inertia about the centre of mass is a difference, which may be small.
    const double share = std::max(
        {std::abs(change[0]) * (1.0 + offset * offset / square),
         change.segment<3>(1).lpNorm<Eigen::Infinity>() * (std::sqrt(square) + offset) / square,
         change.tail<6>().lpNorm<Eigen::Infinity>() / square});
    most = std::max(most, share / inertia.mass);
  }
  return most > 0.0 && std::isfinite(most) ? 1.0 / most : 1.0;
}

/// Returns the contact option that is this parameter, or null.
double* option_of(StepParameterKind kind, ContactOptions& contact) {
  switch (kind) {
    case K::kCompliance:
      return &contact.compliance;
    case K::kSmoothing:
      return &contact.smoothing;
    case K::kStabilization:
      return &contact.stabilization;
    case K::kMaxRecoverySpeed:
      return &contact.max_recovery_speed;
    default:
      return nullptr;
  }
}

}  // namespace

StepParameter mass_parameter(const Model& model, int body) {
  const InertialParameters now = inertial_parameters(model.body(body).inertia);
  return {K::kInertia, {body}, {now / now[0]}};
}

StepParameter inertia_scale_parameter(const Model& model, int body) {
  SpatialInertia about_center = model.body(body).inertia;
  about_center.mass = 0.0;
  return {K::kInertia, {body}, {inertial_parameters(about_center)}};
}

std::vector<StepParameter> inertial_step_parameters(const Model& model) {
  std::vector<StepParameter> all;
  for (int body = 1; body < model.num_bodies(); ++body)
    for (int i = 0; i < 10; ++i)
      all.push_back({K::kInertia, {body}, {InertialParameters::Unit(i)}});
  return all;
}

void change_parameter(const StepParameter& parameter, double by, Model& model,
                      SimulationOptions& options) {
  if (double* option = option_of(parameter.kind, options.contact)) {
    *option += by;
    return;
  }
  ModelEditor editor(model);
  if (parameter.kind == K::kGravity) {
    const Vector3& g = model.gravity();
    if (g.isZero(0.0)) throw InputError("gravity: the scene has none, hence no direction");
    editor.set_gravity(g + by * g.normalized());
  }
  for (size_t i = 0; i < parameter.targets.size(); ++i)
    change_target(parameter, i, by, model, editor);
  model = editor.take();
}

DifferenceScheme difference_scheme(double step, double value, bool may_be_negative) {
  if (!may_be_negative && value < 4.0 * step) {
    return {{0.0, step, 2.0 * step, 3.0 * step},
            {-11.0 / (6.0 * step), 3.0 / step, -1.5 / step, 1.0 / (3.0 * step)}};
  }
  const double near = 2.0 / (3.0 * step), far = 1.0 / (12.0 * step);
  return {{step, -step, 2.0 * step, -2.0 * step}, {near, -near, -far, far}};
}

DifferenceScheme difference_scheme(const StepParameter& parameter, const Model& model,
                                   const SimulationOptions& options) {
  constexpr double kShare = 1e-3;
  SimulationOptions copy = options;
  if (const double* option = option_of(parameter.kind, copy.contact)) {
    const double least = parameter.kind == K::kMaxRecoverySpeed ? 1e-3 : 1e-12;
    return difference_scheme(kShare * std::max(*option, least), *option, false);
  }
  if (parameter.kind == K::kHeight)
    return difference_scheme(std::clamp(1e-4 * options.contact.smoothing, 1e-10, 1e-6), 0.0, true);
  if (parameter.kind == K::kGravity)
    return difference_scheme(kShare * model.gravity().norm(), 0.0, true);
  if (parameter.kind == K::kInertia)
    return difference_scheme(kShare * inertia_scale(parameter, model), 0.0, true);
  double least = HUGE_VAL;
  for (const int target : parameter.targets)
    least = std::min(least, value_at(parameter.kind, target, model));
  // Rotors and dampers may be zero and act on light links: their step has a lower bound.
  const double step = parameter.kind == K::kArmature        ? kShare * std::max(least, 1e-3)
                      : parameter.kind == K::kDamping       ? kShare * std::max(least, 1e-1)
                      : parameter.kind == K::kStribeckSpeed ? kShare * least
                                                            : kShare;
  return difference_scheme(step, least, false);
}

void forward_parameter_derivatives(const ForwardDerivatives& d, const MatrixX& du, MatrixX& dv_dp,
                                   MatrixX& dq_dp) {
  for (MatrixX* m : {&dv_dp, &dq_dp})
    if (m->rows() != du.rows() || m->cols() != du.cols()) m->resize(du.rows(), du.cols());
  dv_dp.noalias() = -d.dv_du.lazyProduct(du);
  if (d.displaces) {
    dq_dp.noalias() = d.dq_dv_next.lazyProduct(dv_dp);
  } else {
    dq_dp.noalias() = -d.dq_du.lazyProduct(du);
  }
}

}  // namespace counterpoint
