#include "counterpoint/model/mjcf/document/defaults.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstring>

namespace counterpoint::mjcf {

Defaults::Defaults(const Document& document) : document_(document) {
  const std::vector<const Element*> sections = document.sections("default");
  for (const Element* section : sections) {
    const char* name = section->Attribute("class");
    const auto [top, is_first] = top_.emplace(document.model_of(*section), name ? name : "main");
    if (name != nullptr && name != top->second)
      document.fail(*section, fmt::format("class '{}': the top class is '{}'", name, top->second));
    read(*section, top->second, "");
  }
  classes_[top_.emplace(0, "main").first->second];
}

void Defaults::read(const Element& element, const std::string& name, const std::string& parent) {
  document_.expect(element, {"class"});
  classes_[name].parent = parent;
  for (const Element* e : document_.children(element)) {
    if (std::strcmp(e->Name(), "default") != 0) {
      classes_[name].elements.push_back(e);
      continue;
    }
    const char* below = e->Attribute("class");
    if (below == nullptr || *below == '\0') document_.fail(*e, "class: a name is expected");
    const auto known = classes_.find(below);
    if (known != classes_.end() && known->second.parent != name)
      document_.fail(*e, fmt::format("class '{}' is there already", below));
    read(*e, below, name);
  }
}

const Defaults::Class& Defaults::class_of(const Element& element,
                                          const std::string& childclass) const {
  const char* own = element.Attribute("class");
  const std::string name = own                  ? own
                           : childclass.empty() ? top_.at(document_.model_of(element))
                                                : childclass;
  const auto found = classes_.find(name);
  if (found != classes_.end()) return found->second;
  document_.fail(element, fmt::format("there is no default class '{}'", name));
}

Values Defaults::values(const Element& element, const std::string& childclass,
                        const char* tag) const {
  Values values(document_, element);
  std::vector<const Element*> all =
      chain(element, childclass, {tag != nullptr ? tag : element.Name()});
  for (auto it = all.rbegin(); it != all.rend(); ++it) values.add_level(**it);
  return values;
}

std::vector<const Element*> Defaults::chain(const Element& element, const std::string& childclass,
                                            const std::vector<std::string>& tags) const {
  std::vector<const Class*> classes;
  for (const Class* c = &class_of(element, childclass);;) {
    classes.push_back(c);
    if (c->parent.empty()) break;
    c = &classes_.at(c->parent);
  }
  std::vector<const Element*> out;
  for (auto c = classes.rbegin(); c != classes.rend(); ++c)
    for (const Element* e : (*c)->elements)
      if (std::find(tags.begin(), tags.end(), e->Name()) != tags.end()) out.push_back(e);
  return out;
}

}  // namespace counterpoint::mjcf
