#include "counterpoint/model/mjcf/bodies/geoms.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include "counterpoint/model/mesh/round_hull.h"
#include "counterpoint/model/model.h"

namespace counterpoint::mjcf {
namespace {

/// Number of sizes of a primitive, 0 for other types. With fromto the last size is half the length
/// of the segment.
int num_sizes(const std::string& type) {
  if (type == "sphere") return 1;
  if (type == "capsule" || type == "cylinder") return 2;
  if (type == "box" || type == "ellipsoid") return 3;
  return 0;
}

void place_along(const Values& v, const std::vector<double>& ends, Geom& geom) {
  if (num_sizes(geom.type) < 2)
    v.document().fail(v.element(),
                      fmt::format("fromto: a {} has no length; a capsule, cylinder, box or "
                                  "ellipsoid is expected",
                                  geom.type));
  const Vector3 from(ends[0], ends[1], ends[2]), to(ends[3], ends[4], ends[5]);
  const double length = (from - to).norm();
  if (!(length > 1e-15))
    v.document().fail(v.element(), "fromto: two different points are expected");
  geom.X_BG = {shortest_from_z((from - to) / length), 0.5 * (from + to)};
  const int along = num_sizes(geom.type) - 1;
  if (along == 2) geom.size[1] = geom.size[0];
  geom.size[along] = 0.5 * length;
}

ShapeType primitive_type(const std::string& type) {
  if (type == "sphere") return ShapeType::kSphere;
  if (type == "capsule") return ShapeType::kCapsule;
  if (type == "cylinder") return ShapeType::kCylinder;
  return ShapeType::kBox;
}

/// Fits a primitive to a mesh: to the box with the inertia of the mesh, or (fit_box) to the
/// bounding box along the principal axes of inertia.
Geom fit(const Geom& fitted, Assets& assets, Document& document) {
  const MassProperties unit = assets.mesh_mass(fitted.mesh, *fitted.element);
  if (!(unit.mass > 0.0))
    document.fail(*fitted.element, "fitted to a mesh that encloses no volume");
  // The smallest moment is about the longest axis, which becomes z.
  const PrincipalAxes principal = principal_axes(unit.rotational);
  Pose X_MF{Matrix3::Identity(), unit.center};
  X_MF.rotation << principal.axes.col(2), -principal.axes.col(1), principal.axes.col(0);
  Geom geom = fitted;
  geom.fitted = false;
  Vector3 half;
  if (fitted.fit_box) {
    Eigen::AlignedBox3d box;
    const Pose X_FM = X_MF.inverse();
    for (const Vector3& p : assets.triangles(fitted.mesh, *fitted.element).vertices)
      box.extend(X_FM * p);
    X_MF.translation = X_MF * Vector3(box.center());
    half = 0.5 * box.sizes();
  } else {
    const Vector3 moments = principal.moments.reverse();
    const Vector3 squares = 1.5 / unit.mass * (Vector3::Constant(moments.sum()) - 2.0 * moments);
    half = squares.cwiseMax(0.0).cwiseSqrt();
  }
  half *= fitted.fit_scale;
  geom.X_BG = fitted.X_BG * X_MF;
  geom.size = half;
  const bool box = fitted.fit_box;
  const double across = box ? std::max(half[0], half[1]) : 0.5 * (half[0] + half[1]);
  if (geom.type == "sphere") geom.size = Vector3::Constant(box ? half.maxCoeff() : half.mean());
  if (geom.type == "capsule")
    geom.size = {across, std::max(0.0, half[2] - (box ? 1.0 : 0.5) * across), 0.0};
  if (geom.type == "cylinder") geom.size = {across, half[2], 0.0};
  return geom;
}

}  // namespace

Material ContactParameters::hard() const {
  Material m;
  m.friction = condim >= 3 ? slide : 0.0;
  m.torsional_friction = condim >= 4 ? spin : 0.0;
  m.rolling_friction = condim >= 6 ? roll : 0.0;
  return m;
}

void ContactParameters::read(const Values& v) {
  condim = v.integer("condim", condim);
  if (condim != 1 && condim != 3 && condim != 4 && condim != 6)
    v.document().fail(v.element(), "condim: 1, 3, 4 or 6 is expected");
  const std::vector<double> reference = v.numbers("solref", 1, 2);
  std::copy(reference.begin(), reference.end(), solref.data());
  const std::vector<double> impedance = v.numbers("solimp", 1, 5);
  std::copy_n(impedance.begin(), std::min<std::size_t>(impedance.size(), 3), solimp.data());
}

Geom read_geom(const Values& v, const Pose& X_BF, int body) {
  const Document& document = v.document();
  document.expect(
      v.element(),
      {"name",         "class",    "type",      "contype",    "conaffinity", "condim", "group",
       "priority",     "size",     "material",  "rgba",       "friction",    "mass",   "density",
       "shellinertia", "solmix",   "solref",    "solimp",     "margin",      "gap",    "fromto",
       "pos",          "quat",     "axisangle", "xyaxes",     "zaxis",       "euler",  "hfield",
       "mesh",         "fitscale", "user",      "fluidshape", "fluidcoef"});
  Geom geom;
  geom.element = &v.element();
  geom.name = name_of(v.element());
  geom.body = body;
  geom.type = v.word(
      "type",
      {"plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"},
      "sphere");
  const std::vector<double> size = v.numbers("size", 1, 3);
  std::copy(size.begin(), size.end(), geom.size.data());
  geom.X_BG = pose_of(v);
  if (const auto ends = v.numbers("fromto", 6, 6); !ends.empty()) place_along(v, ends, geom);
  geom.X_BG = X_BF * geom.X_BG;
  geom.mesh = v.text("mesh");
  geom.field = v.text("hfield");
  geom.fitted = !geom.mesh.empty() && geom.type != "mesh" && geom.type != "sdf";
  geom.fit_scale = v.number("fitscale", 1.0);
  geom.fit_box = document.compiler(v.element()).fit_aabb;
  geom.shell = v.boolean("shellinertia", false);
  geom.ellipsoid_in_fluid = v.text("fluidshape", "none") != "none";
  geom.contype = v.integer("contype", 1);
  geom.conaffinity = v.integer("conaffinity", 1);
  geom.contact.read(v);
  geom.contact.solmix = v.number("solmix", 1.0);
  geom.group = v.integer("group", 0);
  geom.priority = v.integer("priority", 0);
  const std::vector<double> friction = v.numbers("friction", 1, 3);
  if (!friction.empty()) geom.contact.slide = friction[0];
  if (friction.size() > 1) geom.contact.spin = friction[1];
  if (friction.size() > 2) geom.contact.roll = friction[2];
  geom.mass = v.number("mass");
  geom.density = v.number("density", 1000.0);
  if (geom.density < 0.0 || geom.mass.value_or(0.0) < 0.0)
    document.fail(v.element(), "mass and density must not be negative");
  return geom;
}

Geom resolved(const Geom& geom, Assets& assets, Document& document) {
  if (!geom.fitted) return geom;
  if (num_sizes(geom.type) > 0) return fit(geom, assets, document);
  document.fail(*geom.element,
                fmt::format("a {} fitted to a mesh is not supported where it touches; give its "
                            "size and take mesh away",
                            geom.type));
}

Shape shape_of(const Geom& geom, Assets& assets, Document& document) {
  const Element& element = *geom.element;
  if (geom.type == "plane") return {ShapeType::kPlane, Vector3::Zero(), nullptr};
  if (geom.type == "mesh")
    return {ShapeType::kConvexMesh, Vector3::Zero(), assets.hull(geom.mesh, element)};
  if (geom.type == "hfield")
    return {ShapeType::kTerrain, Vector3::Zero(), nullptr,
            assets.height_field(geom.field, element)};
  const int sizes = num_sizes(geom.type);
  if (sizes == 0)
    document.fail(element, fmt::format("geoms of type {} are not supported", geom.type));
  for (int i = 0; i < sizes; ++i) {
    if (geom.size[i] > 0.0) continue;
    document.fail(element, fmt::format("size: a {} needs {} positive number{}", geom.type, sizes,
                                       sizes > 1 ? "s" : ""));
  }
  Vector3 size = Vector3::Zero();
  size.head(sizes) = geom.size.head(sizes);
  if (geom.type != "ellipsoid") return {primitive_type(geom.type), size, nullptr};
  const RoundHull round = ellipsoid_hull(size);
  document.note(element, round_hull_note(round));
  return {ShapeType::kConvexMesh, Vector3::Zero(), round.hull};
}

SpatialInertia inertia_of(const Geom& geom, Assets& assets, Document& document) {
  if (geom.type == "plane" || geom.type == "hfield") return {};
  if (geom.mass ? *geom.mass == 0.0 : geom.density == 0.0) return {};
  if (geom.fitted || geom.type == "sdf")
    document.fail(*geom.element,
                  "the body's inertia depends on a shape that is not supported; give "
                  "the body an <inertial>");
  if (geom.shell)
    document.fail(*geom.element,
                  "shellinertia is not supported; of a mesh give the asset "
                  "inertia=\"shell\", else the body an <inertial>");
  if (geom.type == "mesh") {
    const MassProperties unit = assets.mesh_mass(geom.mesh, *geom.element);
    if (!(unit.mass > 0.0))
      document.fail(
          *geom.element,
          fmt::format("mesh '{}' encloses no volume; give the body an <inertial>", geom.mesh));
    const double density = geom.mass ? *geom.mass / unit.mass : geom.density;
    return SpatialInertia{density * unit.mass, unit.center, density * unit.rotational}.transformed(
        geom.X_BG);
  }
  if (geom.type == "ellipsoid") {
    const MassProperties unit = ellipsoid_mass(geom.size);
    const double density = geom.mass ? *geom.mass / unit.mass : geom.density;
    return SpatialInertia{density * unit.mass, Vector3::Zero(), density * unit.rotational}
        .transformed(geom.X_BG);
  }
  const Shape shape{primitive_type(geom.type), geom.size, nullptr};
  return solid_inertia(shape, geom.mass.value_or(geom.density * solid_volume(shape)))
      .transformed(geom.X_BG);
}

}  // namespace counterpoint::mjcf
