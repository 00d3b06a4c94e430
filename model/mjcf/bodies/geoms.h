// <geom>: shapes that touch, and what they weigh.
#pragma once

#include <optional>
#include <string>

#include "counterpoint/model/mjcf/bodies/assets.h"

namespace counterpoint::mjcf {

struct Geom {
  const Element* element = nullptr;
  std::string name;                ///< as in the file; may be empty
  int body = 0;                    ///< index into Bodies
  std::string type;                ///< "sphere" ...
  Vector3 size = Vector3::Zero();  ///< as MuJoCo has it [m]
  Pose X_BG;
  std::string mesh, field;
  bool fitted = false;   ///< a primitive fitted to a mesh
  bool fit_box = false;  ///< to the box around the mesh, else to that of its inertia
  double fit_scale = 1.0;
  bool shell = false;  ///< its mass lies in its surface
  bool ellipsoid_in_fluid = false;
  int contype = 1, conaffinity = 1, condim = 3, group = 0, priority = 0;
  double slide = 1.0, spin = 0.005, roll = 0.0001;
  std::optional<double> mass;  ///< [kg]
  double density = 1000.0;     ///< [kg/m^3]
  std::string collision;       ///< name as a geometry of the model: "link/name"

  /// Friction of surfaces that meet in `dimensions` directions.
  Material material(int dimensions) const;
};

/// `X_BF`: of <frame> elements around it.
Geom read_geom(const Values& values, const Pose& X_BF, int body);

/// With the size and place of what it is fitted to; itself if it is fitted to nothing.
Geom resolved(const Geom& geom, Assets& assets, Document& document);

/// Of a geom that is resolved. @throws InputError for types and sizes that cannot be.
Shape shape_of(const Geom& geom, Assets& assets, Document& document);

/// In the body's frame; of zero mass for planes and height fields.
SpatialInertia inertia_of(const Geom& geom, Assets& assets, Document& document);

}  // namespace counterpoint::mjcf
