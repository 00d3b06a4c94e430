#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <tuple>
#include <utility>

#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"
#include "counterpoint/engine/estimate/parameters/parameter_parts.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint::estimation {
namespace {

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

/// Appends the targets of an element, and their signs if any element of the part is mirrored.
void add_targets(const ParameterPart& part, const KindTraits& kind, const NamedElement& element,
                 const Model& model, Parameter& p) {
  std::vector<int> targets;
  try {
    targets = targets_of(kind, element.name, model);
  } catch (const InputError& error) {
    part.fail(error.what());
  }
  for (const int target : targets) {
    if (p.sign_of(target) != 0.0)
      part.fail(fmt::format("'{}' shares the value already", element.name));
    p.targets.push_back(target);
    p.signs.push_back(element.mirrored ? -1.0 : 1.0);
  }
}

/// Returns the parameter with its targets and the default bounds.
Parameter parameter_of(const ParameterPart& part, const Scene& scene) {
  const KindTraits& kind = kind_named(part.kind);
  Parameter p;
  p.kind = kind.kind;
  p.name = part.name();
  p.unit = kind.unit;
  p.lower = kind.lower;
  p.upper = kind.upper;
  p.logarithmic = kind.logarithmic;
  for (const NamedElement& element : part.elements) {
    if (element.mirrored && !has_sign(kind.kind))
      part.fail(
          fmt::format("'~' takes the negative value, and {} has no sign; it is for com_*, "
                      "shear_*, force_offset and height",
                      kind.name));
    add_targets(part, kind, element, scene.model, p);
  }
  if (part.elements.empty()) add_targets(part, kind, {}, scene.model, p);
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

/// Sets the deviation of the prior about the scene's value.
void set_prior(const ParameterPart& part, const Scene& scene, Parameter& p) {
  if (!part.deviation) return;
  const double value = parameter_values({p}, scene)[0];
  if (value < p.lower || value > p.upper)
    part.fail(
        fmt::format("the prior is about the scene's value {:g}; expected bounds around it, "
                    "not {:g} and {:g}",
                    value, p.lower, p.upper));
  p.deviation = part.deviation->value * (part.deviation->percent ? 0.01 * std::abs(value) : 1.0);
  if (!(*p.deviation > 0.0))
    part.fail(
        fmt::format("the scene's value is 0, which has no percent; expected a standard "
                    "deviation [{}]",
                    p.unit));
}

/// Refuses a target that two parameters of a kind would set, one of them as a tie.
void check_ties(const ParameterPart& part, const Parameter& p, bool tied, const Parameter& other,
                bool other_tied) {
  if (p.kind != other.kind || !(tied || other_tied)) return;
  for (const int target : p.targets)
    if (other.sign_of(target) != 0.0)
      part.fail(fmt::format("'{}' and '{}' set the same element", other.name, p.name));
}

}  // namespace

double Parameter::sign_of(int target) const {
  for (std::size_t i = 0; i < targets.size(); ++i)
    if (targets[i] == target) return sign(i);
  return 0.0;
}

std::vector<Parameter> parse_parameters(const std::string& text, const Scene& scene) {
  std::vector<Parameter> parameters;
  std::vector<char> tied;
  for (const ParameterPart& part : parameter_parts(text, scene.model)) {
    Parameter p = parameter_of(part, scene);
    if (part.bounds) std::tie(p.lower, p.upper) = *part.bounds;
    if (!(p.lower < p.upper))
      part.fail(
          fmt::format("lower bound {:g} is not below {:g}; give NAME=LOW..HIGH", p.lower, p.upper));
    if (p.logarithmic && !(p.lower > 0.0)) part.fail("the lower bound must be positive");
    set_prior(part, scene, p);
    tied.push_back(part.elements.size() > 1);
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      if (parameters[i].name == p.name) part.fail(fmt::format("'{}' is given twice", p.name));
      check_ties(part, p, tied.back(), parameters[i], tied[i]);
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
    for (std::size_t k = 0; k < p.targets.size(); ++k)
      sum += p.sign(k) * value_at(p.kind, scene, p.targets[k]);
    values[static_cast<Eigen::Index>(i)] =
        sum / static_cast<double>(std::max<size_t>(p.targets.size(), 1));
  }
  return values;
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
  for (const std::string& part :
       text[0] == '@' ? lines_of(text.substr(1)) : split_text(text, ',')) {
    const size_t equals = part.find('=');
    if (equals == std::string::npos)
      throw InputError(fmt::format("'{}': expected NAME=VALUE", part));
    const Parameter p = parameter_of(part_named(part.substr(0, equals), scene.model), scene);
    const double value = finite_number(part.substr(equals + 1), fmt::format("'{}'", part));
    scene = with_parameters(scene, {p}, VectorX::Constant(1, value));
  }
  return scene;
}

}  // namespace counterpoint::estimation
