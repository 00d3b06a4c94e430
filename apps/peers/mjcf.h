// A scene as MJCF, MuJoCo's own format, by the names of the scene. The joints have the order of the
// model, so that coordinates have the same indices.
#pragma once

#include <string>

#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::peers {

/// Effects that are active in a scene. Effects that are switched off are left out of the MJCF.
EffectSet effects_of(const Scene& scene);

/// True if the body has a free joint in MuJoCo. Floating joints within a tree become three slides
/// and a ball.
bool is_free(const Body& body);

/// Returns the document. <size> is left out, to be inserted after the first line, and so are the
/// values that are set in the compiled model: settings of the solver, effort limits, second anchors
/// and lengths of closures, drag. @throws NotExpressible
std::string mjcf(const Scene& scene);

}  // namespace counterpoint::peers
