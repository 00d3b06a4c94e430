// The two models of Gazebo's library that nearly every world includes, the sun and the ground
// plane, so that worlds load without the library's files.
#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cctype>
#include <cstring>

#include "counterpoint/model/sdf/includes.h"

namespace counterpoint::sdf_file {
namespace {

/// The library's file has mu = 100 and mu2 = 50; nothing slides with either.
constexpr const char* kGroundLink =
    "<link name='link'><collision name='collision'><geometry><plane><normal>0 0 "
    "1</normal><size>100 100</size></plane>"
    "</geometry><surface><friction><ode><mu>100</mu><mu2>100</mu2></ode></friction></surface></"
    "collision></link>";

/// Name of the model in a URI: "ground_plane" for "model://ground_plane" and for
/// ".../models/Ground%20Plane/2".
std::string library_name(std::string uri) {
  while (!uri.empty() && uri.back() == '/') uri.pop_back();
  const auto is_number = [](const std::string& s) {
    return !s.empty() &&
           std::all_of(s.begin(), s.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  };
  const bool fuel = uri.rfind("http", 0) == 0;
  std::size_t slash = uri.rfind('/');
  if (fuel && slash != std::string::npos && is_number(uri.substr(slash + 1))) {
    uri.erase(slash);
    slash = uri.rfind('/');
  }
  std::string name = slash == std::string::npos ? uri : uri.substr(slash + 1);
  for (std::size_t at = name.find("%20"); at != std::string::npos; at = name.find("%20", at))
    name.replace(at, 3, 1, '_');
  for (char& c : name)
    c = c == ' ' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '\'')
      out += "&apos;";
    else
      out += c;
  }
  return out;
}

std::string text_of(const tinyxml2::XMLElement& parent, const char* name, const char* otherwise) {
  const tinyxml2::XMLElement* e = parent.FirstChildElement(name);
  return e && e->GetText() ? e->GetText() : otherwise;
}

/// Position after the item at `at`: a whole comment or CDATA section, else one character.
std::size_t past(const std::string& text, std::size_t at) {
  for (const auto& [open, close] : {std::pair("<!--", "-->"), std::pair("<![CDATA[", "]]>")}) {
    if (text.compare(at, std::strlen(open), open) != 0) continue;
    const std::size_t end = text.find(close, at);
    return end == std::string::npos ? text.size() : end + 3;
  }
  return at + 1;
}

}  // namespace

std::optional<std::string> library_model(const std::string& uri,
                                         const tinyxml2::XMLElement& include) {
  const std::string name = library_name(uri);
  if (name == "sun") return "";
  if (name != "ground_plane") return std::nullopt;
  std::string attributes, pose;
  if (const auto* e = include.FirstChildElement("pose")) {
    tinyxml2::XMLPrinter printer(nullptr, true);
    e->Accept(&printer);
    pose = printer.CStr();
  }
  if (const std::string frame = text_of(include, "placement_frame", ""); !frame.empty())
    attributes = fmt::format(" placement_frame='{}'", escaped(frame));
  return fmt::format("<model name='{}'{}><static>true</static>{}{}</model>",
                     escaped(text_of(include, "name", "ground_plane")), attributes, pose,
                     kGroundLink);
}

std::string with_includes_replaced(const std::string& text,
                                   const std::map<std::size_t, std::string>& by_number) {
  if (by_number.empty()) return text;
  constexpr const char* kOpen = "<include";
  constexpr const char* kClose = "</include>";
  std::string out;
  std::size_t from = 0, number = 0;
  for (std::size_t at = text.find('<'); at != std::string::npos;
       at = text.find('<', past(text, at))) {
    const std::size_t name_end = at + std::strlen(kOpen);
    if (text.compare(at, std::strlen(kOpen), kOpen) != 0 || name_end >= text.size() ||
        std::strchr(" \t\r\n>/", text[name_end]) == nullptr)
      continue;
    const auto replacement = by_number.find(number++);
    if (replacement == by_number.end()) continue;
    const std::size_t close = text.find(kClose, at);
    if (close == std::string::npos) break;
    const std::size_t end = close + std::strlen(kClose);
    const auto lines = std::count(text.begin() + static_cast<std::ptrdiff_t>(at),
                                  text.begin() + static_cast<std::ptrdiff_t>(end), '\n');
    out.append(text, from, at - from)
        .append(replacement->second)
        .append(static_cast<std::size_t>(lines), '\n');
    from = end;
  }
  return out.append(text, from);
}

}  // namespace counterpoint::sdf_file
