// An MJCF file with what it includes, replicates and attaches, and its values with their defaults.
// Format: "XML Reference" of MuJoCo's documentation.
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

/// More numbers than any list of fixed length has.
inline constexpr std::size_t kMaxNumbers = 1000;

/// The elements of a file: those of included files in their places, replicas and attached models
/// written out.
class Document {
 public:
  /// @throws InputError as Sources::load, and for replicas and attachments that cannot be.
  Document(const std::filesystem::path& file, const MjcfOptions& options);
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  const Element& root() const { return *root_; }
  const std::filesystem::path& file() const { return file_; }
  const MjcfOptions& options() const { return options_; }

  /// The model that an element was written in: 0 is the outermost file's, others are attached.
  int model_of(const Element& element) const { return sources_.model_of(element); }
  /// Is a model another one, or attached within it?
  bool is_within(int model, int outer) const;
  /// What the <compiler> of its model says, and the folder of that model's file.
  const Compiler& compiler(const Element& element) const {
    return models_[model_of(element)].compiler;
  }
  std::filesystem::path folder(const Element& element) const {
    return models_[model_of(element)].file.parent_path();
  }

  /// The elements within one, in order.
  std::vector<const Element*> children(const Element& element) const;
  /// Of all sections of this name below the root, in order.
  std::vector<const Element*> sections(const char* name) const;
  std::vector<const Element*> section_children(const char* name) const;

  /// "FILE:LINE: <joint> 'elbow'".
  std::string where(const Element& element) const { return sources_.where(element); }
  [[noreturn]] void fail(const Element& element, const std::string& what) const {
    sources_.fail(element, what);
  }
  /// A fault, unless the caller left out what `word` names; then a note.
  void refuse(const Element& element, LeaveOut word, const std::string& what);
  void note(const Element& element, const std::string& what);
  /// Attributes beyond these are refused: they could change the motion.
  void expect(const Element& element, std::initializer_list<const char*> known) const;

  /// Reads one element after the other; what is wrong with one does not keep the others from being
  /// read.
  template <class Read>
  void each(const std::vector<const Element*>& elements, Read&& read) {
    for (const Element* e : elements) faults.collect([&] { read(*e); });
  }

  std::vector<Note> notes;
  Faults faults;  ///< of what was read so far

 private:
  friend class Expansion;
  struct ModelFile {
    std::filesystem::path file;
    int outer = -1;  ///< the model that it is attached to
    Compiler compiler;
  };
  std::filesystem::path file_;
  const MjcfOptions& options_;
  Sources sources_;
  std::vector<ModelFile> models_;
  std::set<std::string> noted_;  ///< copies of an element have one note
  Element* root_ = nullptr;
};

/// The values of one element: its own, else those of its class, else of the class above.
class Values {
 public:
  Values(const Document& document, const Element& element)
      : document_(&document), levels_{&element} {}
  void add_level(const Element& defaults) { levels_.push_back(&defaults); }

  const Element& element() const { return *levels_.front(); }
  bool has(const char* name) const { return level_of(name) != nullptr; }
  /// Where a value stands; null: nowhere.
  const Element* level_of(const char* name) const;
  /// The first level that has one of these.
  const Element* level_of_any(std::initializer_list<const char*> names) const;
  std::string text(const char* name, const std::string& otherwise = "") const;
  double number(const char* name, double otherwise) const;
  std::optional<double> number(const char* name) const;
  int integer(const char* name, int otherwise) const;
  bool boolean(const char* name, bool otherwise) const;
  /// `least` to `most` numbers; none if there is no such value.
  std::vector<double> numbers(const char* name, std::size_t least, std::size_t most) const;
  Vector3 vector(const char* name, const Vector3& otherwise) const;
  /// One of these words; `otherwise` if there is no such value.
  std::string word(const char* name, std::initializer_list<const char*> words,
                   const char* otherwise) const;
  const Document& document() const { return *document_; }

 private:
  const Document* document_;
  std::vector<const Element*> levels_;
};

}  // namespace counterpoint::mjcf
