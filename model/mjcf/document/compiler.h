// <compiler>: unit of angles, conventions of orientations, rules for inertias.
#pragma once

#include <optional>
#include <string>

#include "counterpoint/model/spatial.h"

namespace tinyxml2 {
class XMLElement;
}

namespace counterpoint::mjcf {

class Document;
class Values;

struct Compiler {
  enum class InertiaFromGeom { kNever, kAlways, kAuto };

  double angle_unit = 0.017453292519943295;  ///< [rad] per unit of the file; default degrees
  std::string euler_sequence = "xyz";
  bool auto_limits = true;
  std::string mesh_folder;  ///< relative to the file
  bool strip_path = false;
  InertiaFromGeom inertia_from_geom = InertiaFromGeom::kAuto;
  int first_inertia_group = 0, last_inertia_group = 5;
  bool balance_inertia = false;
  double least_mass = 0.0, least_inertia = 0.0;  ///< [kg], [kg m^2]
  double total_mass = -1.0;                      ///< [kg]; not positive: masses are not scaled
  bool fit_aabb = false;
  bool align_free = false;
  bool merge_options = false;  ///< conflict="merge" for attached models
};

/// Reads the <compiler> sections below the root of one model. @throws InputError for conventions
/// that are not supported (coordinate="global").
Compiler read_compiler(Document& document, const tinyxml2::XMLElement& root);

/// Rotation by Euler angles in the unit of the file, in the order of euler_sequence.
Matrix3 from_euler(const std::vector<double>& angles, const Compiler& compiler);
/// The orientation that an element gives by quat, axisangle, xyaxes, zaxis or euler, in the
/// conventions of its model; nothing if it gives none.
std::optional<Matrix3> orientation_of(const Values& values);
/// Pose from the orientation and pos of an element.
Pose pose_of(const Values& values);

/// Rotation by the smallest angle that takes z to a unit vector; for -z it is about x.
Matrix3 shortest_from_z(const Vector3& v);
/// Rotation matrix of a quaternion (w, x, y, z), normalized here; it must not be zero.
Matrix3 rotation_of(const double* quaternion);

}  // namespace counterpoint::mjcf
