// Names in an MJCF file and the attributes that refer to them, for renaming copies and attached
// models.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/mjcf/document/document.h"

namespace counterpoint::mjcf {

/// Pairs of kind ("body", "joint", "geom", "site", "tendon" ...) and name.
using Names = std::set<std::pair<std::string, std::string>>;

/// Names defined within an element; `with_itself`: including its own.
Names names_within(const Element& element, bool with_itself = false);

/// `elements`: contacts, equalities, tendons, actuators and sensors, in file order. `names`: the
/// names that were searched for and those of `elements`.
struct References {
  std::vector<Element*> elements;
  Names names;
};
/// The elements outside the bodies that refer to one of the names, or to a tendon or actuator that
/// does.
References references_to(Element& root, const Names& names);
/// Removes the elements outside the bodies that refer to a part which neither `there` nor another
/// such element defines.
void remove_dangling(Element& root, const Names& there);

/// Renames these names, and references to them, in an element and its descendants.
void rename_all(Element& element, const Names& names, const std::string& prefix,
                const std::string& suffix);
/// Adds a prefix to every name and reference of a model, of any kind, except "world".
void prefix_all(Element& root, const std::string& prefix);
/// Gives assets without a name the stem of their file, as MuJoCo does.
void complete_names(Element& root);

}  // namespace counterpoint::mjcf
