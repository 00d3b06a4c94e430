// Parameters as a user gives them, in a text or a YAML file, before they meet a scene's values.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/scene.h"

namespace counterpoint::estimation {

/// An element of the scene; a mirrored one takes the negative value.
struct NamedElement {
  std::string name;
  bool mirrored = false;
};

/// Standard deviation of a prior, in the parameter's unit or in percent of the scene's value.
struct StatedDeviation {
  double value = 0.0;
  bool percent = false;
};

/// A parameter as given.
struct ParameterPart {
  std::string kind;
  std::vector<NamedElement> elements = {};  ///< they share the value; none: the kind's default
  std::optional<std::pair<double, double>> bounds = {};
  std::optional<StatedDeviation> deviation = {};
  std::string where = {};  ///< the place of the part, for errors: "parameter 'mass:cube=1'"

  std::string name() const;  ///< KIND or KIND:A+~B
  [[noreturn]] void fail(const std::string& message) const;
};

/// Parses KIND[:ELEMENT[+ELEMENT...]], '~' before an element of the negative value. An element of
/// the scene whose name contains these characters comes first. @throws InputError for an unknown
/// kind.
ParameterPart part_named(const std::string& text, const Model& model);

/// Parses KIND[:ELEMENTS][=LOW..HIGH][~DEVIATION], comma separated, or the YAML file of "@FILE".
/// `KIND:*` becomes one part for each link or joint, `inertial` the ten of a link. @throws
/// InputError naming the part, or file and line.
std::vector<ParameterPart> parameter_parts(const std::string& text, const Model& model);

/// Splits at each separator.
std::vector<std::string> split_text(const std::string& text, char separator);
/// Parses a finite number. @throws InputError that begins with `where`.
double finite_number(const std::string& text, const std::string& where);

}  // namespace counterpoint::estimation
