#include "counterpoint/model/sdf/includes.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <cstring>
#include <map>
#include <sdf/SDFImpl.hh>
#include <sdf/parser.hh>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::sdf_file {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

constexpr std::size_t kMaxDepth = 20;       // levels of files within files
constexpr std::size_t kMaxIncludes = 2000;  // in all, repeated ones counted each time

bool is_sdf_root(const XMLElement* root) {
  return root != nullptr &&
         (std::strcmp(root->Name(), "sdf") == 0 || std::strcmp(root->Name(), "gazebo") == 0);
}

class Walk {
 public:
  Walk(const SdfOptions& options, sdf::ParserConfig& config, std::vector<Note>& notes,
       LaterAttributes& later)
      : options_(options), config_(config), notes_(notes), later_(later) {}

  /// Replacement texts for includes of the outermost file, by their number in file order.
  std::map<std::size_t, std::string> replaced;

  void read(const fs::path& file, const XMLElement& root) {
    const std::vector<fs::path> around = open_;
    open_.push_back(file);
    read_elements(root, file);
    open_ = around;
  }

  /// Checks that libsdformat resolves each URI to the file found here. @throws InputError if not.
  void check() const {
    faults_.throw_if_any();
    for (const auto& [uri, target] : targets_) {
      std::error_code error;
      if (fs::equivalent(sdf::findFile(uri, true, true, config_), target.path, error)) continue;
      throw InputError(fmt::format(
          "{}: '{}' cannot be told from another name or file; give the package's folder by "
          "--package NAME=FOLDER, or another name",
          target.where, uri));
    }
  }

 private:
  struct Target {
    fs::path path;
    std::string where;
  };

  void read_elements(const XMLElement& element, const fs::path& file) {
    for (const XMLElement* e = element.FirstChildElement(); e; e = e->NextSiblingElement()) {
      faults_.collect([&] { check_known(*e, element, file); });
      if (std::strcmp(e->Name(), "include") == 0)
        faults_.collect([&] { read_include(*e, file); });
      else
        read_elements(*e, file);
    }
  }

  /// Keeps attributes and refuses elements of later SDF versions, which libsdformat 12 ignores.
  void check_known(const XMLElement& e, const XMLElement& parent, const fs::path& file) {
    const std::string name = e.Name();
    for (const auto& [element, attribute] :
         {std::pair("inertial", "auto"), std::pair("mesh", "optimization")})
      if (const char* value = e.Attribute(attribute); name == element && value)
        later_[later_key(file, e.GetLineNum(), name, attribute)] = value;
    std::string what;
    if (name == "mimic" && std::strncmp(parent.Name(), "axis", 4) == 0)
      what = "a joint that follows another is not supported in SDF; take the robot's URDF";
    if (name == "joint" && std::strcmp(parent.Name(), "world") == 0)
      what = "joints of a world are not supported; put the joint into a model around both";
    if (!what.empty())
      throw InputError(fmt::format("{}:{}: <{}>: {} (SDF up to 1.9 is read)", file.string(),
                                   e.GetLineNum(), name, what));
  }

  /// Replaces an include of the outermost file, which no folder holds, by a model of Gazebo's
  /// library; false if that has none.
  bool take_from_library(const std::string& uri, const XMLElement& element,
                         const std::string& where, std::size_t number) {
    if (open_.size() != 1) return false;
    const auto model = library_model(uri, element);
    if (!model) return false;
    replaced[number] = *model;
    notes_.push_back(
        {where, model->empty()
                    ? fmt::format("'{}': a light, without effect on the motion", uri)
                    : fmt::format(
                          "'{}' is not among the files: the plane z = 0 of its frame, friction 100",
                          uri)});
    return true;
  }

  void read_include(const XMLElement& element, const fs::path& file) {
    const std::size_t number = open_.size() == 1 ? outermost_++ : 0;
    const std::string where = fmt::format("{}:{}: <include>", file.string(), element.GetLineNum());
    const XMLElement* child = element.FirstChildElement("uri");
    const char* text = child ? child->GetText() : nullptr;
    const std::string uri(trimmed(text ? text : "", " \t\n\r"));
    if (uri.empty()) throw InputError(where + ": <uri> with the name of a model is expected");
    if (++number_ > kMaxIncludes)
      throw InputError(fmt::format("{}: more than {} includes", where, kMaxIncludes));
    if (uri.rfind("http://", 0) == 0 || uri.rfind("https://", 0) == 0) {
      if (take_from_library(uri, element, where, number)) return;
      throw InputError(
          fmt::format("{}: '{}' is not fetched; download the model and include it as "
                      "model://NAME, with --package NAME=FOLDER",
                      where, uri));
    }
    fs::path target;
    try {
      target = find(uri, file.parent_path(), where);
    } catch (const InputError&) {
      if (take_from_library(uri, element, where, number)) return;
      throw;
    }
    const auto [known, is_new] = targets_.emplace(uri, Target{target, where});
    std::error_code error;
    if (!is_new && !fs::equivalent(known->second.path, target, error))
      throw InputError(fmt::format("{}: '{}' means two files, {} and {}; name them differently",
                                   where, uri, known->second.path.string(), target.string()));
    tell(uri, target);
    const fs::path model =
        fs::is_directory(target, error) ? described(uri, target, file, where) : target;
    for (const fs::path& other : open_)
      if (fs::equivalent(other, model, error))
        throw InputError(fmt::format("{}: '{}' includes itself", where, uri));
    if (open_.size() == kMaxDepth)
      throw InputError(fmt::format("{}: files within files more than {} deep", where, kMaxDepth));
    tinyxml2::XMLDocument document;
    parse_xml_file(model, "there is no such file", document);
    const XMLElement* root = document.RootElement();
    if (!is_sdf_root(root))
      throw InputError(
          fmt::format("{}: {} is no SDF file; of a URDF make a model of its own in a scene file",
                      where, model.string()));
    read(model, *root);
  }

  /// The folder with a model.config that a URI names, else the file.
  fs::path find(const std::string& uri, const fs::path& folder, const std::string& where) {
    const std::string stem = uri.back() == '/' ? uri.substr(0, uri.size() - 1) : uri;
    MeshPath found;
    bool is_folder = true;
    try {
      found = find_mesh(stem + "/model.config", folder, options_.packages, where, "model");
    } catch (const InputError&) {
      is_folder = false;
      found = find_mesh(stem, folder, options_.packages, where, "model");
    }
    if (found.guessed)
      notes_.push_back({where, fmt::format("'{}' is taken to be {}", uri, found.file.string())});
    const fs::path path = fs::absolute(found.file).lexically_normal();
    return is_folder ? path.parent_path() : path;
  }

  /// The SDF file that the model.config of a folder names.
  fs::path described(const std::string& uri, const fs::path& target, const fs::path& file,
                     const std::string& where) const {
    tinyxml2::XMLDocument config;
    parse_xml_file(target / "model.config", "there is no such file", config);
    const std::string chosen = sdf::getModelFilePath(target.string());
    if (chosen.empty())
      throw InputError(
          fmt::format("{}: {} names no <sdf> file", where, (target / "model.config").string()));
    const std::string name = fs::path(chosen).lexically_relative(target).generic_string();
    const fs::path model =
        find_mesh(uri + "/" + name, file.parent_path(), options_.packages, where, "model").file;
    std::error_code error;
    if (fs::equivalent(model, chosen, error)) return model;
    throw InputError(fmt::format("{}: there is no file {}", where, chosen));
  }

  /// Adds a URI to libsdformat's map, which it searches before all other places. A URI that begins
  /// with a key of the map is the key's folder followed by the rest of the URI.
  void tell(const std::string& uri, const fs::path& target) {
    std::error_code error;
    if (fs::is_directory(target, error)) return config_.AddURIPath(uri, target.string());
    const std::size_t slash = uri.rfind('/');
    config_.AddURIPath(slash == std::string::npos ? "" : uri.substr(0, slash + 1),
                       target.parent_path().string());
  }

  const SdfOptions& options_;
  sdf::ParserConfig& config_;
  std::vector<Note>& notes_;
  LaterAttributes& later_;
  std::vector<fs::path> open_;
  std::map<std::string, Target> targets_;
  std::size_t number_ = 0, outermost_ = 0;
  Faults faults_;
};

}  // namespace

std::string later_key(const fs::path& file, int line, const std::string& element,
                      const std::string& attribute) {
  std::error_code error;
  const fs::path path = fs::weakly_canonical(file, error);
  return fmt::format("{}:{}: <{}> {}", (error ? file : path).string(), line, element, attribute);
}

std::string resolve_includes(const fs::path& file, const std::string& text,
                             const SdfOptions& options, sdf::ParserConfig& config,
                             std::vector<Note>& notes, LaterAttributes& later) {
  tinyxml2::XMLDocument document;
  parse_xml(file, text, document);
  const XMLElement* root = document.RootElement();
  if (!is_sdf_root(root))
    throw InputError(fmt::format("{}: the root element is <{}>; an SDF file has <sdf>",
                                 file.string(), root ? root->Name() : ""));
  int tops = 0;
  for (const XMLElement* e = root->FirstChildElement(); e; e = e->NextSiblingElement())
    if (std::strcmp(e->Name(), "model") == 0 || std::strcmp(e->Name(), "world") == 0) ++tops;
  if (tops > 1)
    throw InputError(
        fmt::format("{}: {} models or worlds; one is expected: put the models into one <world>",
                    file.string(), tops));
  Walk walk(options, config, notes, later);
  walk.read(file, *root);
  walk.check();
  return with_includes_replaced(text, walk.replaced);
}

}  // namespace counterpoint::sdf_file
