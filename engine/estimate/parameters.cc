#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::estimation {
namespace {

enum class Target { kGeometries, kBody, kCoordinates, kGround, kNone };

struct KindTraits {
  ParameterKind kind;
  const char* name;
  const char* unit;
  Target target;
  double lower, upper;  ///< default bounds
  bool logarithmic;
  bool relative;  ///< bounds are multiples of the scene's value
};

using K = ParameterKind;
constexpr std::array kKinds = {
    KindTraits{K::kFriction, "friction", "-", Target::kGeometries, 0.01, 1.5, false, false},
    KindTraits{K::kRestitution, "restitution", "-", Target::kGeometries, 0.0, 0.95, false, false},
    KindTraits{K::kTorsionalFriction, "torsional_friction", "m", Target::kGeometries, 0.0, 0.05,
               false, false},
    KindTraits{K::kRollingFriction, "rolling_friction", "m", Target::kGeometries, 0.0, 0.05, false,
               false},
    KindTraits{K::kMass, "mass", "kg", Target::kBody, 0.2, 5.0, true, true},
    KindTraits{K::kInertia, "inertia", "times the scene's", Target::kBody, 0.3, 3.0, true, false},
    KindTraits{K::kSize, "size", "times the scene's", Target::kBody, 0.8, 1.25, true, false},
    KindTraits{K::kDamping, "damping", "N s/m|N m s/rad", Target::kCoordinates, 0.0, 20.0, false,
               false},
    KindTraits{K::kDryFriction, "dry_friction", "N|N m", Target::kCoordinates, 0.0, 50.0, false,
               false},
    KindTraits{K::kArmature, "armature", "kg|kg m^2", Target::kCoordinates, 0.0, 10.0, false,
               false},
    KindTraits{K::kGravity, "gravity", "m/s^2", Target::kNone, 0.7, 1.3, false, true},
    KindTraits{K::kHeight, "height", "m above the scene's", Target::kGround, -0.02, 0.02, false,
               false},
    KindTraits{K::kCompliance, "compliance", "-", Target::kNone, 1e-8, 0.1, true, false},
    KindTraits{K::kSmoothing, "smoothing", "m", Target::kNone, 1e-14, 1e-3, true, false},
    KindTraits{K::kStabilization, "stabilization", "-", Target::kNone, 0.0, 1.0, false, false},
    KindTraits{K::kMaxRecoverySpeed, "max_recovery_speed", "m/s", Target::kNone, 0.0, 5.0, false,
               false},
};

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

std::vector<int> targets_of(const KindTraits& kind, const std::string& element,
                            const Model& model) {
  switch (kind.target) {
    case Target::kGeometries:
      return geometries_named(model, element);
    case Target::kBody:
      return body_named(model, element);
    case Target::kCoordinates:
      return coordinates_named(model, element);
    case Target::kGround:
      return ground_named(model, element);
    case Target::kNone:
      if (!element.empty()) throw InputError("is of the whole scene: expected no ':ELEMENT'");
      return {};
  }
  return {};
}

double number(const std::string& text, const std::string& where) {
  const std::optional<double> value = parse_number(text);
  if (!value || !std::isfinite(*value))
    throw InputError(fmt::format("'{}': '{}' is no finite number", where, text));
  return *value;
}

double value_at(const Parameter& p, const Scene& scene, int target) {
  const Model& model = scene.model;
  switch (p.kind) {
    case K::kFriction:
      return model.geometries()[target].material.friction;
    case K::kRestitution:
      return model.geometries()[target].material.restitution;
    case K::kTorsionalFriction:
      return model.geometries()[target].material.torsional_friction;
    case K::kRollingFriction:
      return model.geometries()[target].material.rolling_friction;
    case K::kMass:
      return model.body(target).inertia.mass;
    case K::kInertia:
    case K::kSize:
      return 1.0;
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

void set_target(ParameterKind kind, int target, double value, const Model& model,
                ModelEditor& editor) {
  switch (kind) {
    case K::kMass:
      return editor.set_mass(target, value);
    case K::kInertia:
      return editor.scale_inertia(target, value);
    case K::kSize:
      return editor.scale_size(target, value);
    case K::kDamping:
      return editor.set_damping(target, value);
    case K::kDryFriction:
      return editor.set_dry_friction(target, value);
    case K::kArmature:
      return editor.set_armature(target, value);
    default:
      return set_geometry(kind, target, value, model, editor);
  }
}

void check_option(double value, double low, double high, const char* name) {
  if (value >= low && value <= high) return;
  throw InputError(fmt::format("{}: {:.6g}; expected {:g} to {:g}", name, value, low, high));
}

/// Sets a parameter of the whole scene. Returns false for kinds with targets.
bool set_scene(ParameterKind kind, double value, Scene& scene) {
  ContactOptions& contact = scene.options.contact;
  switch (kind) {
    case K::kGravity: {
      const Vector3 down = scene.model.gravity().normalized();
      check_option(value, 0.0, 1e6, "gravity");
      if (down.isZero()) throw InputError("gravity: the scene has none, hence no direction");
      ModelEditor editor(std::move(scene.model));
      editor.set_gravity(value * down);
      scene.model = editor.take();
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

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// Parses KIND[:ELEMENT], with the default bounds.
Parameter named(const std::string& text, const Scene& scene) {
  const size_t colon = text.find(':');
  const KindTraits& kind = kind_named(text.substr(0, colon));
  Parameter p;
  p.kind = kind.kind;
  p.name = text;
  p.unit = kind.unit;
  p.lower = kind.lower;
  p.upper = kind.upper;
  p.logarithmic = kind.logarithmic;
  try {
    p.targets =
        targets_of(kind, colon == std::string::npos ? "" : text.substr(colon + 1), scene.model);
  } catch (const InputError& error) {
    throw InputError(fmt::format("parameter '{}': {}", text, error.what()));
  }
  if (kind.relative) {
    const double value = parameter_values({p}, scene)[0];
    p.lower *= value;
    p.upper *= value;
  }
  return p;
}

}  // namespace

std::vector<Parameter> parse_parameters(const std::string& text, const Scene& scene) {
  std::vector<Parameter> parameters;
  for (const std::string& part : split(text)) {
    const size_t equals = part.find('=');
    Parameter p = named(part.substr(0, equals), scene);
    if (equals != std::string::npos) {
      const std::string bounds = part.substr(equals + 1);
      const size_t dots = bounds.find("..");
      if (dots == std::string::npos)
        throw InputError(fmt::format("parameter '{}': expected NAME=LOW..HIGH", part));
      p.lower = number(bounds.substr(0, dots), part);
      p.upper = number(bounds.substr(dots + 2), part);
    }
    if (!(p.lower < p.upper))
      throw InputError(
          fmt::format("parameter '{}': lower bound {:g} is not below {:g}; give "
                      "NAME=LOW..HIGH",
                      part, p.lower, p.upper));
    if (p.logarithmic && !(p.lower > 0.0))
      throw InputError(fmt::format("parameter '{}': the lower bound must be positive", part));
    for (const Parameter& other : parameters) {
      if (other.name == p.name)
        throw InputError(fmt::format("parameter '{}' is given twice", part));
    }
    // Check here, rather than in the middle of a fit, that the bounds make valid scenes.
    for (const double bound : {p.lower, p.upper})
      with_parameters(scene, {p}, VectorX::Constant(1, bound));
    parameters.push_back(std::move(p));
  }
  return parameters;
}

VectorX parameter_values(const std::vector<Parameter>& parameters, const Scene& scene) {
  VectorX values(static_cast<Eigen::Index>(parameters.size()));
  for (size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    double sum = p.targets.empty() ? value_at(p, scene, 0) : 0.0;
    for (const int target : p.targets) sum += value_at(p, scene, target);
    values[static_cast<Eigen::Index>(i)] =
        sum / static_cast<double>(std::max<size_t>(p.targets.size(), 1));
  }
  return values;
}

Scene with_parameters(const Scene& scene, const std::vector<Parameter>& parameters,
                      const VectorX& values) {
  Scene out = scene;
  for (size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    const double value = values[static_cast<Eigen::Index>(i)];
    if (set_scene(kind_of(p.kind).kind, value, out)) continue;
    for (const int target : p.targets) {
      ModelEditor editor(out.model);
      set_target(p.kind, target, value, out.model, editor);
      out.model = editor.take();
    }
  }
  return out;
}

Scene with_settings(Scene scene, const std::string& text) {
  if (text.empty()) return scene;
  for (const std::string& part : split(text)) {
    const size_t equals = part.find('=');
    if (equals == std::string::npos)
      throw InputError(fmt::format("'{}': expected NAME=VALUE", part));
    const Parameter p = named(part.substr(0, equals), scene);
    scene =
        with_parameters(scene, {p}, VectorX::Constant(1, number(part.substr(equals + 1), part)));
  }
  return scene;
}

}  // namespace counterpoint::estimation
