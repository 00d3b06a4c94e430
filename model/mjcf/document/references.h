// Names in an MJCF file, and the attributes that refer to them: what is renamed with copies and
// attached models.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/mjcf/document/document.h"

namespace counterpoint::mjcf {

/// Kind ("body", "joint", "geom", "site", "tendon" ...) and name.
using Names = std::set<std::pair<std::string, std::string>>;

/// Names given within an element, `with_itself` or not.
Names names_within(const Element& element, bool with_itself = false);

struct References {
  std::vector<Element*>
      elements;  ///< of contacts, equalities, tendons, actuators, sensors, in the file's order
  Names names;   ///< those that were looked for, and those of the elements
};
/// The elements outside of the bodies that refer to a name, or to a tendon or actuator that does.
References references_to(Element& root, const Names& names);
/// Removes those that refer to a part of the bodies that is not there.
void remove_dangling(Element& root, const Names& there);

/// Names and references to them, in an element and all within.
void rename_all(Element& element, const Names& names, const std::string& prefix,
                const std::string& suffix);
/// Every name of a model, of whatever kind, but for "world".
void prefix_all(Element& root, const std::string& prefix);
/// Gives assets that are called like their files that name.
void complete_names(Element& root);

}  // namespace counterpoint::mjcf
