// The XML side of URDF: what urdfdom does not read, or would refuse, found in a pass of our own.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

/// Surface values as far as a file gives them.
struct SurfaceValues {
  std::optional<double> friction, restitution, torsional_friction, rolling_friction;
  /// Those given here, the rest from `base`.
  Material over(const Material& base) const;
};

struct UrdfXml {
  struct Collision {
    SurfaceValues surface;  ///< Drake's proximity properties
    bool capsule = false;   ///< stands as a cylinder in `standard_xml`
  };
  struct Link {
    int line = 0;
    SurfaceValues surface;  ///< Bullet's <contact>, Gazebo's mu1
    std::vector<Collision> collisions;
    SpatialInertia further_inertia;  ///< of a second <inertial> and more; urdfdom reads the first
  };
  struct Joint {
    int line = 0;
    bool spherical = false;  ///< stands as floating in `standard_xml`
    double armature = 0.0;   ///< Drake: rotor inertia times gear ratio squared
    bool bounded = true;     ///< <limit> gives lower or upper
    bool effort_limited = true, velocity_limited = true;  ///< <limit> gives effort, velocity
  };
  std::vector<std::string> link_names, joint_names;  ///< in file order
  std::map<std::string, Link> links;
  std::map<std::string, Joint> joints;
  std::vector<Note> notes;   ///< what was found and is not used though it bears on the motion
  std::string standard_xml;  ///< the robot in URDF as urdfdom knows it, without visuals
};

/// @throws InputError with file and line when the file is missing, larger than 64 MB, not
/// well-formed XML, nested deeper than 100 elements, or its root is not <robot>.
UrdfXml read_urdf_xml(const std::filesystem::path& file);

}  // namespace counterpoint
