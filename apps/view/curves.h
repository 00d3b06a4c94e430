// The curves beside a replay.
#pragma once

#include <string>
#include <vector>

#include "view/clip.h"

namespace counterpoint::view {

/// Curves of one group are drawn over each other.
struct Curve {
  std::string group, label, unit;
  std::vector<double> values;  ///< one a frame
  int ghost = -1;              ///< that it is of
};

/// Energies, contact forces, Newton iterations where they are known, and of models of up to
/// kMaxCoordinates every coordinate, velocity and applied force; of ghosts the coordinates of
/// joints that have one, at the clip's times.
std::vector<Curve> curves_of(const Model& model, const Clip& clip, const std::vector<Clip>& ghosts);

/// nq + nv, beyond which coordinates are left to what the page reads off the poses.
inline constexpr int kMaxCoordinates = 400;

/// The groups that are shown at first, of those that there are.
std::vector<std::string> first_groups(const std::vector<Curve>& curves);

}  // namespace counterpoint::view
