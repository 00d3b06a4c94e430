// A scene as bytes, all of it, to be read by the same version of this library: for copies in other
// processes. To keep a scene, use scene files.
#pragma once

#include <string>
#include <string_view>

#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Model, start and options, meshes and terrains included (each once).
std::string archive_scene(const Scene& scene);

/// The same scene: equal bits in every figure. @throws InputError for bytes that archive_scene of
/// this version has not written, or that are cut short.
Scene restore_scene(std::string_view bytes);

}  // namespace counterpoint
