#include "counterpoint/model/mjcf/document/references.h"

#include <algorithm>
#include <cstring>
#include <filesystem>

namespace counterpoint::mjcf {
namespace {

/// Attributes that hold names, in any element, and the kind of object that they refer to.
constexpr std::pair<const char*, const char*> kReferences[] = {
    {"body", "body"},         {"body1", "body"},          {"body2", "body"},
    {"target", "body"},       {"joint", "joint"},         {"joint1", "joint"},
    {"joint2", "joint"},      {"jointinparent", "joint"}, {"geom", "geom"},
    {"geom1", "geom"},        {"geom2", "geom"},          {"site", "site"},
    {"site1", "site"},        {"site2", "site"},          {"refsite", "site"},
    {"cranksite", "site"},    {"slidersite", "site"},     {"sidesite", "site"},
    {"tendon", "tendon"},     {"tendon1", "tendon"},      {"tendon2", "tendon"},
    {"actuator", "actuator"}, {"mesh", "mesh"},           {"hfield", "hfield"},
    {"material", "material"}, {"texture", "texture"},     {"class", "class"},
    {"childclass", "class"},  {"objname", "any"},         {"refname", "any"},
    {"name", "name"}};

constexpr const char* kSections[] = {"contact", "equality", "tendon", "actuator", "sensor"};

bool is_one_of(const char* name, const auto& list) {
  return std::any_of(std::begin(list), std::end(list),
                     [&](const char* one) { return std::strcmp(one, name) == 0; });
}

/// Kind of object that an element defines.
std::string kind_of(const Element& element) {
  const std::string tag = element.Name();
  if (tag == "freejoint") return "joint";
  const auto* section = element.Parent() ? element.Parent()->ToElement() : nullptr;
  if (section && is_one_of(section->Name(), kSections)) return section->Name();
  return tag;
}

const char* referred_kind(const char* attribute) {
  for (const auto& [name, kind] : kReferences)
    if (std::strcmp(name, attribute) == 0) return kind;
  return nullptr;
}

/// Whether `names` contains a name; kind "any" (the object of a sensor) matches every kind.
bool holds(const Names& names, const std::string& kind, const std::string& name) {
  if (kind != "any") return names.count({kind, name}) > 0;
  return std::any_of(names.begin(), names.end(),
                     [&](const auto& one) { return one.second == name; });
}

/// Calls `found(element, attribute, kind)` for every name and reference in an element and its
/// descendants.
template <class AnyElement, class Found>
void each_name(AnyElement& element, const Found& found) {
  for (const auto* a = element.FirstAttribute(); a; a = a->Next())
    if (const char* kind = referred_kind(a->Name()))
      found(element, *a, std::strcmp(kind, "name") == 0 ? kind_of(element) : std::string(kind));
  for (auto* e = element.FirstChildElement(); e; e = e->NextSiblingElement()) each_name(*e, found);
}

bool refers_to(const Element& element, const Names& names) {
  bool does = false;
  each_name(element, [&](const Element&, const tinyxml2::XMLAttribute& a, const std::string& kind) {
    does = does || (std::strcmp(a.Name(), "name") != 0 && holds(names, kind, a.Value()));
  });
  return does;
}

void collect_names(const Element& element, bool itself, Names& out) {
  if (itself && !name_of(element).empty()) out.insert({kind_of(element), name_of(element)});
  for (const Element* e = element.FirstChildElement(); e; e = e->NextSiblingElement())
    collect_names(*e, true, out);
}

/// The elements outside the bodies that may refer to parts of them, in file order.
std::vector<Element*> referring_elements(Element& root) {
  std::vector<Element*> out;
  for (Element* section = root.FirstChildElement(); section;
       section = section->NextSiblingElement())
    if (is_one_of(section->Name(), kSections))
      for (Element* e = section->FirstChildElement(); e; e = e->NextSiblingElement())
        out.push_back(e);
  return out;
}

}  // namespace

Names names_within(const Element& element, bool with_itself) {
  Names out;
  collect_names(element, with_itself, out);
  return out;
}

References references_to(Element& root, const Names& names) {
  References out{{}, names};
  // An actuator may refer to a tendon that follows it, and a sensor to the actuator: three passes.
  for (int pass = 0; pass < 3; ++pass)
    for (const Element* e : referring_elements(root))
      if (!name_of(*e).empty() && refers_to(*e, out.names))
        out.names.insert({kind_of(*e), name_of(*e)});
  for (Element* e : referring_elements(root))
    if (refers_to(*e, out.names)) out.elements.push_back(e);
  return out;
}

void remove_dangling(Element& root, const Names& there) {
  Names known = there;
  for (const Element* e : referring_elements(root))
    if (!name_of(*e).empty()) known.insert({kind_of(*e), name_of(*e)});
  for (int pass = 0; pass < 3; ++pass) {
    for (Element* e : referring_elements(root)) {
      bool dangles = false;
      each_name(*e, [&](const Element&, const tinyxml2::XMLAttribute& a, const std::string& kind) {
        const bool part = kind == "body" || kind == "joint" || kind == "geom" || kind == "site" ||
                          kind == "tendon" || kind == "actuator" || kind == "any";
        if (part && std::strcmp(a.Name(), "name") != 0 && std::strcmp(a.Value(), "world") != 0)
          dangles = dangles || !holds(known, kind, a.Value());
      });
      if (!dangles) continue;
      known.erase({kind_of(*e), name_of(*e)});
      e->Parent()->DeleteChild(e);
    }
  }
}

void rename_all(Element& element, const Names& names, const std::string& prefix,
                const std::string& suffix) {
  each_name(element, [&](Element& e, const tinyxml2::XMLAttribute& a, const std::string& kind) {
    if (holds(names, kind, a.Value()))
      e.SetAttribute(a.Name(), (prefix + a.Value() + suffix).c_str());
  });
}

void prefix_all(Element& root, const std::string& prefix) {
  for (Element* section = root.FirstChildElement(); section;
       section = section->NextSiblingElement())
    each_name(*section, [&](Element& e, const tinyxml2::XMLAttribute& a, const std::string&) {
      if (std::strcmp(a.Value(), "world") != 0 && *a.Value() != '\0')
        e.SetAttribute(a.Name(), (prefix + a.Value()).c_str());
    });
}

void complete_names(Element& root) {
  for (Element* section = root.FirstChildElement("asset"); section;
       section = section->NextSiblingElement("asset"))
    for (Element* e = section->FirstChildElement(); e; e = e->NextSiblingElement())
      if (e->Attribute("name") == nullptr && e->Attribute("file") != nullptr)
        e->SetAttribute("name",
                        std::filesystem::path(e->Attribute("file")).stem().string().c_str());
}

}  // namespace counterpoint::mjcf
