// Curves beside a replay.
#pragma once

#include <string>
#include <vector>

#include "view/clip.h"

namespace counterpoint::view {

/// A curve. Curves of one group share a plot.
struct Curve {
  std::string group, label, unit;
  std::vector<double> values;  ///< one per frame
  int ghost = -1;              ///< index of the ghost it belongs to, or -1
};

/// Groups of curves that are shown at first, if there are any.
inline constexpr const char* kEnergyGroup = "energy";
inline constexpr const char* kContactForceGroup = "contact force";

/// Units of the coordinate, velocity and force of a joint with one coordinate.
struct JointUnits {
  const char *q, *v, *force;
};
JointUnits joint_units(JointType type);

/// Returns curves of energies, contact forces, closure forces and Newton iterations if known; for
/// models of up to kMaxCoordinates also every coordinate, velocity and applied force. Ghosts
/// contribute the coordinates of joints with a single one, interpolated at the clip's times.
std::vector<Curve> curves_of(const Model& model, const Clip& clip, const std::vector<Clip>& ghosts);

/// Limit on nq + nv: for larger models the page offers only the positions it reads off the poses.
inline constexpr int kMaxCoordinates = 400;

/// Returns the groups shown at first.
std::vector<std::string> first_groups(const std::vector<Curve>& curves);

}  // namespace counterpoint::view
