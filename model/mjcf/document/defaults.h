// Default classes: <default class="...">, childclass and class.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "counterpoint/model/mjcf/document/document.h"

namespace counterpoint::mjcf {

class Defaults {
 public:
  /// Reads all <default> sections; each model has its own top class. @throws InputError for a class
  /// without a name, or given twice with different parents.
  explicit Defaults(const Document& document);

  /// Values of an element, with defaults from its own class, else from `childclass` (set by the
  /// nearest body above that gives one; "": none), else from the top class. `tag`: name of the
  /// elements with its defaults; null: the name of the element.
  Values values(const Element& element, const std::string& childclass,
                const char* tag = nullptr) const;

  /// The elements with one of these tags in the element's class and its parents, top class first.
  std::vector<const Element*> chain(const Element& element, const std::string& childclass,
                                    const std::vector<std::string>& tags) const;

 private:
  struct Class {
    std::string parent;                    ///< "" for a top class
    std::vector<const Element*> elements;  ///< in file order
  };
  void read(const Element& element, const std::string& name, const std::string& parent);
  const Class& class_of(const Element& element, const std::string& childclass) const;

  const Document& document_;
  std::map<int, std::string> top_;  ///< key: index of the model (Document::model_of)
  std::map<std::string, Class> classes_;
};

}  // namespace counterpoint::mjcf
