// Pose and velocity of a link by name.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

/// Pose and velocity of a frame F (a link as its URDF has it, a named body of a scene) in the
/// world W.
struct FrameMotion {
  Pose X_WF;                 ///< where the frame's origin is [m], and its orientation
  Vector3 velocity;          ///< of the frame's origin, axes of W [m/s]
  Vector3 angular_velocity;  ///< axes of W [rad/s]
};

/// That of the named frame at a state; links merged into others by fixed joints have theirs too.
/// Allocates: meant for looking at a state, not for inner loops. @throws InputError if the model
/// has no such frame, naming those that are nearly called so, or where sizes are not the model's.
FrameMotion frame_motion(const Model& model, const State& state, const std::string& name);

/// Those of all Model::frames(), in their order.
std::vector<FrameMotion> frame_motions(const Model& model, const State& state);

}  // namespace counterpoint
