#include "counterpoint/model/sdf/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <sdf/Console.hh>
#include <sdf/ParserConfig.hh>

#include "counterpoint/model/files/text_file.h"
#include "counterpoint/model/sdf/includes.h"
#include "counterpoint/model/urdf/captured_messages.h"

namespace counterpoint::sdf_file {
namespace {

/// The file that libsdformat names; of a text in memory it names none.
std::string named(const std::string& path, const std::filesystem::path& file) {
  return path.empty() || path == "<data-string>" ? file.string() : path;
}

std::string located(const sdf::Error& error, const std::filesystem::path& file) {
  std::string at = named(error.FilePath().value_or(""), file);
  if (error.LineNumber()) at += fmt::format(":{}", *error.LineNumber());
  return fmt::format("{}: {}", at, error.Message());
}

}  // namespace

Vector3 to_vector(const ignition::math::Vector3d& v) { return {v.X(), v.Y(), v.Z()}; }

Pose to_pose(const ignition::math::Pose3d& pose) {
  const ignition::math::Quaterniond& q = pose.Rot();
  return {Quaternion(q.W(), q.X(), q.Y(), q.Z()).normalized().toRotationMatrix(),
          to_vector(pose.Pos())};
}

Document::Document(const std::filesystem::path& file, const SdfOptions& options)
    : file_(file), options_(options) {
  // libsdformat has one console for the whole process.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  sdf::Console::Instance()->SetQuiet(true);
  const std::string text = read_xml_file(file, "there is no such file");
  sdf::ParserConfig config;
  config.SetWarningsPolicy(sdf::EnforcementPolicy::LOG);
  config.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::LOG);
  resolve_includes(file, text, options, config, notes);
  sdf::Errors errors;
  const CapturedMessages urdf_messages;  // what is no SDF is tried as URDF
  try {
    errors = root_.LoadSdfString(text, config);
  } catch (const std::exception& error) {
    throw InputError(fmt::format("{}: {}", file.string(), error.what()));
  }
  for (const sdf::Error& error : errors) {
    // The builder says what is wrong with an inertia, or takes it.
    if (error.Code() == sdf::ErrorCode::LINK_INERTIA_INVALID) continue;
    throw InputError(located(error, file));
  }
}

std::filesystem::path Document::folder_of(const sdf::ElementPtr& element) const {
  return std::filesystem::path(named(element->FilePath(), file_)).parent_path();
}

std::string Document::where(const sdf::ElementPtr& element) const {
  std::string at = named(element->FilePath(), file_);
  if (element->LineNumber()) at += fmt::format(":{}", *element->LineNumber());
  at += fmt::format(": <{}>", element->GetName());
  if (element->HasAttribute("name"))
    at += fmt::format(" '{}'", element->Get<std::string>("name"));
  return at;
}

void Document::fail(const sdf::ElementPtr& element, const std::string& what) const {
  throw InputError(fmt::format("{}: {}", where(element), what));
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
    notes.push_back({file_.string(), "plugins do not run: forces that they would apply are inputs here"});
}

sdf::ElementPtr Document::child(const sdf::ElementPtr& element, const char* name) {
  return element && element->HasElement(name) ? element->GetElement(name) : nullptr;
}

double Document::number(const sdf::ElementPtr& element, const char* name, double otherwise) {
  const sdf::ElementPtr e = child(element, name);
  return e ? e->Get<double>() : otherwise;
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
