// Exception for scenes with features that another engine lacks.
#pragma once

#include <stdexcept>

namespace counterpoint::peers {

/// The scene needs a feature that the other engine lacks; the message names it.
class NotExpressible : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace counterpoint::peers
