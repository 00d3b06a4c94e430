// Checked access to the elements of a Collada file.
#pragma once

#include <tinyxml2.h>

#include <algorithm>
#include <cstring>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace counterpoint {

/// The members after fail() throw like it if an element is not as they describe.
class ColladaReader {
 public:
  using XMLElement = tinyxml2::XMLElement;

  explicit ColladaReader(std::string file) : file_(std::move(file)) {}
  const std::string& file() const { return file_; }

  static bool is_one_of(const XMLElement& element, std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(),
                       [&](const char* name) { return std::strcmp(element.Name(), name) == 0; });
  }

  /// Calls f for each child element with one of the names (for every child if none is given).
  template <typename F>
  static void each(const XMLElement& above, std::initializer_list<const char*> names, F&& f) {
    for (const auto* e = above.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (names.size() == 0 || is_one_of(*e, names)) f(*e);
    }
  }

  /// Rejects the file because of an element. @throws InputError always, with file and line.
  [[noreturn]] void fail(const XMLElement& at, const std::string& what) const;

  /// Checks that there are only child elements with these names, <extra> and <technique>; the
  /// latter two are for programs that know them.
  void expect_only(const XMLElement& above, std::initializer_list<const char*> names) const;

  /// The only child element with a name; null if there is none.
  const XMLElement* only(const XMLElement& above, const char* name) const;
  /// The only child element with a name, which must exist.
  const XMLElement& the(const XMLElement& above, const char* name) const;

  /// The text of an element without child elements.
  std::string text(const XMLElement& in) const;
  /// The text of an element as decimal numbers.
  std::vector<double> reals(const XMLElement& in) const;
  std::vector<long> integers(const XMLElement& in) const;

  /// An attribute with a count, 0 to 1e9; `otherwise` if it is missing.
  long count(const XMLElement& in, const char* name, long otherwise) const;
  /// The id that an attribute refers to in this file: its text after the '#'.
  std::string reference(const XMLElement& in, const char* name) const;

 private:
  std::string file_;
};

}  // namespace counterpoint
