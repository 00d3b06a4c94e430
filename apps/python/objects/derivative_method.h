// Names of the methods for derivatives.
#pragma once

#include <string>

#include "counterpoint/engine/derivatives.h"
#include "words.h"

namespace counterpoint::python {

inline const char* method_name(DerivativeMethod method) {
  switch (method) {
    case DerivativeMethod::kAnalytic:
      return "analytic";
    case DerivativeMethod::kCentralDifferences:
      return "central_differences";
    case DerivativeMethod::kExtrapolated:
      return "extrapolated";
  }
  return "";
}

/// @throws py::value_error listing the permitted words.
inline DerivativeMethod method_from(const std::string& word) {
  constexpr int kNumMethods = 3;
  return from_word<DerivativeMethod>(
      word, "method",
      [](const std::string& w) { return find_word<DerivativeMethod>(w, method_name, kNumMethods); },
      method_name, kNumMethods);
}

}  // namespace counterpoint::python
