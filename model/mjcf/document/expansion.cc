#include "counterpoint/model/mjcf/document/expansion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <set>

#include "counterpoint/model/mjcf/document/document.h"
#include "counterpoint/model/mjcf/document/references.h"

namespace counterpoint::mjcf {
namespace {

constexpr std::size_t kMaxModels = 2000;  // attached models, nested ones included
constexpr int kMaxNested = 20;            // levels of models within models

bool is(const Element& element, const char* name) { return std::strcmp(element.Name(), name) == 0; }

std::vector<Element*> children_of(Element& element) {
  std::vector<Element*> out;
  for (Element* e = element.FirstChildElement(); e; e = e->NextSiblingElement()) out.push_back(e);
  return out;
}

void remove(Element& element) { element.Parent()->DeleteChild(&element); }

/// Inserts a new element after its sibling `at`.
void insert_behind(Element& at, Element& made) { at.Parent()->InsertAfterChild(&at, &made); }

std::string pose_numbers(const Vector3& p) {
  return fmt::format("{:.17g} {:.17g} {:.17g}", p.x(), p.y(), p.z());
}

}  // namespace

/// Expands one model; the models that it attaches are expanded first.
class Expansion {
 public:
  Expansion(Document& document, Element& root, int model)
      : document_(document), root_(root), model_(model) {}

  void expand() {
    document_.models_[model_].compiler = read_compiler(document_, root_);
    for (Element* section : children_of(root_))
      if (is(*section, "worldbody")) expand_contents(*section);
  }

 private:
  /// Expands the children first, so that names of nested replicas get the inner suffix first.
  void expand_contents(Element& element) {
    for (Element* e : children_of(element)) {
      if (is(*e, "body") || is(*e, "frame") || is(*e, "replicate")) expand_contents(*e);
      if (is(*e, "replicate"))
        replicate(*e);
      else if (is(*e, "attach"))
        attach(*e);
    }
  }

  void replicate(Element& e) {
    document_.expect(e, {"count", "sep", "offset", "euler", "childclass"});
    const Values v(document_, e);
    const int count = v.integer("count", 0);
    if (count < 1) document_.fail(e, "count: a positive whole number is expected");
    const Compiler& compiler = document_.compiler(e);
    const Vector3 euler = v.vector("euler", Vector3::Zero()),
                  offset = v.vector("offset", Vector3::Zero());
    const Names inside = names_within(e);
    Vector3 position = Vector3::Zero();
    Element* last = &e;
    const References references = references_to(root_, inside);
    for (int i = 0; i < count; ++i) {
      const Vector3 turned = i * euler;
      const Matrix3 R = from_euler({turned.x(), turned.y(), turned.z()}, compiler);
      const Quaternion q(R);
      Element& frame = document_.sources_.make("frame", e);
      frame.SetAttribute("pos", pose_numbers(position).c_str());
      frame.SetAttribute(
          "quat",
          fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}", q.w(), q.x(), q.y(), q.z()).c_str());
      if (const char* childclass = e.Attribute("childclass"))
        frame.SetAttribute("childclass", childclass);
      for (Element* part : children_of(e)) frame.InsertEndChild(&document_.sources_.copy(*part));
      // The index is padded with zeros to the number of digits of the count.
      const std::string number = std::to_string(i), digits = std::to_string(count);
      const std::string suffix =
          v.text("sep") + std::string(digits.size() - number.size(), '0') + number;
      rename_all(frame, references.names, "", suffix);
      insert_behind(*last, frame);
      last = &frame;
      copy_references(references, "", suffix);
      position += R * offset;
    }
    for (Element* original : references.elements) remove(*original);
    remove(e);
  }

  /// Copies the elements outside the bodies that refer to copied names, to the end of their
  /// sections.
  void copy_references(const References& references, const std::string& prefix,
                       const std::string& suffix) {
    for (Element* original : references.elements) {
      Element& made = document_.sources_.copy(*original);
      original->Parent()->InsertEndChild(&made);  // first: the section gives the kind of its name
      rename_all(made, references.names, prefix, suffix);
    }
  }

  void attach(Element& e) {
    document_.expect(e, {"model", "body", "frame", "prefix"});
    const Values v(document_, e);
    if (!v.has("prefix"))
      document_.fail(e, "prefix: what goes before the names of the attached model is expected");
    if (v.has("body") && v.has("frame"))
      document_.fail(e, "a body or a frame is expected, not both");
    if (v.has("model"))
      attach_model(e, v);
    else
      attach_own(e, v);
    remove(e);
  }

  /// Attaches another copy of a body or frame of this model.
  void attach_own(Element& e, const Values& v) {
    const char* kind = v.has("body") ? "body" : "frame";
    if (!v.has(kind)) document_.fail(e, "model, or a body or frame of this model, is expected");
    Element& target = named(e, root_, kind, v.text(kind));
    for (const tinyxml2::XMLNode* up = &e; up; up = up->Parent())
      if (up == &target)
        document_.fail(e,
                       fmt::format("{} '{}' cannot be attached within itself", kind, v.text(kind)));
    const References references = references_to(root_, names_within(target, true));
    Element& frame = document_.sources_.make("frame", e);
    if (const std::string around = class_around(target, ""); !around.empty())
      frame.SetAttribute("childclass", around.c_str());
    frame.InsertEndChild(&document_.sources_.copy(target));
    rename_all(frame, references.names, v.text("prefix"), "");
    insert_behind(e, frame);
    copy_references(references, v.text("prefix"), "");
    expand_contents(frame);  // the target may stand behind e, not expanded yet
  }

  void attach_model(Element& e, const Values& v) {
    const int number = static_cast<int>(document_.models_.size());
    int depth = 0;
    for (int outer = model_; outer >= 0; outer = document_.models_[outer].outer) ++depth;
    if (depth > kMaxNested || document_.models_.size() > kMaxModels)
      document_.fail(
          e, fmt::format("models attached within models more than {} deep, or more than {} models",
                         kMaxNested, kMaxModels));
    const std::filesystem::path file = file_of(e, v.text("model"));
    document_.models_.push_back({file, model_, {}});
    Element& other = document_.sources_.load(file, number);
    Expansion(document_, other, number).expand();
    const std::string prefix = v.text("prefix"), top = prefix + name_top_class(other, number);
    complete_names(other);
    prefix_all(other, prefix);
    Element& frame = document_.sources_.make("frame", e);
    frame.SetAttribute("childclass", top.c_str());
    const char* kind = v.has("body") ? "body" : v.has("frame") ? "frame" : nullptr;
    if (kind == nullptr) {
      for (Element* section : children_of(other))
        if (is(*section, "worldbody"))
          for (Element* part : children_of(*section)) frame.InsertEndChild(part);
    } else {
      Element& target = named(e, other, kind, prefix + v.text(kind));
      frame.SetAttribute("childclass", class_around(target, top).c_str());
      frame.InsertEndChild(&target);
    }
    insert_behind(e, frame);
    if (kind != nullptr) remove_dangling(other, names_within(frame));
    for (Element* section : children_of(other)) {
      if (is(*section, "option") && document_.compiler(root_).merge_options)
        document_.fail(*section,
                       "conflict=\"merge\": options of attached models are not merged; "
                       "write them into the model that attaches");
      if (is(*section, "option"))
        document_.note(*section,
                       "of an attached model: the options of the model that attaches it count");
      for (const char* name :
           {"default", "asset", "contact", "equality", "tendon", "actuator", "sensor", "keyframe"})
        if (is(*section, name)) {
          root_.InsertEndChild(section);
          break;
        }
    }
  }

  /// Name of the top default class of an attached model, which gets an empty one if it has none.
  /// Its elements keep these defaults after they are moved.
  std::string name_top_class(Element& root, int model) {
    std::string top;
    for (Element* section : children_of(root)) {
      if (!is(*section, "default") || document_.model_of(*section) != model) continue;
      if (section->Attribute("class") == nullptr) section->SetAttribute("class", "main");
      if (top.empty()) top = section->Attribute("class");
    }
    if (!top.empty()) return top;
    Element& made = document_.sources_.make("default", root);
    made.SetAttribute("class", "main");
    root.InsertFirstChild(&made);
    return "main";
  }

  /// The file of the model asset with this name.
  std::filesystem::path file_of(const Element& e, const std::string& model) {
    std::string known;
    for (Element* section : children_of(root_)) {
      if (!is(*section, "asset")) continue;
      for (Element* asset : children_of(*section)) {
        if (!is(*asset, "model")) continue;
        document_.expect(*asset, {"name", "file", "content_type"});
        const Values v(document_, *asset);
        if (!v.has("file")) document_.fail(*asset, "file: the name of a file is expected");
        const std::filesystem::path file =
            find_mesh(v.text("file"), document_.folder(*asset), document_.options().packages,
                      document_.where(*asset), "model")
                .file;
        std::string name = v.text("name");
        if (name.empty()) {
          const Element& root = document_.sources_.load(file, document_.model_of(*asset));
          name = Values(document_, root).text("model");
        }
        if (name == model) return file;
        known += (known.empty() ? "" : ", ") + name;
      }
    }
    document_.fail(e, fmt::format("model: there is no model '{}' among the assets; models: {}",
                                  model, known.empty() ? "none" : known));
  }

  /// The body or frame with this name below <worldbody>.
  Element& named(const Element& user, Element& root, const char* kind, const std::string& name) {
    std::vector<Element*> open;
    for (Element* section : children_of(root))
      if (is(*section, "worldbody")) open.push_back(section);
    while (!open.empty()) {
      Element& at = *open.back();
      open.pop_back();
      if (is(at, kind) && name_of(at) == name) return at;
      for (Element* e : children_of(at)) open.push_back(e);
    }
    document_.fail(user, fmt::format("{}: there is no {} '{}' in the model", kind, kind, name));
  }

  /// The childclass in force at an element.
  static std::string class_around(const Element& element, const std::string& otherwise) {
    for (const tinyxml2::XMLNode* up = element.Parent(); up && up->ToElement(); up = up->Parent())
      if (const char* name = up->ToElement()->Attribute("childclass")) return name;
    return otherwise;
  }

  Document& document_;
  Element& root_;
  const int model_;
};

void expand(Document& document) {
  Expansion(document, const_cast<Element&>(document.root()), 0).expand();
}

}  // namespace counterpoint::mjcf
