#include "counterpoint/model/mjcf/document/document.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <charconv>
#include <cstring>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::mjcf {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxDepth = 100;          // of elements
constexpr std::size_t kMaxFiles = 200;  // included

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/// Numbers between blanks; false if something else stands there.
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

std::string name_of(const Element& element) {
  const char* name = element.Attribute("name");
  return name ? name : "";
}

Document::Document(const fs::path& file, const MjcfOptions& options)
    : file_(file), options_(options) {
  files_.push_back({file, std::make_unique<tinyxml2::XMLDocument>()});
  parse_xml_file(file, "there is no such file", *files_.back().xml);
  root_ = files_.back().xml->RootElement();
  if (root_ == nullptr || std::strcmp(root_->Name(), "mujoco") != 0) {
    throw InputError(
        fmt::format("{}: the root element is <{}>; <mujoco> is expected of an MJCF file",
                    file.string(), root_ ? root_->Name() : ""));
  }
  load_includes(*root_, 0);
}

Document::~Document() = default;

void Document::load_includes(const Element& element, int depth) {
  if (depth > kMaxDepth) fail(element, fmt::format("nested deeper than {} elements", kMaxDepth));
  for (const Element* e = element.FirstChildElement(); e; e = e->NextSiblingElement()) {
    if (std::strcmp(e->Name(), "include") != 0) {
      load_includes(*e, depth + 1);
      continue;
    }
    const char* name = e->Attribute("file");
    if (name == nullptr || *name == '\0') fail(*e, "file: the name of a file is expected");
    const fs::path path = find_mesh(name, folder(), options_.packages, where(*e)).file;
    std::error_code error;
    for (const File& other : files_) {
      if (fs::equivalent(other.path, path, error))
        fail(*e, fmt::format("file '{}' is included a second time", name));
    }
    if (files_.size() == kMaxFiles)
      fail(*e, fmt::format("more than {} files are included", kMaxFiles));
    files_.push_back({path, std::make_unique<tinyxml2::XMLDocument>()});
    parse_xml_file(path, "there is no such file", *files_.back().xml);
    const Element* root = files_.back().xml->RootElement();
    if (root == nullptr) fail(*e, fmt::format("file '{}' holds no element", name));
    included_[e] = root;
    load_includes(*root, depth + 1);
  }
}

std::vector<const Element*> Document::children(const Element& element) const {
  std::vector<const Element*> out;
  for (const Element* e = element.FirstChildElement(); e; e = e->NextSiblingElement()) {
    const auto included = included_.find(e);
    if (included == included_.end()) {
      out.push_back(e);
      continue;
    }
    for (const Element* inner : children(*included->second)) out.push_back(inner);
  }
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

std::string Document::where(const Element& element) const {
  fs::path path = file_;
  for (const File& file : files_)
    if (file.xml.get() == element.GetDocument()) path = file.path;
  const std::string name = name_of(element);
  return fmt::format("{}:{}: <{}>{}", path.string(), element.GetLineNum(), element.Name(),
                     name.empty() ? "" : " '" + name + "'");
}

void Document::fail(const Element& element, const std::string& what) const {
  throw InputError(where(element) + ": " + what);
}

void Document::refuse(const Element& element, LeaveOut word, const std::string& what) {
  if (options_.leave_out.count(word) > 0) return note(element, what + "; left out");
  fail(element,
       fmt::format("{}. To go on without it name the file in a scene: models: [{{mjcf: {}, "
                   "leave_out: [{}]}}]",
                   what, file_.filename().string(), leave_out_name(word)));
}

void Document::note(const Element& element, const std::string& what) {
  notes.push_back({where(element), what});
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

int Values::integer(const char* name, int otherwise) const {
  const std::optional<double> value = number(name);
  if (!value) return otherwise;
  if (*value != std::floor(*value) || std::abs(*value) > 2e9)
    document_->fail(*level_of(name), fmt::format("{}: a whole number is expected", name));
  return static_cast<int>(*value);
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
