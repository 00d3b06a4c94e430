#include "counterpoint/model/mjcf/document/sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::mjcf {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxDepth = 100;          // levels of nested elements
constexpr std::size_t kMaxFiles = 200;  // files included and attached
/// Elements and attributes of replicas, about 250 bytes of memory each.
constexpr std::size_t kMaxCopied = 1'000'000;

}  // namespace

std::string name_of(const Element& element) {
  const char* name = element.Attribute("name");
  return name ? name : "";
}

int Sources::open(const fs::path& path) {
  std::error_code error;
  for (std::size_t i = 0; i < files_.size(); ++i)
    if (fs::equivalent(files_[i].path, path, error)) return static_cast<int>(i);
  if (files_.size() == kMaxFiles)
    throw InputError(
        fmt::format("{}: more than {} files are included or attached", path.string(), kMaxFiles));
  auto xml = std::make_unique<tinyxml2::XMLDocument>();
  parse_xml_file(path, "there is no such file", *xml);
  files_.push_back({path, std::move(xml)});
  return static_cast<int>(files_.size()) - 1;
}

Element& Sources::load(const fs::path& file, int model) {
  const int index = open(file);
  const Element* root = files_[index].xml->RootElement();
  if (root == nullptr || std::strcmp(root->Name(), "mujoco") != 0)
    throw InputError(
        fmt::format("{}: the root element is <{}>; <mujoco> is expected of an MJCF file",
                    file.string(), root ? root->Name() : ""));
  Loading loading{file.parent_path(), model, {index}};
  Element& out = shallow(*root, {index, model, root});
  copy_contents(*root, index, 0, loading, out);
  return out;
}

void Sources::copy_contents(const Element& from, int file, int depth, Loading& loading,
                            Element& into) {
  if (depth > kMaxDepth)
    throw InputError(place(from, file) +
                     fmt::format(": nested deeper than {} elements", kMaxDepth));
  for (const Element* e = from.FirstChildElement(); e; e = e->NextSiblingElement()) {
    if (std::strcmp(e->Name(), "include") == 0) {
      int index = 0;
      const Element& root = included(*e, file, loading, index);
      copy_contents(root, index, depth + 1, loading, into);
      continue;
    }
    Element& made = shallow(*e, {file, loading.model, e});
    into.InsertEndChild(&made);
    copy_contents(*e, file, depth + 1, loading, made);
  }
}

const Element& Sources::included(const Element& include, int file, Loading& loading, int& index) {
  const std::string where = place(include, file);
  const char* name = include.Attribute("file");
  if (name == nullptr || *name == '\0')
    throw InputError(where + ": file: the name of a file is expected");
  const fs::path path =
      find_mesh(name, loading.folder, options_.packages, where, "included file").file;
  index = open(path);
  if (std::find(loading.files.begin(), loading.files.end(), index) != loading.files.end())
    throw InputError(fmt::format("{}: file '{}' is included a second time", where, name));
  loading.files.push_back(index);
  const Element* root = files_[index].xml->RootElement();
  if (root != nullptr) return *root;
  throw InputError(fmt::format("{}: file '{}' holds no element", where, name));
}

Element& Sources::shallow(const Element& from, const Origin& origin) {
  Element* made = tree_.NewElement(from.Name());
  origin_[made] = origin;
  ++size_;
  for (const auto* a = from.FirstAttribute(); a; a = a->Next()) {
    made->SetAttribute(a->Name(), a->Value());
    ++size_;
  }
  check_size(*made);
  return *made;
}

void Sources::check_size(const Element& made) const {
  if (size_ <= limits::kMaxXmlMarks && copied_ <= kMaxCopied) return;
  fail(made, fmt::format("the model has more than {} elements and attributes with all that is "
                         "included and attached, or more than {} of replicas; make it smaller",
                         limits::kMaxXmlMarks, kMaxCopied));
}

Element& Sources::make(const char* name, const Element& like) {
  Element* made = tree_.NewElement(name);
  origin_[made] = origin_.at(&like);
  ++copied_;
  check_size(*made);
  return *made;
}

Element& Sources::copy(const Element& element) {
  const std::size_t before = size_;
  Element& made = shallow(element, origin_.at(&element));
  copied_ += size_ - before;
  size_ = before;
  check_size(made);
  for (const Element* e = element.FirstChildElement(); e; e = e->NextSiblingElement())
    made.InsertEndChild(&copy(*e));
  return made;
}

std::string Sources::place(const Element& written, int file) const {
  const std::string name = name_of(written);
  return fmt::format("{}:{}: <{}>{}", files_[file].path.string(), written.GetLineNum(),
                     written.Name(), name.empty() ? "" : " '" + name + "'");
}

std::string Sources::where(const Element& element) const {
  const Origin& origin = origin_.at(&element);
  return place(*origin.written, origin.file);
}

void Sources::fail(const Element& element, const std::string& what) const {
  throw InputError(where(element) + ": " + what);
}

}  // namespace counterpoint::mjcf
