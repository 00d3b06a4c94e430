// The files of an MJCF model as one tree of elements with their source locations.
#pragma once

#include <tinyxml2.h>

#include <filesystem>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "counterpoint/model/robot_files.h"

namespace counterpoint::mjcf {

using Element = tinyxml2::XMLElement;

class Sources {
 public:
  explicit Sources(const MjcfOptions& options) : options_(options) {}

  /// Loads a file and returns its root, which has no parent yet, with each <include> replaced by
  /// the contents of its file. `model`: 0 for the outermost file, else the index of an attached
  /// model (Document::model_of). A file may be loaded several times. @throws InputError with file
  /// and line for malformed XML, a root other than <mujoco>, and included files that are missing,
  /// included twice, or outside the folders that the file may reach (find_mesh).
  Element& load(const std::filesystem::path& file, int model);
  /// Makes an element with the source location of `like`.
  Element& make(const char* name, const Element& like);
  /// Copies an element with its descendants.
  Element& copy(const Element& element);

  /// The model index that the element's file was loaded with.
  int model_of(const Element& element) const { return origin_.at(&element).model; }
  /// Location for messages: "FILE:LINE: <joint> 'elbow'", with the name in the file, before
  /// renaming.
  std::string where(const Element& element) const;
  [[noreturn]] void fail(const Element& element, const std::string& what) const;

 private:
  struct Origin {
    int file = 0, model = 0;
    const Element* written = nullptr;  ///< the element in the file
  };
  struct File {
    std::filesystem::path path;
    std::unique_ptr<tinyxml2::XMLDocument> xml;
  };
  struct Loading {
    std::filesystem::path folder;
    int model = 0;
    std::vector<int> files;  ///< files included so far
  };
  int open(const std::filesystem::path& path);
  Element& shallow(const Element& from, const Origin& origin);
  void copy_contents(const Element& from, int file, int depth, Loading& loading, Element& into);
  const Element& included(const Element& include, int file, Loading& loading, int& index);
  void check_size(const Element& made) const;
  std::string place(const Element& written, int file) const;

  const MjcfOptions& options_;
  std::vector<File> files_;
  tinyxml2::XMLDocument tree_;
  std::unordered_map<const Element*, Origin> origin_;
  std::size_t size_ = 0, copied_ = 0;  ///< elements and attributes of the files; of copies
};

/// The name attribute of an element, or "".
std::string name_of(const Element& element);

}  // namespace counterpoint::mjcf
