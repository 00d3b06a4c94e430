// An MJCF file with its included, replicated and attached parts, and attribute values with
// defaults. Format: "XML Reference" of MuJoCo's documentation.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "counterpoint/model/mjcf/document/compiler.h"
#include "counterpoint/model/mjcf/document/sources.h"
#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::mjcf {

/// Longer than any list of fixed length: a larger bound means "or more" in messages.
inline constexpr std::size_t kMaxNumbers = 1000;

/// The elements of a file, with <include>, <replicate> and <attach> expanded.
class Document {
 public:
  /// @throws InputError as Sources::load, and for replicas and attachments that are not possible.
  Document(const std::filesystem::path& file, const MjcfOptions& options);
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  const Element& root() const { return *root_; }
  const std::filesystem::path& file() const { return file_; }
  const MjcfOptions& options() const { return options_; }

  /// Index of the model that contains an element: 0 for the outermost file, others are attached.
  int model_of(const Element& element) const { return sources_.model_of(element); }
  /// Whether `model` is `outer` or attached within it.
  bool is_within(int model, int outer) const;
  /// The <compiler> settings of the element's model. folder() is the folder of that model's file.
  const Compiler& compiler(const Element& element) const {
    return models_[model_of(element)].compiler;
  }
  std::filesystem::path folder(const Element& element) const {
    return models_[model_of(element)].file.parent_path();
  }

  /// The child elements, in order.
  std::vector<const Element*> children(const Element& element) const;
  /// All sections with this name below the root, in order. section_children() returns their child
  /// elements.
  std::vector<const Element*> sections(const char* name) const;
  std::vector<const Element*> section_children(const char* name) const;

  /// Location for messages: "FILE:LINE: <joint> 'elbow'".
  std::string where(const Element& element) const { return sources_.where(element); }
  [[noreturn]] void fail(const Element& element, const std::string& what) const {
    sources_.fail(element, what);
  }
  /// Adds a fault, or a note if the options leave out the feature `word`.
  void refuse(const Element& element, LeaveOut word, const std::string& what);
  void note(const Element& element, const std::string& what);
  /// @throws InputError for attributes other than `known`, since they could change the motion.
  void expect(const Element& element, std::initializer_list<const char*> known) const;

  /// Calls `read` for each element; an error in one does not prevent reading the others.
  template <class Read>
  void each(const std::vector<const Element*>& elements, Read&& read) {
    for (const Element* e : elements) faults.collect([&] { read(*e); });
  }

  std::vector<Note> notes;
  Faults faults;  ///< faults found so far

 private:
  friend class Expansion;
  struct ModelFile {
    std::filesystem::path file;
    int outer = -1;  ///< index of the model that it is attached to
    Compiler compiler;
  };
  std::filesystem::path file_;
  const MjcfOptions& options_;
  Sources sources_;
  std::vector<ModelFile> models_;
  std::set<std::string> noted_;  ///< keys of the notes: copies of an element share one
  Element* root_ = nullptr;
};

/// Attribute values of one element: its own, else those of its default class and its parents.
class Values {
 public:
  Values(const Document& document, const Element& element)
      : document_(&document), levels_{&element} {}
  void add_level(const Element& defaults) { levels_.push_back(&defaults); }

  const Element& element() const { return *levels_.front(); }
  bool has(const char* name) const { return level_of(name) != nullptr; }
  /// The element or default that gives a value; null if there is none.
  const Element* level_of(const char* name) const;
  /// The first element or default that gives one of these values; null if there is none.
  const Element* level_of_any(std::initializer_list<const char*> names) const;
  std::string text(const char* name, const std::string& otherwise = "") const;
  double number(const char* name, double otherwise) const;
  std::optional<double> number(const char* name) const;
  int integer(const char* name, int otherwise) const;
  bool boolean(const char* name, bool otherwise) const;
  /// A list of `least` to `most` numbers; empty if the attribute is missing.
  std::vector<double> numbers(const char* name, std::size_t least, std::size_t most) const;
  /// A list of `least` to `most` whole numbers; empty if the attribute is missing.
  std::vector<int> integers(const char* name, std::size_t least, std::size_t most) const;
  Vector3 vector(const char* name, const Vector3& otherwise) const;
  /// One of `words`; `otherwise` if the attribute is missing.
  std::string word(const char* name, std::initializer_list<const char*> words,
                   const char* otherwise) const;
  const Document& document() const { return *document_; }

 private:
  const Document* document_;
  std::vector<const Element*> levels_;
};

}  // namespace counterpoint::mjcf
