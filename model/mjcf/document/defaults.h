// Default classes: <default class="...">, childclass and class.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "counterpoint/model/mjcf/document/document.h"

namespace counterpoint::mjcf {

class Defaults {
 public:
  /// Reads all <default> sections; each model has a top class of its own. @throws InputError for a
  /// class without a name, given twice with different parents.
  explicit Defaults(const Document& document);

  /// The values of an element: its own class, else `childclass` (of the nearest body that gives
  /// one;
  /// "": none), else the top class. `tag`: under which its defaults stand, its own if null.
  Values values(const Element& element, const std::string& childclass,
                const char* tag = nullptr) const;

  /// The defaults of a class under any of these tags, from the top class to this one.
  std::vector<const Element*> chain(const Element& element, const std::string& childclass,
                                    const std::vector<std::string>& tags) const;

 private:
  struct Class {
    std::string parent;                    ///< "": none
    std::vector<const Element*> elements;  ///< in order
  };
  void read(const Element& element, const std::string& name, const std::string& parent);
  const Class& class_of(const Element& element, const std::string& childclass) const;

  const Document& document_;
  std::map<int, std::string> top_;  ///< by the model that elements were written in
  std::map<std::string, Class> classes_;
};

}  // namespace counterpoint::mjcf
