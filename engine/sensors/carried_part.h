// A link with all that hangs on it: the part of a tree whose weight and motion a wrench on the link
// carries.
#pragma once

#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// The part that begins with a link. Links welded together are one body, so the part is a share of
/// the link's body and whole bodies beyond.
struct CarriedPart {
  int body = 0;          ///< body of the link; 0: welded to the world, or the scene
  bool welded = false;   ///< the link hangs on another link of the same body, or on the world
  SpatialInertia share;  ///< inertia of the part's links of that body, in the body frame
  /// Bodies whose joints hang on those links; each stands for its whole subtree.
  std::vector<int> children;
  std::vector<char> has_link;  ///< for each of Model::frames: a link of `body` in the part

  /// Whether a force on this link of `body` acts on the part; -1: the link that the joint moves.
  bool holds(int frame) const {
    return frame < 0 ? !welded : has_link[static_cast<std::size_t>(frame)] != 0;
  }
};

/// Returns the part that begins with a link (Model::frames); for -1 all bodies that can move.
CarriedPart carried_part(const Model& model, int frame);

}  // namespace counterpoint
