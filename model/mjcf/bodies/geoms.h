// <geom>: shapes for collision and inertia.
#pragma once

#include <optional>
#include <string>

#include "counterpoint/model/mjcf/bodies/assets.h"

namespace counterpoint::mjcf {

/// Parameters of a contact, with MuJoCo's defaults for geoms and pairs.
struct ContactParameters {
  int condim = 3;
  double slide = 1.0, spin = 0.005, roll = 0.0001;
  Eigen::Vector2d solref{0.02, 1.0};  ///< negative form: -stiffness [1/s^2], -damping [1/s]
  Vector3 solimp{0.9, 0.95, 0.001};   ///< impedance at the surface, at the width [-]; width [m]
  double solmix = 1.0;                ///< weight of solref and solimp [-]

  /// Whether solref has its negative form, with a stiffness.
  bool is_spring() const { return solref[0] < 0.0 && solref[1] <= 0.0; }
  /// The surface with the friction that condim gives, hard.
  Material hard() const;
  /// Reads condim, solref and solimp.
  void read(const Values& values);
};

struct Geom {
  const Element* element = nullptr;
  std::string name;                ///< in the file; may be empty
  int body = 0;                    ///< index into Bodies::bodies
  std::string type;                ///< "sphere", "box", ...
  Vector3 size = Vector3::Zero();  ///< radius and half lengths in MuJoCo's order [m]
  Pose X_BG;
  std::string mesh, field;
  bool fitted = false;   ///< a primitive fitted to a mesh
  bool fit_box = false;  ///< fitted to the bounding box, else to the box of its inertia
  double fit_scale = 1.0;
  bool shell = false;  ///< the mass lies in the surface
  bool ellipsoid_in_fluid = false;
  int contype = 1, conaffinity = 1, group = 0, priority = 0;
  ContactParameters contact;
  std::optional<double> mass;  ///< [kg]
  double density = 1000.0;     ///< [kg/m^3]
  std::string collision;       ///< name of the geometry in the model: "link/name"
};

/// `X_BF`: pose of the enclosing <frame> elements in the frame of the body.
Geom read_geom(const Values& values, const Pose& X_BF, int body);

/// The geom with the size and pose fitted to its mesh; unchanged if it is not fitted.
Geom resolved(const Geom& geom, Assets& assets, Document& document);

/// Shape of a resolved geom. @throws InputError for types that are not supported and sizes that are
/// not positive.
Shape shape_of(const Geom& geom, Assets& assets, Document& document);

/// Inertia in the body frame; zero for planes and height fields.
SpatialInertia inertia_of(const Geom& geom, Assets& assets, Document& document);

}  // namespace counterpoint::mjcf
