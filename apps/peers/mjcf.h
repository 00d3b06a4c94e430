// A scene as MJCF, MuJoCo's own format: bodies b1, b2, ... and geometries g0, g1, ... by index,
// joints in the order of the model, so that coordinates have the same indices.
#pragma once

#include <string>

#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"
#include "mujoco.h"

namespace counterpoint::peers {

/// Effects that are active in a scene. Effects that are switched off are left out of the MJCF.
EffectSet effects_of(const Scene& scene);

/// True if the body has a free joint in MuJoCo. Floating joints within a tree become three slides
/// and a ball.
bool is_free(const Body& body);

/// The whole document except <size>, which is inserted after its first line. `integrator`: name of
/// the integrator for kBest in this version of MuJoCo. Free bodies start where the scene puts them,
/// other joints at zero. @throws NotExpressible
std::string mjcf(const Scene& scene, MujocoSettings settings, const std::string& integrator);

}  // namespace counterpoint::peers
