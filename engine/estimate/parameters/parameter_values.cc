// The effect of a parameter's value on a scene.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint::estimation {
namespace {

using K = ParameterKind;

/// Axis of a kind that has one for each, such as com_y.
int axis_of(ParameterKind kind) {
  switch (kind) {
    case K::kCenterX:
    case K::kSpreadX:
    case K::kPlaceX:
    case K::kTiltX:
    case K::kJointX:
      return 0;
    case K::kCenterY:
    case K::kSpreadY:
    case K::kPlaceY:
    case K::kTiltY:
    case K::kJointY:
      return 1;
    default:
      return 2;
  }
}

bool is_center(ParameterKind kind) {
  return kind == K::kCenterX || kind == K::kCenterY || kind == K::kCenterZ;
}

/// The deformation of a body about its centre of mass, in axes of its link. It maps the second
/// moments of its mass S to A S A', so that bodies stay physical (Rucker and Wensing, "Smooth
/// Parameterization of Rigid-Body Inertia", RA-L 2022: A is upper triangular there, too).
Matrix3 deformation(ParameterKind kind, double value) {
  Matrix3 A = Matrix3::Identity();
  switch (kind) {
    case K::kShearXY:
      A(0, 1) = value;
      break;
    case K::kShearXZ:
      A(0, 2) = value;
      break;
    case K::kShearYZ:
      A(1, 2) = value;
      break;
    default:
      A(axis_of(kind), axis_of(kind)) = value;
  }
  return A;
}

/// Shifts or turns a geometry along or about its axes.
Pose moved(ParameterKind kind, double value, const Pose& pose) {
  const Vector3 axis = Vector3::Unit(axis_of(kind));
  Pose out = pose;
  if (kind == K::kTiltX || kind == K::kTiltY || kind == K::kTiltZ)
    out.rotation = pose.rotation * Eigen::AngleAxisd(value, axis).toRotationMatrix();
  else
    out.translation += value * (pose.rotation * axis);
  return out;
}

/// Shifts the place of a joint along the axes of the link that carries it, as its file has them;
/// or moves the zero of its coordinate.
Pose moved_joint(ParameterKind kind, double value, int body, const Model& model) {
  const Body& moving = model.body(body);
  Pose out = moving.X_PJ;
  if (kind == K::kJointZero) {
    if (moving.joint_type == JointType::kPrismatic)
      out.translation += value * out.rotation.col(2);
    else if (moving.joint_type == JointType::kRevolute)
      out.rotation = out.rotation * Eigen::AngleAxisd(value, Vector3::UnitZ()).toRotationMatrix();
    else
      throw InputError(
          fmt::format("joint_zero: '{}' has more than one coordinate", model.joint(body - 1).name));
    return out;
  }
  const int carrier =
      model.frames()[static_cast<std::size_t>(model.find_frame(model.joint(body - 1).link))].parent;
  const Matrix3 axes = carrier < 0
                           ? Matrix3::Identity()
                           : model.frames()[static_cast<std::size_t>(carrier)].X_BF.rotation;
  out.translation += value * axes.col(axis_of(kind));
  return out;
}

void set_geometry(ParameterKind kind, int target, double value, const Model& model,
                  ModelEditor& editor) {
  const Geometry& g = model.geometries()[static_cast<std::size_t>(target)];
  const auto* field = std::get_if<double Material::*>(&kind_of(kind).field);
  if (field == nullptr) return editor.set_pose(target, moved(kind, value, g.X_BG));
  Material material = g.material;
  material.*(*field) = value;
  editor.set_material(target, material);
}

/// Returns a copy with one member changed.
template <class Part>
Part with_member(Part part, double Part::*member, double value) {
  part.*member = value;
  return part;
}

void check_option(double value, double low, double high, const char* name) {
  if (value >= low && value <= high) return;
  throw InputError(fmt::format("{}: {:.6g}; expected {:g} to {:g}", name, value, low, high));
}

}  // namespace

Pose link_pose(const Model& model, int body) {
  const int frame = model.find_frame(model.joint(body - 1).link);
  return frame < 0 ? Pose() : model.frames()[static_cast<std::size_t>(frame)].X_BF;
}

SpatialInertia with_value(ParameterKind kind, double value, const SpatialInertia& inertia,
                          const Pose& link) {
  SpatialInertia out = inertia;
  if (kind == K::kMass) {
    if (inertia.mass > 0.0) out.rotational *= value / inertia.mass;
    out.mass = value;
  } else if (kind == K::kInertia) {
    out.rotational *= value;
  } else if (kind == K::kSize) {
    out.center *= value;
    out.rotational *= value * value;
  } else if (is_center(kind)) {
    Vector3 center = link.inverse() * inertia.center;
    center[axis_of(kind)] = value;
    out.center = link * center;
  } else {
    const Matrix3 A = link.rotation * deformation(kind, value) * link.rotation.transpose();
    const Matrix3& I = inertia.rotational;
    const Matrix3 moments = A * (0.5 * I.trace() * Matrix3::Identity() - I) * A.transpose();
    out.rotational = moments.trace() * Matrix3::Identity() - moments;
  }
  return out;
}

double value_at(ParameterKind kind, const Scene& scene, int target) {
  const Model& model = scene.model;
  const KindTraits& traits = kind_of(kind);
  const auto i = static_cast<std::size_t>(target);
  if (const auto* of = std::get_if<double Material::*>(&traits.field))
    return model.geometries()[i].material.*(*of);
  if (const auto* of = std::get_if<double JointSpring::*>(&traits.field))
    return model.springs()[i].*(*of);
  if (const auto* of = std::get_if<double JointServo::*>(&traits.field))
    return model.servos()[i].*(*of);
  if (const auto* of = std::get_if<double Actuator::*>(&traits.field))
    return model.actuators()[i].*(*of);
  if (const auto* of = std::get_if<double ContactOptions::*>(&traits.field))
    return scene.options.contact.*(*of);
  if (is_center(kind))
    return (link_pose(model, target).inverse() * model.body(target).inertia.center)[axis_of(kind)];
  switch (kind) {
    case K::kMass:
      return model.body(target).inertia.mass;
    case K::kInertia:
    case K::kSpreadX:
    case K::kSpreadY:
    case K::kSpreadZ:
    case K::kSize:
    case K::kForceGain:
      return 1.0;
    case K::kDamping:
      return model.damping()[target];
    case K::kDryFriction:
      return model.dry_friction()[target];
    case K::kBreakawayFriction:
      return model.friction_at_rest(target);
    case K::kStribeckSpeed:
      return model.stribeck_speed()[target];
    case K::kArmature:
      return model.armature()[target];
    case K::kGravity:
      return model.gravity().norm();
    default:
      return 0.0;  // differences from the scene's
  }
}

void set_target(ParameterKind kind, int target, double value, const Model& model,
                ModelEditor& editor) {
  const auto i = static_cast<std::size_t>(target);
  const KindTraits& traits = kind_of(kind);
  if (const auto* of = std::get_if<double JointSpring::*>(&traits.field))
    return editor.set_spring(target, with_member(model.springs()[i], *of, value));
  if (const auto* of = std::get_if<double JointServo::*>(&traits.field))
    return editor.set_servo(target, with_member(model.servos()[i], *of, value));
  if (const auto* of = std::get_if<double Actuator::*>(&traits.field))
    return editor.set_actuator(target, with_member(model.actuators()[i], *of, value));
  switch (kind) {
    case K::kMass:
      return editor.set_mass(target, value);
    case K::kInertia:
      return editor.scale_inertia(target, value);
    case K::kForceOffset:
    case K::kForceGain:
    case K::kForceDelay:
      return;  // a property of the recording
    case K::kSize:
      return editor.scale_size(target, value);
    case K::kDamping:
      return editor.set_damping(target, value);
    case K::kDryFriction:
      return editor.set_dry_friction(target, value);
    case K::kBreakawayFriction:
      return editor.set_breakaway_friction(target, value);
    case K::kStribeckSpeed:
      return editor.set_stribeck_speed(target, value);
    case K::kArmature:
      return editor.set_armature(target, value);
    default:
      if (traits.target == Target::kJoints)
        return editor.set_joint_pose(target, moved_joint(kind, value, target, model));
      if (is_inertial(kind))
        return editor.set_inertia(
            target, with_value(kind, value, model.body(target).inertia, link_pose(model, target)));
      return set_geometry(kind, target, value, model, editor);
  }
}

bool set_scene(ParameterKind kind, double value, Model& model, SimulationOptions& options) {
  const KindTraits& traits = kind_of(kind);
  if (kind == K::kGravity) {
    const Vector3 down = model.gravity().normalized();
    check_option(value, 0.0, 1e6, "gravity");
    if (down.isZero()) throw InputError("gravity: the scene has none, hence no direction");
    ModelEditor editor(std::move(model));
    editor.set_gravity(value * down);
    model = editor.take();
    return true;
  }
  const auto* of = std::get_if<double ContactOptions::*>(&traits.field);
  if (of == nullptr) return false;
  const bool share = kind == K::kStabilization, positive = kind == K::kCompliance;
  check_option(value, positive ? 1e-15 : 0.0, share ? 1.0 : 1e6, traits.name);
  options.contact.*(*of) = value;
  return true;
}

void set_parameter(const Parameter& parameter, double value, Model& model,
                   SimulationOptions& options) {
  if (set_scene(parameter.kind, value, model, options)) return;
  for (std::size_t k = 0; k < parameter.targets.size(); ++k) {
    ModelEditor editor(model);
    set_target(parameter.kind, parameter.targets[k], parameter.sign(k) * value, model, editor);
    model = editor.take();
  }
}

}  // namespace counterpoint::estimation
