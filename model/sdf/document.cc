#include "counterpoint/model/sdf/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <mutex>
#include <sdf/Console.hh>
#include <sdf/ParserConfig.hh>
#include <sstream>

#include "counterpoint/model/files/captured_messages.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::sdf_file {
namespace {

/// The file that libsdformat names; for text in memory it names none, and that is `file`.
std::string named(const std::string& path, const std::filesystem::path& file) {
  if (path.empty() || path == "<data-string>") return file.string();
  return std::filesystem::path(path).lexically_normal().string();
}

std::string located(const sdf::Error& error, const std::filesystem::path& file) {
  std::string at = named(error.FilePath().value_or(""), file);
  if (error.LineNumber()) at += fmt::format(":{}", *error.LineNumber());
  return fmt::format("{}: {}", at, error.Message());
}

/// Whether an error concerns only display or sensors, without effect on the motion. Ignores words
/// in brackets, where libsdformat quotes names, which may be any.
bool is_about_appearance(const sdf::Error& error) {
  using Code = sdf::ErrorCode;
  if (error.Code() != Code::ELEMENT_MISSING && error.Code() != Code::ELEMENT_INVALID &&
      error.Code() != Code::ATTRIBUTE_MISSING && error.Code() != Code::ATTRIBUTE_INVALID)
    return false;
  std::string text;
  int depth = 0;
  for (const char c : error.Message()) {
    depth += c == '[' ? 1 : c == ']' ? -1 : 0;
    if (depth == 0) text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  for (const char* word : {"sensor", "<script>", "material", "visual", "light", "camera", "actor",
                           "plugin", "<gui>", "texture", "lidar", "emitter"})
    if (text.find(word) != std::string::npos) return true;
  return false;
}

}  // namespace

Vector3 to_vector(const ignition::math::Vector3d& v) { return {v.X(), v.Y(), v.Z()}; }

Pose to_pose(const ignition::math::Pose3d& pose) {
  const ignition::math::Quaterniond& q = pose.Rot();
  return {Quaternion(q.W(), q.X(), q.Y(), q.Z()).normalized().toRotationMatrix(),
          to_vector(pose.Pos())};
}

Document::Document(const std::filesystem::path& file, const SdfOptions& options)
    : Document(file, read_xml_file(file, "there is no such file"), options) {}

Document::Document(const std::filesystem::path& file, const std::string& text,
                   const SdfOptions& options)
    : file_(file), options_(options) {
  // libsdformat has one console for the whole process.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  sdf::Console::Instance()->SetQuiet(true);
  sdf::ParserConfig config;
  config.SetWarningsPolicy(sdf::EnforcementPolicy::LOG);
  config.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::LOG);
  const std::string resolved = resolve_includes(file, text, options, config, notes, later_);
  sdf::Errors errors;
  const CapturedMessages urdf_messages;  // libsdformat tries text that is no SDF as URDF
  try {
    errors = root_.LoadSdfString(resolved, config);
  } catch (const std::exception& error) {
    throw InputError(fmt::format("{}: {}", file.string(), error.what()));
  }
  for (const sdf::Error& error : errors) {
    // ModelBuilder reports invalid inertias, or accepts them.
    if (error.Code() == sdf::ErrorCode::LINK_INERTIA_INVALID) continue;
    // read_joint_sensor reports the first with its line; the second follows another error.
    if (error.Message().rfind("ForceTorque element", 0) == 0 ||
        error.Message() == "Failed to load a world.")
      continue;
    // The innermost element that cannot be read comes first, the whole text last.
    const bool around = error.Message().rfind("Error reading element", 0) == 0 ||
                        error.Code() == sdf::ErrorCode::STRING_READ;
    if (around && faults.any()) continue;
    if (is_about_appearance(error))
      notes.push_back(
          {file.string(), "not read, without effect on the motion: " + error.Message()});
    else
      faults.add(located(error, file));
  }
  faults.throw_if_any();
}

std::filesystem::path Document::folder_of(const sdf::ElementPtr& element) const {
  return std::filesystem::path(named(element->FilePath(), file_)).parent_path();
}

std::string Document::where(const sdf::ElementPtr& element) const {
  std::string at = named(element->FilePath(), file_);
  if (element->LineNumber()) at += fmt::format(":{}", *element->LineNumber());
  at += fmt::format(": <{}>", element->GetName());
  if (element->HasAttribute("name")) at += fmt::format(" '{}'", element->Get<std::string>("name"));
  return at;
}

std::string Document::later(const sdf::ElementPtr& element, const char* attribute) const {
  if (!element || !element->LineNumber()) return "";
  const auto found = later_.find(later_key(named(element->FilePath(), file_),
                                           *element->LineNumber(), element->GetName(), attribute));
  return found == later_.end() ? "" : found->second;
}

void Document::fail(const sdf::ElementPtr& element, const std::string& what) const {
  throw InputError(fmt::format("{}: {}", where(element), what));
}

void Document::refuse(const sdf::ElementPtr& element, LeaveOut word, const std::string& what) {
  if (options_.leave_out.count(word) > 0) return note(element, what + "; left out");
  faults.add(fmt::format("{}: {}{}", where(element), what, how_to_leave_out("sdf", file_, word)));
}

void Document::note(const sdf::ElementPtr& element, const std::string& what) {
  notes.push_back({where(element), what});
}

std::vector<sdf::ElementPtr> Document::children(const sdf::ElementPtr& element) const {
  std::vector<sdf::ElementPtr> out;
  for (sdf::ElementPtr e = element->GetFirstElement(); e; e = e->GetNextElement()) out.push_back(e);
  return out;
}

void Document::pass_over_all_but(const sdf::ElementPtr& element,
                                 std::initializer_list<const char*> read) {
  for (const sdf::ElementPtr& e : children(element)) {
    const auto same = [&](const char* name) { return e->GetName() == name; };
    if (std::none_of(read.begin(), read.end(), same)) ++passed_[e->GetName()];
  }
}

void Document::note_passed() {
  std::string list;
  for (const auto& [name, count] : passed_)
    list += fmt::format("{}<{}>{}", list.empty() ? "" : ", ", name,
                        count > 1 ? fmt::format(" ({})", count) : "");
  if (!list.empty()) notes.push_back({file_.string(), "passed over: " + list});
  if (passed_.count("plugin") > 0)
    notes.push_back(
        {file_.string(), "plugins do not run: forces that they would apply are inputs here"});
}

sdf::ElementPtr Document::child(const sdf::ElementPtr& element, const char* name) {
  return element && element->HasElement(name) ? element->GetElement(name) : nullptr;
}

double Document::number(const sdf::ElementPtr& element, const char* name, double otherwise) {
  const sdf::ElementPtr e = child(element, name);
  return e ? e->Get<double>() : otherwise;
}

std::optional<double> Document::later_number(const sdf::ElementPtr& element, const char* name) {
  const sdf::ElementPtr e = child(element, name);
  if (!e) return {};
  double value = 0.0;
  if (const sdf::ParamPtr text = e->GetValue()) std::istringstream(text->GetAsString()) >> value;
  return value;
}

bool Document::flag(const sdf::ElementPtr& element, const char* name, bool otherwise) {
  const sdf::ElementPtr e = child(element, name);
  return e ? e->Get<bool>() : otherwise;
}

void Document::check(const sdf::Errors& errors, const sdf::ElementPtr& element) const {
  if (!errors.empty()) fail(element, errors.front().Message());
}

Pose Document::resolve(const sdf::SemanticPose& pose, const std::string& frame,
                       const sdf::ElementPtr& element) const {
  ignition::math::Pose3d out;
  check(pose.Resolve(out, frame), element);
  return to_pose(out);
}

}  // namespace counterpoint::sdf_file
