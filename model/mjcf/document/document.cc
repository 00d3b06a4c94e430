#include "counterpoint/model/mjcf/document/document.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <charconv>
#include <cstring>

#include "counterpoint/model/mjcf/document/expansion.h"

namespace counterpoint::mjcf {
namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/// Parses numbers separated by blanks; false if the text holds anything else.
bool parse_numbers(const char* text, std::vector<double>& out) {
  const char* at = text;
  const char* end = text + std::strlen(text);
  while (true) {
    while (at < end && is_space(*at)) ++at;
    if (at == end) return true;
    if (*at == '+') ++at;
    double value = 0.0;
    const auto [stop, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !std::isfinite(value)) return false;
    if (stop < end && !is_space(*stop)) return false;
    out.push_back(value);
    at = stop;
  }
}

}  // namespace

Document::Document(const std::filesystem::path& file, const MjcfOptions& options)
    : file_(file), options_(options), sources_(options) {
  models_.push_back({file, -1, {}});
  root_ = &sources_.load(file, 0);
  expand(*this);
}

bool Document::is_within(int model, int outer) const {
  while (model != outer && model >= 0) model = models_[model].outer;
  return model == outer;
}

std::vector<const Element*> Document::children(const Element& element) const {
  std::vector<const Element*> out;
  for (const Element* e = element.FirstChildElement(); e; e = e->NextSiblingElement())
    out.push_back(e);
  return out;
}

std::vector<const Element*> Document::sections(const char* name) const {
  std::vector<const Element*> out;
  for (const Element* e : children(*root_))
    if (std::strcmp(e->Name(), name) == 0) out.push_back(e);
  return out;
}

std::vector<const Element*> Document::section_children(const char* name) const {
  std::vector<const Element*> out;
  for (const Element* section : sections(name))
    for (const Element* e : children(*section)) out.push_back(e);
  return out;
}

void Document::refuse(const Element& element, LeaveOut word, const std::string& what) {
  if (options_.leave_out.count(word) > 0) return note(element, what + "; left out");
  faults.add(fmt::format("{}: {}{}", where(element), what, how_to_leave_out("mjcf", file_, word)));
}

void Document::note(const Element& element, const std::string& what) {
  const std::string at = where(element);
  if (noted_.insert(at + what).second) notes.push_back({at, what});
}

void Document::expect(const Element& element, std::initializer_list<const char*> known) const {
  for (const auto* a = element.FirstAttribute(); a; a = a->Next()) {
    const auto same = [&](const char* name) { return std::strcmp(name, a->Name()) == 0; };
    if (std::any_of(known.begin(), known.end(), same)) continue;
    fail(element,
         fmt::format("attribute '{}' is not supported here; remove it if the motion does not "
                     "need it",
                     a->Name()));
  }
}

const Element* Values::level_of(const char* name) const {
  for (const Element* level : levels_)
    if (level->Attribute(name) != nullptr) return level;
  return nullptr;
}

const Element* Values::level_of_any(std::initializer_list<const char*> names) const {
  for (const Element* level : levels_)
    for (const char* name : names)
      if (level->Attribute(name) != nullptr) return level;
  return nullptr;
}

std::string Values::text(const char* name, const std::string& otherwise) const {
  const Element* level = level_of(name);
  return level ? level->Attribute(name) : otherwise;
}

std::vector<double> Values::numbers(const char* name, std::size_t least, std::size_t most) const {
  std::vector<double> out;
  const Element* level = level_of(name);
  if (level == nullptr) return out;
  const bool parsed = parse_numbers(level->Attribute(name), out);
  if (parsed && out.size() >= least && out.size() <= most) return out;
  const std::string count = least == most        ? std::to_string(least)
                            : most > kMaxNumbers ? fmt::format("{} or more", least)
                                                 : fmt::format("{} to {}", least, most);
  document_->fail(*level, fmt::format("{}: {} finite number{} between blanks {} expected", name,
                                      count, most == 1 ? "" : "s", most == 1 ? "is" : "are"));
}

std::optional<double> Values::number(const char* name) const {
  const std::vector<double> values = numbers(name, 1, 1);
  return values.empty() ? std::nullopt : std::optional(values[0]);
}

double Values::number(const char* name, double otherwise) const {
  return number(name).value_or(otherwise);
}

std::vector<int> Values::integers(const char* name, std::size_t least, std::size_t most) const {
  std::vector<int> out;
  for (const double value : numbers(name, least, most)) {
    if (value != std::floor(value) || std::abs(value) > 2e9)
      document_->fail(*level_of(name), fmt::format("{}: a whole number is expected", name));
    out.push_back(static_cast<int>(value));
  }
  return out;
}

int Values::integer(const char* name, int otherwise) const {
  const std::vector<int> values = integers(name, 1, 1);
  return values.empty() ? otherwise : values[0];
}

bool Values::boolean(const char* name, bool otherwise) const {
  return word(name, {"true", "false"}, otherwise ? "true" : "false") == "true";
}

Vector3 Values::vector(const char* name, const Vector3& otherwise) const {
  const std::vector<double> v = numbers(name, 3, 3);
  return v.empty() ? otherwise : Vector3(v[0], v[1], v[2]);
}

std::string Values::word(const char* name, std::initializer_list<const char*> words,
                         const char* otherwise) const {
  const Element* level = level_of(name);
  if (level == nullptr) return otherwise;
  const std::string given = level->Attribute(name);
  std::string list;
  for (const char* word : words) {
    if (given == word) return given;
    list += (list.empty() ? "" : ", ") + std::string(word);
  }
  document_->fail(*level, fmt::format("{}: '{}' is not one of {}", name, given, list));
}

}  // namespace counterpoint::mjcf
