#include "counterpoint/model/mesh/collada_reader.h"

#include <fmt/format.h>

#include <cstdlib>

#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

using tinyxml2::XMLElement;

constexpr const char* kXmlBlank = " \t\r\n";

/// Parses text as numbers that consist of the characters in `digits`. fail(message) must throw.
template <typename Number, typename Parse, typename Fail>
std::vector<Number> numbers(const std::string& text, const char* digits, const Parse& parse,
                            const Fail& fail) {
  std::vector<Number> out;
  const char* at = text.c_str() + std::strspn(text.c_str(), kXmlBlank);
  while (*at != '\0') {
    char* end = nullptr;
    out.push_back(parse(at, &end));
    const bool whole = *end == '\0' || std::strchr(kXmlBlank, *end) != nullptr;
    if (end == at || end > at + std::strspn(at, digits) || !whole) {
      fail(fmt::format("holds '{:.16}' where a number is expected", at));
    }
    at = end + std::strspn(end, kXmlBlank);
  }
  return out;
}

}  // namespace

void ColladaReader::fail(const XMLElement& at, const std::string& what) const {
  throw InputError(
      fmt::format("{}:{}: <{}> {}; export the mesh anew", file_, at.GetLineNum(), at.Name(), what));
}

void ColladaReader::expect_only(const XMLElement& above,
                                std::initializer_list<const char*> names) const {
  each(above, {}, [&](const XMLElement& e) {
    if (!is_one_of(e, names) && !is_one_of(e, {"extra", "technique"})) {
      fail(e, fmt::format("stands in <{}>, where it is not known", above.Name()));
    }
  });
}

const XMLElement* ColladaReader::only(const XMLElement& above, const char* name) const {
  const XMLElement* first = above.FirstChildElement(name);
  const XMLElement* second = first == nullptr ? nullptr : first->NextSiblingElement(name);
  if (second != nullptr) fail(*second, "stands here for the second time");
  return first;
}

const XMLElement& ColladaReader::the(const XMLElement& above, const char* name) const {
  const XMLElement* found = only(above, name);
  if (found == nullptr) fail(above, fmt::format("has no <{}>", name));
  return *found;
}

std::string ColladaReader::text(const XMLElement& in) const {
  std::string out;
  for (const auto* c = in.FirstChild(); c != nullptr; c = c->NextSibling()) {
    if (const auto* e = c->ToElement()) fail(*e, fmt::format("stands in <{}>", in.Name()));
    if (c->ToText() != nullptr) out += c->Value();
  }
  return out;
}

std::vector<double> ColladaReader::reals(const XMLElement& in) const {
  return numbers<double>(
      text(in), "+-.0123456789eE", [](const char* s, char** end) { return std::strtod(s, end); },
      [&](const std::string& what) { fail(in, what); });
}

std::vector<long> ColladaReader::integers(const XMLElement& in) const {
  return numbers<long>(
      text(in), "+-0123456789", [](const char* s, char** end) { return std::strtol(s, end, 10); },
      [&](const std::string& what) { fail(in, what); });
}

long ColladaReader::count(const XMLElement& in, const char* name, long otherwise) const {
  const char* text = in.Attribute(name);
  if (text == nullptr) return otherwise;
  char* end = nullptr;
  const long value = std::strtol(text, &end, 10);
  if (end == text || *end != '\0' || value < 0 || value > 1'000'000'000) {
    fail(in, fmt::format("has {}=\"{:.16}\", which is no count", name, text));
  }
  return value;
}

std::string ColladaReader::reference(const XMLElement& in, const char* name) const {
  const char* text = in.Attribute(name);
  if (text == nullptr || *text != '#') {
    fail(in, fmt::format("has {}=\"{:.64}\", which names nothing in this file", name,
                         text == nullptr ? "" : text));
  }
  return text + 1;
}

}  // namespace counterpoint
