// A scene as MJCF, MuJoCo's own format: bodies b1, b2, ... and geometries g0, g1, ... by index,
// joints in the order of ours, so that coordinates are numbered alike.
#pragma once

#include <string>

#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"
#include "mujoco.h"

namespace counterpoint::peers {

/// The effects that run in a scene. Those that are switched off are left out of the MJCF.
EffectSet effects_of(const Scene& scene);

/// Has it a free joint in MuJoCo? Floating joints within a tree become three slides and a ball.
bool is_free(const Body& body);

/// The whole document but for <size>, which goes behind its first line. `integrator`: as the
/// version of MuJoCo names the one that kBest is to use. Free bodies start where the scene puts
/// them, other joints at zero. @throws NotExpressible.
std::string mjcf(const Scene& scene, MujocoSettings settings, const std::string& integrator);

}  // namespace counterpoint::peers
