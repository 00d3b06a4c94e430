// Gazebo's plugins that drive a joint, as actuators of a scene.
#pragma once

#include <functional>

#include "counterpoint/model/sdf/document.h"

namespace counterpoint::sdf_file {

/// Adds the actuator that acts as a <plugin> of a model does, or a note that none does. `named`
/// gives the scene's name of a joint. @throws InputError for a value that is no number.
void read_motor(Document& document, const sdf::ElementPtr& plugin,
                const std::function<std::string(const std::string&)>& named,
                std::vector<ActuatorSpec>& out);

}  // namespace counterpoint::sdf_file
