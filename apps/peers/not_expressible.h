// Thrown where a scene needs what another engine lacks.
#pragma once

#include <stdexcept>

namespace counterpoint::peers {

/// The scene holds something that the peer lacks; the message says what.
class NotExpressible : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace counterpoint::peers
