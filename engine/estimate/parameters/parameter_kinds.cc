#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "counterpoint/model/model_builder.h"

namespace counterpoint::estimation {
namespace {

using K = ParameterKind;
constexpr std::array kKinds = {
    KindTraits{K::kFriction, "friction", "-", Target::kGeometries, 0.01, 1.5},
    KindTraits{K::kStaticFriction, "static_friction", "-", Target::kGeometries, 0.01, 2.0},
    KindTraits{K::kRestitution, "restitution", "-", Target::kGeometries, 0.0, 0.95},
    KindTraits{K::kTorsionalFriction, "torsional_friction", "m", Target::kGeometries, 0.0, 0.05},
    KindTraits{K::kRollingFriction, "rolling_friction", "m", Target::kGeometries, 0.0, 0.05},
    KindTraits{K::kStiffness, "stiffness", "N/m", Target::kGeometries, 1e3, 1e7, true},
    KindTraits{K::kMass, "mass", "kg", Target::kBody, 0.2, 5.0, true, Bounds::kTimesScene},
    KindTraits{K::kInertia, "inertia", "times the scene's", Target::kBody, 0.3, 3.0, true},
    KindTraits{K::kCenterX, "com_x", "m", Target::kBody, -0.1, 0.1, false, Bounds::kAroundScene},
    KindTraits{K::kCenterY, "com_y", "m", Target::kBody, -0.1, 0.1, false, Bounds::kAroundScene},
    KindTraits{K::kCenterZ, "com_z", "m", Target::kBody, -0.1, 0.1, false, Bounds::kAroundScene},
    KindTraits{K::kShearXY, "shear_xy", "-", Target::kBody, -1.0, 1.0},
    KindTraits{K::kShearXZ, "shear_xz", "-", Target::kBody, -1.0, 1.0},
    KindTraits{K::kShearYZ, "shear_yz", "-", Target::kBody, -1.0, 1.0},
    KindTraits{K::kSpreadX, "spread_x", "times the scene's", Target::kBody, 0.3, 3.0, true},
    KindTraits{K::kSpreadY, "spread_y", "times the scene's", Target::kBody, 0.3, 3.0, true},
    KindTraits{K::kSpreadZ, "spread_z", "times the scene's", Target::kBody, 0.3, 3.0, true},
    KindTraits{K::kSize, "size", "times the scene's", Target::kBody, 0.8, 1.25, true},
    KindTraits{K::kDamping, "damping", "N s/m|N m s/rad", Target::kCoordinates, 0.0, 20.0},
    KindTraits{K::kDryFriction, "dry_friction", "N|N m", Target::kCoordinates, 0.0, 50.0},
    KindTraits{K::kArmature, "armature", "kg|kg m^2", Target::kCoordinates, 0.0, 10.0},
    KindTraits{K::kForceOffset, "force_offset", "N|N m", Target::kChannel, -20.0, 20.0},
    KindTraits{K::kForceGain, "force_gain", "-", Target::kChannel, 0.5, 2.0, true},
    KindTraits{K::kForceDelay, "force_delay", "s", Target::kChannel, -0.05, 0.05},
    KindTraits{K::kGravity, "gravity", "m/s^2", Target::kNone, 0.7, 1.3, false,
               Bounds::kTimesScene},
    KindTraits{K::kHeight, "height", "m above the scene's", Target::kGround, -0.02, 0.02},
    KindTraits{K::kCompliance, "compliance", "-", Target::kNone, 1e-8, 0.1, true},
    KindTraits{K::kSmoothing, "smoothing", "m", Target::kNone, 1e-14, 1e-3, true},
    KindTraits{K::kStabilization, "stabilization", "-", Target::kNone, 0.0, 1.0},
    KindTraits{K::kMaxRecoverySpeed, "max_recovery_speed", "m/s", Target::kNone, 0.0, 5.0},
};

std::vector<std::string> links(const Model& model) {
  std::vector<std::string> names;
  for (const JointInfo& joint : model.joints()) names.push_back(joint.link);
  return names;
}

/// Throws the error "'element' is no KINDS are NAMES"; kinds: such as "joint; joints".
[[noreturn]] void refuse(const std::string& element, const char* kinds,
                         const std::vector<std::string>& names) {
  throw InputError(fmt::format("'{}' is no {} are {}", element, kinds,
                               names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

std::vector<int> geometries_named(const Model& model, const std::string& element) {
  std::vector<int> found;
  std::vector<std::string> names;
  const int frame = model.find_frame(element);
  for (int i = 0; i < static_cast<int>(model.geometries().size()); ++i) {
    const Geometry& g = model.geometries()[i];
    names.push_back(g.name);
    if (element.empty() || g.name == element || (frame >= 0 && g.frame == frame))
      found.push_back(i);
  }
  if (found.empty()) refuse(element, "geometry and no link with one; geometries", names);
  return found;
}

std::vector<int> body_named(const Model& model, const std::string& element) {
  const std::vector<std::string> names = links(model);
  if (element.empty() && names.size() == 1) return {1};
  for (size_t i = 0; i < names.size(); ++i)
    if (names[i] == element) return {static_cast<int>(i) + 1};
  throw InputError(fmt::format("expected KIND:LINK with one of the links {}; there is '{}'",
                               fmt::join(names, ", "), element));
}

std::vector<int> coordinates_named(const Model& model, const std::string& element) {
  std::vector<int> found;
  std::vector<std::string> names;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (body.joint_type == JointType::kFloating) continue;
    names.push_back(model.joint(i - 1).name);
    if (!element.empty() && element != names.back()) continue;
    for (int k = 0; k < joint_nv(body.joint_type); ++k) found.push_back(body.v_index + k);
  }
  if (found.empty()) refuse(element, "joint; joints", names);
  return found;
}

std::vector<int> ground_named(const Model& model, const std::string& element) {
  std::vector<int> found = geometries_named(model, element.empty() ? "ground" : element);
  for (const int i : found) {
    if (model.geometries()[i].body != 0)
      throw InputError(fmt::format("'{}' moves; 'height' is of what is fixed to the world",
                                   model.geometries()[i].name));
  }
  return found;
}

int axis_of(ParameterKind kind) {
  if (kind == K::kCenterX || kind == K::kSpreadX) return 0;
  return kind == K::kCenterY || kind == K::kSpreadY ? 1 : 2;
}

/// The deformation of a body about its centre of mass, in body axes. It maps the second moments of
/// its mass S to A S A', so that bodies stay physical (Rucker and Wensing, "Smooth Parameterization
/// of Rigid-Body Inertia", RA-L 2022: A is upper triangular there, too).
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

void set_geometry(ParameterKind kind, int target, double value, const Model& model,
                  ModelEditor& editor) {
  const Geometry& g = model.geometries()[target];
  Material material = g.material;
  Pose pose = g.X_BG;
  switch (kind) {
    case K::kFriction:
      material.friction = value;
      break;
    case K::kRestitution:
      material.restitution = value;
      break;
    case K::kStaticFriction:
      material.static_friction = value;
      break;
    case K::kStiffness:
      material.stiffness = value;
      break;
    case K::kTorsionalFriction:
      material.torsional_friction = value;
      break;
    case K::kRollingFriction:
      material.rolling_friction = value;
      break;
    default:
      pose.translation += value * pose.rotation.col(2);
  }
  editor.set_material(target, material);
  editor.set_pose(target, pose);
}

void check_option(double value, double low, double high, const char* name) {
  if (value >= low && value <= high) return;
  throw InputError(fmt::format("{}: {:.6g}; expected {:g} to {:g}", name, value, low, high));
}

}  // namespace

const KindTraits& kind_named(const std::string& name) {
  std::vector<std::string> names;
  for (const KindTraits& kind : kKinds) {
    if (name == kind.name) return kind;
    names.emplace_back(kind.name);
  }
  throw InputError(fmt::format("parameter '{}': expected one of {}", name, fmt::join(names, ", ")));
}

const KindTraits& kind_of(ParameterKind kind) {
  return *std::find_if(kKinds.begin(), kKinds.end(),
                       [&](const KindTraits& k) { return k.kind == kind; });
}

std::vector<int> targets_of(const KindTraits& kind, const std::string& element,
                            const Model& model) {
  switch (kind.target) {
    case Target::kGeometries:
      return geometries_named(model, element);
    case Target::kBody:
      return body_named(model, element);
    case Target::kCoordinates:
      return coordinates_named(model, element);
    case Target::kChannel:
      if (element.empty()) throw InputError("is of one joint: expected KIND:JOINT");
      return coordinates_named(model, element);
    case Target::kGround:
      return ground_named(model, element);
    case Target::kNone:
      if (!element.empty()) throw InputError("is of the whole scene: expected no ':ELEMENT'");
      return {};
  }
  return {};
}

bool is_inertial(ParameterKind kind) {
  switch (kind) {
    case K::kMass:
    case K::kInertia:
    case K::kCenterX:
    case K::kCenterY:
    case K::kCenterZ:
    case K::kShearXY:
    case K::kShearXZ:
    case K::kShearYZ:
    case K::kSpreadX:
    case K::kSpreadY:
    case K::kSpreadZ:
      return true;
    default:
      return false;
  }
}

bool has_sign(ParameterKind kind) {
  switch (kind) {
    case K::kCenterX:
    case K::kCenterY:
    case K::kCenterZ:
    case K::kShearXY:
    case K::kShearXZ:
    case K::kShearYZ:
    case K::kForceOffset:
    case K::kHeight:
      return true;
    default:
      return false;
  }
}

SpatialInertia with_value(ParameterKind kind, double value, const SpatialInertia& inertia) {
  SpatialInertia out = inertia;
  if (kind == K::kMass) {
    if (inertia.mass > 0.0) out.rotational *= value / inertia.mass;
    out.mass = value;
  } else if (kind == K::kInertia) {
    out.rotational *= value;
  } else if (kind == K::kSize) {
    out.center *= value;
    out.rotational *= value * value;
  } else if (kind == K::kCenterX || kind == K::kCenterY || kind == K::kCenterZ) {
    out.center[axis_of(kind)] = value;
  } else {
    const Matrix3 A = deformation(kind, value);
    const Matrix3& I = inertia.rotational;
    const Matrix3 moments = A * (0.5 * I.trace() * Matrix3::Identity() - I) * A.transpose();
    out.rotational = moments.trace() * Matrix3::Identity() - moments;
  }
  return out;
}

double value_at(ParameterKind kind, const Scene& scene, int target) {
  const Model& model = scene.model;
  switch (kind) {
    case K::kFriction:
      return model.geometries()[target].material.friction;
    case K::kRestitution:
      return model.geometries()[target].material.restitution;
    case K::kTorsionalFriction:
      return model.geometries()[target].material.torsional_friction;
    case K::kRollingFriction:
      return model.geometries()[target].material.rolling_friction;
    case K::kStaticFriction:
      return model.geometries()[target].material.static_friction;
    case K::kStiffness:
      return model.geometries()[target].material.stiffness;
    case K::kMass:
      return model.body(target).inertia.mass;
    case K::kCenterX:
    case K::kCenterY:
    case K::kCenterZ:
      return model.body(target).inertia.center[axis_of(kind)];
    case K::kInertia:
    case K::kSpreadX:
    case K::kSpreadY:
    case K::kSpreadZ:
    case K::kSize:
    case K::kForceGain:
      return 1.0;
    case K::kShearXY:
    case K::kShearXZ:
    case K::kShearYZ:
    case K::kForceOffset:
    case K::kForceDelay:
      return 0.0;
    case K::kDamping:
      return model.damping()[target];
    case K::kDryFriction:
      return model.dry_friction()[target];
    case K::kArmature:
      return model.armature()[target];
    case K::kGravity:
      return model.gravity().norm();
    case K::kHeight:
      return 0.0;
    case K::kCompliance:
      return scene.options.contact.compliance;
    case K::kSmoothing:
      return scene.options.contact.smoothing;
    case K::kStabilization:
      return scene.options.contact.stabilization;
    case K::kMaxRecoverySpeed:
      return scene.options.contact.max_recovery_speed;
  }
  return 0.0;
}

void set_target(ParameterKind kind, int target, double value, const Model& model,
                ModelEditor& editor) {
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
    case K::kArmature:
      return editor.set_armature(target, value);
    default:
      if (is_inertial(kind))
        return editor.set_inertia(target, with_value(kind, value, model.body(target).inertia));
      return set_geometry(kind, target, value, model, editor);
  }
}

bool set_scene(ParameterKind kind, double value, Model& model, SimulationOptions& options) {
  ContactOptions& contact = options.contact;
  switch (kind) {
    case K::kGravity: {
      const Vector3 down = model.gravity().normalized();
      check_option(value, 0.0, 1e6, "gravity");
      if (down.isZero()) throw InputError("gravity: the scene has none, hence no direction");
      ModelEditor editor(std::move(model));
      editor.set_gravity(value * down);
      model = editor.take();
      return true;
    }
    case K::kCompliance:
      check_option(value, 1e-15, 1e6, "compliance");
      contact.compliance = value;
      return true;
    case K::kSmoothing:
      check_option(value, 0.0, 1e6, "smoothing");
      contact.smoothing = value;
      return true;
    case K::kStabilization:
      check_option(value, 0.0, 1.0, "stabilization");
      contact.stabilization = value;
      return true;
    case K::kMaxRecoverySpeed:
      check_option(value, 0.0, 1e6, "max_recovery_speed");
      contact.max_recovery_speed = value;
      return true;
    default:
      return false;
  }
}

}  // namespace counterpoint::estimation
