// Enumerations as the words used in scene files.
#pragma once

#include <optional>
#include <string>

#include "bindings.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint::python {

/// Converts a word to an enumerator. @throws py::value_error "'blunt': expected 'convex', 'lagged'
/// or 'coulomb'".
template <class Enum, class FromName, class ToName>
Enum from_word(const std::string& word, const char* what, FromName from_name, ToName to_name,
               int count) {
  if (const std::optional<Enum> found = from_name(word)) return *found;
  std::string message = std::string(what) + " '" + word + "': expected ";
  for (int i = 0; i < count; ++i)
    message += (i == 0           ? "'"
                : i + 1 == count ? " or '"
                                 : ", '") +
               std::string(to_name(static_cast<Enum>(i))) + "'";
  throw py::value_error(message);
}

/// Inverts a naming function by search.
template <class Enum, class ToName>
std::optional<Enum> find_word(const std::string& word, ToName to_name, int count) {
  for (int i = 0; i < count; ++i)
    if (word == to_name(static_cast<Enum>(i))) return static_cast<Enum>(i);
  return std::nullopt;
}

/// Base type of a robot: 'fixed', 'floating' or 'spherical'.
inline Base base_from(const std::string& word) {
  const auto name = [](Base base) {
    return base == Base::kFixed ? "fixed" : base == Base::kFloating ? "floating" : "spherical";
  };
  return from_word<Base>(
      word, "base", [&](const std::string& w) { return find_word<Base>(w, name, 3); }, name, 3);
}

}  // namespace counterpoint::python
