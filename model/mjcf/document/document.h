// An MJCF file with what it includes, and its values with their defaults. Format: "XML Reference"
// of MuJoCo's documentation.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "counterpoint/model/robot_files.h"

namespace tinyxml2 {
class XMLDocument;
class XMLElement;
}  // namespace tinyxml2

namespace counterpoint::mjcf {

using Element = tinyxml2::XMLElement;

/// More numbers than any list of fixed length has.
inline constexpr std::size_t kMaxNumbers = 1000;

/// The elements of a file, those of included files in their places.
class Document {
 public:
  /// @throws InputError with file and line for what is no XML, no <mujoco>, or includes a file that
  /// is missing, twice included, or outside the folders that the file may reach (find_mesh).
  Document(const std::filesystem::path& file, const MjcfOptions& options);
  ~Document();
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  const Element& root() const { return *root_; }
  const std::filesystem::path& file() const { return file_; }
  std::filesystem::path folder() const { return file_.parent_path(); }
  const MjcfOptions& options() const { return options_; }

  /// The elements within one, in order.
  std::vector<const Element*> children(const Element& element) const;
  /// Of all sections of this name below the root, in order.
  std::vector<const Element*> sections(const char* name) const;
  std::vector<const Element*> section_children(const char* name) const;

  /// "FILE:LINE: <joint> 'elbow'".
  std::string where(const Element& element) const;
  [[noreturn]] void fail(const Element& element, const std::string& what) const;
  /// Throws unless the caller left out what `word` names; then it is noted.
  void refuse(const Element& element, LeaveOut word, const std::string& what);
  void note(const Element& element, const std::string& what);
  /// Attributes beyond these are refused: they could change the motion.
  void expect(const Element& element, std::initializer_list<const char*> known) const;

  std::vector<Note> notes;

 private:
  void load_includes(const Element& element, int depth);

  struct File {
    std::filesystem::path path;
    std::unique_ptr<tinyxml2::XMLDocument> xml;
  };
  std::filesystem::path file_;
  const MjcfOptions& options_;
  const Element* root_ = nullptr;
  std::vector<File> files_;
  std::map<const Element*, const Element*> included_;  ///< <include> to the root of what it names
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

/// The name of an element, or "".
std::string name_of(const Element& element);

}  // namespace counterpoint::mjcf
