// The files of an MJCF model as one tree of elements, each of which knows where it was written.
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

  /// The root of a file as an element of its own, which nothing holds yet, with what it includes in
  /// the places of its <include>s. `model`: 0 for the outermost file, else the number of an
  /// attachment (Document::model_of). A file may be loaded several times. @throws InputError with
  /// file and line for what is no XML, no <mujoco>, or includes a file that is missing, twice
  /// included, or outside the folders that the file may reach (find_mesh).
  Element& load(const std::filesystem::path& file, int model);
  /// A new element written where `like` was.
  Element& make(const char* name, const Element& like);
  /// A copy, with all within it.
  Element& copy(const Element& element);

  /// The number that its file was loaded with.
  int model_of(const Element& element) const { return origin_.at(&element).model; }
  /// "FILE:LINE: <joint> 'elbow'", the name as the file has it: the same of all copies.
  std::string where(const Element& element) const;
  [[noreturn]] void fail(const Element& element, const std::string& what) const;

 private:
  struct Origin {
    int file = 0, model = 0;
    const Element* written = nullptr;  ///< as the file has it
  };
  struct File {
    std::filesystem::path path;
    std::unique_ptr<tinyxml2::XMLDocument> xml;
  };
  struct Loading {
    std::filesystem::path folder;
    int model = 0;
    std::vector<int> files;  ///< each once
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
  std::size_t size_ = 0, copied_ = 0;  ///< elements and attributes of files, of copies
};

/// The name of an element, or "".
std::string name_of(const Element& element);

}  // namespace counterpoint::mjcf
