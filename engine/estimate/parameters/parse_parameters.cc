#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <optional>
#include <utility>

#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"
#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::estimation {
namespace {

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// Lines of a file without comments, blanks and empty lines.
std::vector<std::string> lines_of(const std::string& file) {
  std::ifstream stream(file);
  if (!stream) throw InputError(file + ": cannot be read; expected a file of settings after '@'");
  std::vector<std::string> out;
  for (std::string line; std::getline(stream, line);) {
    line = line.substr(0, line.find('#'));
    std::erase_if(line, [](unsigned char c) { return std::isspace(c) != 0; });
    if (!line.empty()) out.push_back(line);
  }
  return out;
}

double number(const std::string& text, const std::string& where) {
  const std::optional<double> value = parse_number(text);
  if (!value || !std::isfinite(*value))
    throw InputError(fmt::format("'{}': '{}' is no finite number", where, text));
  return *value;
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
  const double value = parameter_values({p}, scene)[0];
  if (kind.bounds == Bounds::kTimesScene) {
    p.lower *= value;
    p.upper *= value;
  } else if (kind.bounds == Bounds::kAroundScene) {
    p.lower += value;
    p.upper += value;
  }
  return p;
}

/// The ten parameters that make up `inertial`. Shears come first: spreads commute then.
constexpr std::array kInertialGroup = {"mass",     "com_x",    "com_y",    "com_z",    "shear_xy",
                                       "shear_xz", "shear_yz", "spread_x", "spread_y", "spread_z"};

/// Names of the elements that `KIND:*` stands for.
std::vector<std::string> elements(const std::string& kind, const Model& model) {
  const bool joints = kind != "inertial" && (kind_named(kind).target == Target::kCoordinates ||
                                             kind_named(kind).target == Target::kChannel);
  std::vector<std::string> out;
  if (kind != "inertial" && !joints && kind_named(kind).target != Target::kBody) return out;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const JointInfo& joint = model.joint(i - 1);
    if (joints && model.body(i).joint_type == JointType::kFloating) continue;
    if (!joints && !(model.body(i).inertia.mass > 0.0)) continue;
    out.push_back(joints ? joint.name : joint.link);
  }
  return out;
}

/// Splits a list of parameters, with `KIND:*` as one parameter for each link or joint, and
/// `inertial` as the ten of a link.
std::vector<std::string> expanded(const std::string& text, const Model& model) {
  std::vector<std::string> out;
  for (const std::string& part : split(text)) {
    const size_t equals = std::min(part.find('='), part.size());
    const std::string name = part.substr(0, equals), bounds = part.substr(equals);
    const size_t colon = std::min(name.find(':'), name.size());
    const std::string kind = name.substr(0, colon);
    std::vector<std::string> each = {name.substr(std::min(colon + 1, name.size()))};
    const bool whole_kind = each[0] == "*";
    if (whole_kind) each = elements(kind, model);
    if (whole_kind && each.empty())
      throw InputError(
          fmt::format("parameter '{}': '*' stands for all links or joints; there are "
                      "none for this kind",
                      part));
    if (kind == "inertial" && !bounds.empty())
      throw InputError(
          fmt::format("parameter '{}': 'inertial' has no bounds of its own; name the "
                      "parameters: {}",
                      part, fmt::join(kInertialGroup, ", ")));
    for (const std::string& element : each) {
      const std::string of = element.empty() ? "" : ":" + element;
      if (kind != "inertial")
        out.push_back(kind + of + bounds);
      else
        for (const char* one : kInertialGroup) out.push_back(one + of);
    }
  }
  return out;
}

}  // namespace

std::vector<Parameter> parse_parameters(const std::string& text, const Scene& scene) {
  std::vector<Parameter> parameters;
  for (const std::string& part : expanded(text, scene.model)) {
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
    double sum = p.targets.empty() ? value_at(p.kind, scene, 0) : 0.0;
    for (const int target : p.targets) sum += value_at(p.kind, scene, target);
    values[static_cast<Eigen::Index>(i)] =
        sum / static_cast<double>(std::max<size_t>(p.targets.size(), 1));
  }
  return values;
}

void set_parameter(const Parameter& parameter, double value, Model& model,
                   SimulationOptions& options) {
  if (set_scene(parameter.kind, value, model, options)) return;
  for (const int target : parameter.targets) {
    ModelEditor editor(model);
    set_target(parameter.kind, target, value, model, editor);
    model = editor.take();
  }
}

Scene with_parameters(const Scene& scene, const std::vector<Parameter>& parameters,
                      const VectorX& values) {
  Scene out = scene;
  for (size_t i = 0; i < parameters.size(); ++i)
    set_parameter(parameters[i], values[static_cast<Eigen::Index>(i)], out.model, out.options);
  return out;
}

Scene with_settings(Scene scene, const std::string& text) {
  if (text.empty()) return scene;
  for (const std::string& part : text[0] == '@' ? lines_of(text.substr(1)) : split(text)) {
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
