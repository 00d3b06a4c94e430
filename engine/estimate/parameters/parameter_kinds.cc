#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace counterpoint::estimation {
namespace {

using K = ParameterKind;

constexpr std::array kKinds = {
    KindTraits{K::kFriction, "friction", "-", Target::kGeometries, 0.01, 1.5, false,
               Bounds::kValues, &Material::friction},
    KindTraits{K::kStaticFriction, "static_friction", "-", Target::kGeometries, 0.01, 2.0, false,
               Bounds::kValues, &Material::static_friction},
    KindTraits{K::kRestitution, "restitution", "-", Target::kGeometries, 0.0, 0.95, false,
               Bounds::kValues, &Material::restitution},
    KindTraits{K::kTorsionalFriction, "torsional_friction", "m", Target::kGeometries, 0.0, 0.05,
               false, Bounds::kValues, &Material::torsional_friction},
    KindTraits{K::kRollingFriction, "rolling_friction", "m", Target::kGeometries, 0.0, 0.05, false,
               Bounds::kValues, &Material::rolling_friction},
    KindTraits{K::kStiffness, "stiffness", "N/m", Target::kGeometries, 1e3, 1e7, true,
               Bounds::kValues, &Material::stiffness},
    KindTraits{K::kPlaceX, "place_x", "m from the scene's", Target::kGeometries, -0.02, 0.02},
    KindTraits{K::kPlaceY, "place_y", "m from the scene's", Target::kGeometries, -0.02, 0.02},
    KindTraits{K::kPlaceZ, "place_z", "m from the scene's", Target::kGeometries, -0.02, 0.02},
    KindTraits{K::kTiltX, "tilt_x", "rad from the scene's", Target::kGeometries, -0.1, 0.1},
    KindTraits{K::kTiltY, "tilt_y", "rad from the scene's", Target::kGeometries, -0.1, 0.1},
    KindTraits{K::kTiltZ, "tilt_z", "rad from the scene's", Target::kGeometries, -0.1, 0.1},
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
    KindTraits{K::kBreakawayFriction, "breakaway_friction", "N|N m", Target::kCoordinates, 0.0,
               50.0},
    KindTraits{K::kStribeckSpeed, "stribeck_speed", "m/s|rad/s", Target::kCoordinates, 1e-3, 1.0,
               true},
    KindTraits{K::kArmature, "armature", "kg|kg m^2", Target::kCoordinates, 0.0, 10.0},
    KindTraits{K::kSpringStiffness, "spring_stiffness", "N/m|N m/rad", Target::kSprings, 0.2, 5.0,
               true, Bounds::kTimesScene, &JointSpring::stiffness},
    KindTraits{K::kSpringReference, "spring_reference", "m|rad", Target::kSprings, -0.5, 0.5, false,
               Bounds::kAroundScene, &JointSpring::reference},
    KindTraits{K::kServoStiffness, "servo_stiffness", "N/m|N m/rad", Target::kServos, 0.2, 5.0,
               true, Bounds::kTimesScene, &JointServo::stiffness},
    KindTraits{K::kServoDamping, "servo_damping", "N s/m|N m s/rad", Target::kServos, 0.2, 5.0,
               true, Bounds::kTimesScene, &JointServo::damping},
    KindTraits{K::kGear, "gear", "-|rad/m", Target::kActuators, 0.2, 5.0, true, Bounds::kTimesScene,
               &Actuator::gear},
    KindTraits{K::kGain, "gain", "N|N m per unit", Target::kActuators, 0.2, 5.0, true,
               Bounds::kTimesScene, &Actuator::gain},
    KindTraits{K::kTorqueConstant, "torque_constant", "N m/A", Target::kActuators, 0.2, 5.0, true,
               Bounds::kTimesScene, &Actuator::torque_constant},
    KindTraits{K::kResistance, "resistance", "Ohm", Target::kActuators, 0.2, 5.0, true,
               Bounds::kTimesScene, &Actuator::resistance},
    KindTraits{K::kJointX, "joint_x", "m from the scene's", Target::kJoints, -0.05, 0.05},
    KindTraits{K::kJointY, "joint_y", "m from the scene's", Target::kJoints, -0.05, 0.05},
    KindTraits{K::kJointZ, "joint_z", "m from the scene's", Target::kJoints, -0.05, 0.05},
    KindTraits{K::kJointZero, "joint_zero", "m|rad from the scene's", Target::kJoints, -0.1, 0.1},
    KindTraits{K::kForceOffset, "force_offset", "N|N m", Target::kChannel, -20.0, 20.0},
    KindTraits{K::kForceGain, "force_gain", "-", Target::kChannel, 0.5, 2.0, true},
    KindTraits{K::kForceDelay, "force_delay", "s", Target::kChannel, -0.05, 0.05},
    KindTraits{K::kGravity, "gravity", "m/s^2", Target::kNone, 0.7, 1.3, false,
               Bounds::kTimesScene},
    KindTraits{K::kHeight, "height", "m above the scene's", Target::kGround, -0.02, 0.02},
    KindTraits{K::kCompliance, "compliance", "-", Target::kNone, 1e-8, 0.1, true, Bounds::kValues,
               &ContactOptions::compliance},
    KindTraits{K::kSmoothing, "smoothing", "m", Target::kNone, 1e-14, 1e-3, true, Bounds::kValues,
               &ContactOptions::smoothing},
    KindTraits{K::kStabilization, "stabilization", "-", Target::kNone, 0.0, 1.0, false,
               Bounds::kValues, &ContactOptions::stabilization},
    KindTraits{K::kMaxRecoverySpeed, "max_recovery_speed", "m/s", Target::kNone, 0.0, 5.0, false,
               Bounds::kValues, &ContactOptions::max_recovery_speed},
};

/// Throws the error "'element' is no KINDS are NAMES"; kinds: such as "joint; joints".
[[noreturn]] void refuse(const std::string& element, const char* kinds,
                         const std::vector<NamedTargets>& all) {
  std::vector<std::string> names;
  for (const NamedTargets& one : all) names.push_back(one.name);
  throw InputError(fmt::format("'{}' is no {} are {}", element, kinds,
                               names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

[[noreturn]] void refuse_link(const std::string& element, const std::vector<NamedTargets>& all) {
  std::vector<std::string> names;
  for (const NamedTargets& one : all) names.push_back(one.name);
  throw InputError(fmt::format("expected KIND:LINK with one of the links {}; there is '{}'",
                               fmt::join(names, ", "), element));
}

/// Describes the elements for an error: "joint; joints".
const char* words_of(Target target) {
  switch (target) {
    case Target::kGeometries:
    case Target::kGround:
      return "geometry and no link with one; geometries";
    case Target::kSprings:
      return "joint with a spring; those with one";
    case Target::kServos:
      return "joint with a servo; those with one";
    case Target::kActuators:
      return "actuator; actuators";
    default:
      return "joint; joints";
  }
}

/// Returns the targets if no element is named: all of the kind, or the only one.
std::vector<int> unnamed_targets(const KindTraits& kind, const std::vector<NamedTargets>& all) {
  const bool single = kind.target == Target::kBody || kind.target == Target::kActuators ||
                      kind.target == Target::kJoints || kind.target == Target::kChannel;
  if (kind.target == Target::kBody && all.size() != 1) refuse_link("", all);
  if (all.empty()) refuse("", words_of(kind.target), all);
  if (single && (all.size() > 1 || kind.target == Target::kChannel)) {
    std::vector<std::string> names;
    for (const NamedTargets& one : all) names.push_back(one.name);
    throw InputError(
        fmt::format("expected {}:ELEMENT with one of {}", kind.name, fmt::join(names, ", ")));
  }
  std::vector<int> out;
  for (const NamedTargets& one : all) out.insert(out.end(), one.targets.begin(), one.targets.end());
  return out;
}

/// Geometries of a name, or of a link.
std::vector<int> geometries_named(const Model& model, const std::string& element) {
  std::vector<int> found;
  const int frame = model.find_frame(element);
  for (int i = 0; i < static_cast<int>(model.geometries().size()); ++i) {
    const Geometry& g = model.geometries()[static_cast<std::size_t>(i)];
    if (g.name == element || (frame >= 0 && g.frame == frame)) found.push_back(i);
  }
  return found;
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

std::vector<NamedTargets> elements_of(Target target, const Model& model) {
  std::vector<NamedTargets> out;
  const auto joint_of = [&](int i) { return model.joint(i).name; };
  for (int i = 0; i < static_cast<int>(model.geometries().size()); ++i)
    if (target == Target::kGeometries || target == Target::kGround)
      out.push_back({model.geometries()[static_cast<std::size_t>(i)].name, {i}});
  for (int i = 0; i < static_cast<int>(model.springs().size()) && target == Target::kSprings; ++i)
    out.push_back({joint_of(model.springs()[static_cast<std::size_t>(i)].joint), {i}});
  for (int i = 0; i < static_cast<int>(model.servos().size()) && target == Target::kServos; ++i)
    out.push_back({joint_of(model.servos()[static_cast<std::size_t>(i)].joint), {i}});
  for (int i = 0; i < static_cast<int>(model.actuators().size()) && target == Target::kActuators;
       ++i)
    out.push_back({model.actuators()[static_cast<std::size_t>(i)].name, {i}});
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (target == Target::kBody) out.push_back({model.joint(i - 1).link, {i}});
    if (body.joint_type == JointType::kFloating) continue;
    if (target == Target::kJoints) out.push_back({joint_of(i - 1), {i}});
    if (target != Target::kCoordinates && target != Target::kChannel) continue;
    NamedTargets& joint = out.emplace_back(NamedTargets{joint_of(i - 1), {}});
    for (int k = 0; k < joint_nv(body.joint_type); ++k) joint.targets.push_back(body.v_index + k);
  }
  return out;
}

std::vector<int> targets_of(const KindTraits& kind, const std::string& element,
                            const Model& model) {
  if (kind.target == Target::kNone) {
    if (!element.empty()) throw InputError("is of the whole scene: expected no ':ELEMENT'");
    return {};
  }
  const std::vector<NamedTargets> all = elements_of(kind.target, model);
  std::vector<int> found;
  if (kind.target == Target::kGround) {
    found = geometries_named(model, element.empty() ? "ground" : element);
    for (const int i : found)
      if (const Geometry& g = model.geometries()[static_cast<std::size_t>(i)]; g.body != 0)
        throw InputError(
            fmt::format("'{}' moves; 'height' is of what is fixed to the world", g.name));
  } else if (element.empty()) {
    return unnamed_targets(kind, all);
  } else if (kind.target == Target::kGeometries) {
    found = geometries_named(model, element);
  } else {
    for (const NamedTargets& one : all)
      if (one.name == element) found = one.targets;
  }
  if (found.empty() && kind.target == Target::kBody) refuse_link(element, all);
  if (found.empty()) refuse(element, words_of(kind.target), all);
  return found;
}

bool is_inertial(ParameterKind kind) {
  return kind_of(kind).target == Target::kBody && kind != K::kSize;
}

bool has_sign(ParameterKind kind) {
  switch (kind) {
    case K::kCenterX:
    case K::kCenterY:
    case K::kCenterZ:
    case K::kShearXY:
    case K::kShearXZ:
    case K::kShearYZ:
    case K::kSpringReference:
    case K::kForceOffset:
    case K::kHeight:
      return true;
    default:
      return kind_of(kind).target == Target::kJoints ||
             (kind_of(kind).target == Target::kGeometries && kind_of(kind).field.index() == 0);
  }
}

}  // namespace counterpoint::estimation
