// URDF elements that urdfdom does not read, or rejects, read directly from the XML.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

/// Surface values that a file gives; the others are empty.
struct SurfaceValues {
  std::optional<double> friction, restitution, torsional_friction, rolling_friction;
  std::optional<double> stiffness;          ///< Gazebo's kp [N/m], where is_spring
  double damping = 0.0;                     ///< Gazebo's kd [N s/m], with stiffness
  double friction_across = 0.0;             ///< with `friction` and an axis
  Vector3 friction_axis = Vector3::Zero();  ///< Material::friction_axis; zero: none
  /// These values; missing ones from `base`.
  Material over(const Material& base) const;
};

struct UrdfXml {
  struct Collision {
    SurfaceValues surface;  ///< Drake's proximity properties
    bool capsule = false;   ///< a cylinder in `standard_xml`
    bool convex = false;    ///< Drake's <drake:declare_convex>: the mesh collides as its hull
  };
  struct Link {
    int line = 0;
    SurfaceValues surface;  ///< Bullet's <contact>, Gazebo's mu1
    std::vector<Collision> collisions;
    SpatialInertia further_inertia;  ///< sum of all <inertial> but the first
  };
  struct Joint {
    int line = 0;
    bool spherical = false;  ///< floating in `standard_xml`
    double armature = 0.0;   ///< Drake: rotor inertia times gear ratio squared [kg m^2]
    bool bounded = true;     ///< <limit> gives lower or upper
    bool effort_limited = true, velocity_limited = true;  ///< <limit> gives effort, velocity
  };
  std::vector<std::string> link_names, joint_names;  ///< in file order
  std::map<std::string, Link> links;
  std::map<std::string, Joint> joints;
  std::vector<Note> notes;   ///< elements that affect the motion but are not used
  std::string standard_xml;  ///< the robot in URDF that urdfdom accepts, without visuals
};

/// Reads a URDF file. @throws InputError with file and line if the file is missing, larger than 64
/// MB, malformed XML, nested deeper than 100 elements, or if its root is not <robot>.
UrdfXml read_urdf_xml(const std::filesystem::path& file);

}  // namespace counterpoint
