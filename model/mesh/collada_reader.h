// The elements of a Collada file, as they are checked.
#pragma once

#include <tinyxml2.h>

#include <algorithm>
#include <cstring>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace counterpoint {

/// The members below fail() throw as it does, where an element is not what they say.
class ColladaReader {
 public:
  using XMLElement = tinyxml2::XMLElement;

  explicit ColladaReader(std::string file) : file_(std::move(file)) {}
  const std::string& file() const { return file_; }

  static bool is_one_of(const XMLElement& element, std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(),
                       [&](const char* name) { return std::strcmp(element.Name(), name) == 0; });
  }

  /// Calls f with each element below `above` of one of the names (of any name, if none is given).
  template <typename F>
  static void each(const XMLElement& above, std::initializer_list<const char*> names, F&& f) {
    for (const auto* e = above.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (names.size() == 0 || is_one_of(*e, names)) f(*e);
    }
  }

  /// Refuses a file at an element of it. @throws InputError: always, with file and line.
  [[noreturn]] void fail(const XMLElement& at, const std::string& what) const;

  /// There is nothing below but the names, <extra> and <technique>; those are for programs that
  /// know them.
  void expect_only(const XMLElement& above, std::initializer_list<const char*> names) const;

  /// The one element of a name; null if there is none.
  const XMLElement* only(const XMLElement& above, const char* name) const;
  /// The one element of a name.
  const XMLElement& the(const XMLElement& above, const char* name) const;

  /// The text in an element that holds no others.
  std::string text(const XMLElement& in) const;
  /// Its text as decimal numbers.
  std::vector<double> reals(const XMLElement& in) const;
  std::vector<long> integers(const XMLElement& in) const;

  /// An attribute that counts, at most 1e9; `otherwise` if it is not there.
  long count(const XMLElement& in, const char* name, long otherwise) const;
  /// What an attribute names in this file: its text behind the '#'.
  std::string reference(const XMLElement& in, const char* name) const;

 private:
  std::string file_;
};

}  // namespace counterpoint
