#include "counterpoint/engine/estimate/parameters/parameter_parts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::estimation {
namespace {

/// Elements that share a value, for each of several parameters.
using ElementSets = std::vector<std::vector<NamedElement>>;

constexpr const char* kInertial = "inertial";
/// The ten parameters that make up `inertial`. Shears come first: spreads commute then.
constexpr std::array kInertialGroup = {"mass",     "com_x",    "com_y",    "com_z",    "shear_xy",
                                       "shear_xz", "shear_yz", "spread_x", "spread_y", "spread_z"};

const KindTraits& traits_of(const std::string& kind) {
  return kind_named(kind == kInertial ? kInertialGroup[0] : kind);
}

bool exists(const std::string& kind, const std::string& element, const Model& model) {
  try {
    targets_of(traits_of(kind), element, model);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

/// Names of the elements that `KIND:*` stands for.
std::vector<std::string> each_of(const std::string& kind, const Model& model) {
  const Target target = traits_of(kind).target;
  std::vector<std::string> out;
  if (target == Target::kGeometries || target == Target::kGround) return out;
  for (const NamedTargets& one : elements_of(target, model)) {
    const int first = one.targets.front();
    if (target != Target::kBody || model.body(first).inertia.mass > 0.0) out.push_back(one.name);
  }
  return out;
}

/// Appends the parts that one stands for: each set of elements, and for `inertial` each of the ten.
void expand(const ParameterPart& given, const ElementSets& sets, std::vector<ParameterPart>& out) {
  const bool inertial = given.kind == kInertial;
  if (inertial && (given.bounds || given.deviation))
    given.fail(
        fmt::format("'inertial' has no bounds of its own, and no prior; name the "
                    "parameters: {}",
                    fmt::join(kInertialGroup, ", ")));
  std::vector<std::string> kinds{given.kind};
  if (inertial) kinds.assign(kInertialGroup.begin(), kInertialGroup.end());
  for (const std::vector<NamedElement>& elements : sets)
    for (const std::string& kind : kinds) {
      ParameterPart& part = out.emplace_back(given);
      part.kind = kind;
      part.elements = elements;
      if (sets.size() * kinds.size() > 1) part.where += fmt::format(": '{}'", part.name());
    }
}

ElementSets each_alone(const std::vector<std::string>& names) {
  ElementSets out;
  for (const std::string& name : names) out.push_back({{name}});
  return out;
}

ElementSets all_alone(const ParameterPart& part, const Model& model) {
  const std::vector<std::string> names = each_of(part.kind, model);
  if (names.empty()) part.fail("'*' stands for all links or joints; there are none for this kind");
  return each_alone(names);
}

/// Parses "0.5" or "10 %". Returns nothing if it is neither, or not positive and finite.
std::optional<StatedDeviation> deviation_in(std::string_view text) {
  StatedDeviation out;
  text = trimmed(text, " ");
  out.percent = text.ends_with('%');
  if (out.percent) text = trimmed(text.substr(0, text.size() - 1), " ");
  out.value = parse_number(text).value_or(0.0);
  if (!(out.value > 0.0) || !std::isfinite(out.value)) return std::nullopt;
  return out;
}

/// Finds the '~' before the deviation in KIND[:ELEMENTS]~DEVIATION; a '~' that begins an element,
/// or is in the name of one, is none.
size_t deviation_mark(const std::string& name, const Model& model) {
  const size_t mark = name.rfind('~'), colon = name.find(':');
  if (mark == std::string::npos || mark == 0 || name[mark - 1] == '+' || name[mark - 1] == ':')
    return std::string::npos;
  if (colon == std::string::npos || mark < colon) return mark;
  const std::string kind = name.substr(0, colon), all = name.substr(colon + 1);
  const std::string last = split_text(all, '+').back();
  return exists(kind, all, model) || exists(kind, last, model) ? std::string::npos : mark;
}

/// Parses one part of a text, whose element may be '*'.
ParameterPart text_part(const std::string& text, const Model& model) {
  const size_t equals = text.find('=');
  std::string name = text.substr(0, equals), bounds, deviation;
  std::string& last = equals == std::string::npos ? name : bounds;
  if (equals != std::string::npos) bounds = text.substr(equals + 1);
  const size_t mark = &last == &bounds ? bounds.rfind('~') : deviation_mark(name, model);
  const bool stated = mark != std::string::npos;
  if (stated) {
    deviation = last.substr(mark + 1);
    last.resize(mark);
  }
  ParameterPart part = part_named(name, model);
  part.where = fmt::format("parameter '{}'", text);
  if (equals != std::string::npos) {
    const size_t dots = bounds.find("..");
    if (dots == std::string::npos) part.fail("expected NAME=LOW..HIGH");
    part.bounds = {finite_number(bounds.substr(0, dots), part.where),
                   finite_number(bounds.substr(dots + 2), part.where)};
  }
  if (stated) {
    part.deviation = deviation_in(deviation);
    if (!part.deviation)
      part.fail(
          fmt::format("'{}' is no standard deviation; expected a positive number after '~', "
                      "such as ~0.1 or ~10%",
                      deviation));
  }
  return part;
}

std::vector<std::string> texts_of(const YamlValue& list) {
  std::vector<std::string> out;
  for (const YamlValue& one : list.list()) out.push_back(one.text());
  return out;
}

/// Reads one entry of a parameter file.
void read_entry(const YamlValue& entry, const Model& model, std::vector<ParameterPart>& out) {
  entry.expect_map({"kind", "element", "elements", "mirrored", "each", "between", "prior"});
  ParameterPart part;
  part.kind = entry.at("kind").text();
  part.where = entry.where();
  try {
    traits_of(part.kind);
  } catch (const InputError& error) {
    entry.at("kind").fail(error.what());
  }
  if (entry.has("element") + entry.has("elements") + entry.has("each") > 1)
    entry.fail("expected one of element, elements and each");
  if (entry.has("element")) part.elements.push_back({entry.at("element").text()});
  if (entry.has("elements"))
    for (const std::string& name : texts_of(entry.at("elements"))) part.elements.push_back({name});
  if (entry.has("mirrored")) {
    if (entry.has("each")) entry.at("mirrored").fail("expected without each: it ties elements");
    for (const std::string& name : texts_of(entry.at("mirrored")))
      part.elements.push_back({name, true});
  }
  if (entry.has("between")) {
    const std::vector<double> numbers = entry.at("between").numbers();
    if (numbers.size() != 2) entry.at("between").fail("expected [LOW, HIGH]");
    part.bounds = {numbers[0], numbers[1]};
  }
  if (entry.has("prior")) {
    part.deviation = deviation_in(entry.at("prior").text());
    if (!part.deviation)
      entry.at("prior").fail("expected a positive standard deviation, such as 0.1 or 10 %");
  }
  if (!entry.has("each")) return expand(part, {part.elements}, out);
  const YamlValue each = entry.at("each");
  expand(part, each.is_text("all") ? all_alone(part, model) : each_alone(texts_of(each)), out);
}

std::vector<ParameterPart> parts_in_file(const std::string& file, const Model& model) {
  const YamlValue root = YamlValue::load(file);
  root.expect_map({"parameters"});
  std::vector<ParameterPart> out;
  for (const YamlValue& entry : root.at("parameters").list()) read_entry(entry, model, out);
  if (out.empty()) root.at("parameters").fail("expected at least one parameter");
  return out;
}

}  // namespace

std::string ParameterPart::name() const {
  std::string out = kind;
  for (size_t i = 0; i < elements.size(); ++i)
    out += fmt::format("{}{}{}", i == 0 ? ':' : '+', elements[i].mirrored ? "~" : "",
                       elements[i].name);
  return out;
}

void ParameterPart::fail(const std::string& message) const {
  throw InputError(fmt::format("{}: {}", where, message));
}

ParameterPart part_named(const std::string& text, const Model& model) {
  const size_t colon = text.find(':');
  ParameterPart part{text.substr(0, colon)};
  part.where = fmt::format("parameter '{}'", text);
  traits_of(part.kind);
  const std::string element = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (element.empty()) return part;
  if (exists(part.kind, element, model)) {
    part.elements = {{element}};
    return part;
  }
  for (const std::string& piece : split_text(element, '+')) {
    const bool mirrored = piece.starts_with('~') && !exists(part.kind, piece, model);
    part.elements.push_back({piece.substr(mirrored ? 1 : 0), mirrored});
    if (part.elements.back().name.empty()) part.fail("expected KIND:ELEMENT+ELEMENT");
  }
  return part;
}

std::vector<ParameterPart> parameter_parts(const std::string& text, const Model& model) {
  if (text.starts_with('@')) return parts_in_file(text.substr(1), model);
  std::vector<ParameterPart> out;
  for (const std::string& piece : split_text(text, ',')) {
    const ParameterPart part = text_part(piece, model);
    const bool all = part.elements.size() == 1 && part.elements[0].name == "*";
    expand(part, all ? all_alone(part, model) : ElementSets{part.elements}, out);
  }
  return out;
}

std::vector<std::string> split_text(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

double finite_number(const std::string& text, const std::string& where) {
  const std::optional<double> value = parse_number(text);
  if (!value || !std::isfinite(*value))
    throw InputError(fmt::format("{}: '{}' is no finite number", where, text));
  return *value;
}

}  // namespace counterpoint::estimation
