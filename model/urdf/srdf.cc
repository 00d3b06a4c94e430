#include "counterpoint/model/urdf/srdf.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include "counterpoint/model/spatial.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

Srdf load_srdf(const std::filesystem::path& file) {
  tinyxml2::XMLDocument document;
  parse_xml_file(file, "there is no such SRDF file", document);
  const tinyxml2::XMLElement* robot = document.RootElement();
  if (robot == nullptr || std::string(robot->Name()) != "robot") {
    throw InputError(fmt::format("{}: the root element must be <robot>", file.string()));
  }
  Srdf out;
  for (const auto* e = robot->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    const std::string name = e->Name();
    const std::string where = fmt::format("{}:{}", file.string(), e->GetLineNum());
    if (name == "disable_default_collisions" || name == "enable_collisions") {
      out.notes.push_back({where, "<" + name + "> is not used; only <disable_collisions> is"});
    }
    if (name != "disable_collisions") continue;
    const char* a = e->Attribute("link1");
    const char* b = e->Attribute("link2");
    if (a == nullptr || b == nullptr || *a == '\0' || *b == '\0') {
      throw InputError(where + ": <disable_collisions> needs link1=\"...\" and link2=\"...\"");
    }
    const char* reason = e->Attribute("reason");
    out.disabled.push_back({a, b, reason == nullptr ? "" : reason, where});
  }
  return out;
}

void exclude_disabled_pairs(const Srdf& srdf, const std::string& prefix, ModelBuilder& builder) {
  for (const Srdf::Pair& pair : srdf.disabled) {
    try {
      builder.exclude_pair(prefix + pair.link_a, prefix + pair.link_b,
                           pair.reason.empty() ? "SRDF" : "SRDF: " + pair.reason);
    } catch (const InputError& error) {
      throw InputError(pair.where + ": " + error.what());
    }
  }
}

}  // namespace counterpoint
