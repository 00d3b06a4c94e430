// Shapes and surfaces.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cctype>
#include <optional>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model.h"
#include "objects/arrays.h"
#include "objects/exceptions.h"
#include "objects/geometry_words.h"
#include "objects/properties.h"

namespace counterpoint::python {
namespace {

double positive(double x, const char* name) {
  if (x > 0.0 && std::isfinite(x)) return x;
  throw py::value_error(std::string(name) + ": expected a positive length [m], found " +
                        std::to_string(x));
}

Shape plain(ShapeType type, const Vector3& size) {
  Shape shape;
  shape.type = type;
  shape.size = size;
  return shape;
}

MeshKind mesh_kind(const std::string& name) {
  if (const auto kind = mesh_kind_from_name(name)) return *kind;
  throw py::value_error("kind: expected 'auto', 'hull' or 'pieces', found '" + name + "'");
}

Shape hull(const Array& points) {
  const auto rows = matrix(points, -1, 3, "points");
  std::vector<Vector3> list;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) list.emplace_back(rows.row(i));
  const py::gil_scoped_release release;
  return {ShapeType::kConvexMesh, Vector3::Zero(), make_convex_hull(list)};
}

Shape terrain(const Array& vertices,
              const py::array_t<int, py::array::c_style | py::array::forcecast>& triangles) {
  TriangleMesh mesh;
  const auto points = matrix(vertices, -1, 3, "vertices");
  for (Eigen::Index i = 0; i < points.rows(); ++i) mesh.vertices.emplace_back(points.row(i));
  check_shape(triangles, {-1, 3}, "triangles");
  for (py::ssize_t i = 0; i < triangles.shape(0); ++i)
    mesh.triangles.push_back({triangles.at(i, 0), triangles.at(i, 1), triangles.at(i, 2)});
  const py::gil_scoped_release release;
  return {ShapeType::kTerrain, Vector3::Zero(), nullptr, make_terrain(mesh)};
}

Shape terrain_of(const TriangleMesh& mesh, const std::filesystem::path& file) {
  return {ShapeType::kTerrain, Vector3::Zero(), nullptr, make_terrain(mesh, file.string())};
}

Shape triangle_mesh(const std::filesystem::path& file, const Array& scale) {
  const Vector3 factors = vector3(scale, "scale");
  return reading(file, [&] { return terrain_of(load_mesh(file, factors), file); });
}

/// Height field as in scene files: an image needs `height`, the height of white; a table must not
/// have it.
Shape height_field(const std::filesystem::path& file, std::pair<double, double> size,
                   std::optional<double> height) {
  positive(size.first, "size"), positive(size.second, "size");
  std::string kind = file.extension().string();
  for (char& c : kind) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (kind != ".png" && kind != ".csv")
    throw py::value_error("file: expected a .png image or a .csv table of heights, found '" +
                          file.string() + "'");
  if ((kind == ".png") != height.has_value())
    throw py::value_error(kind == ".png" ? "height: an image needs that of white [m]"
                                         : "height: those of a table are in metres; leave it out");
  return reading(file, [&] {
    const HeightGrid grid = height ? load_height_image(file) : load_height_table(file);
    return terrain_of(
        height_field_mesh(grid, size.first, size.second, height.value_or(1.0), file.string()),
        file);
  });
}

py::array vertices(const Shape& shape) {
  const std::vector<Vector3>* list = shape.mesh      ? &shape.mesh->vertices
                                     : shape.terrain ? &shape.terrain->vertices
                                                     : nullptr;
  if (list == nullptr) return py::array_t<double>(Shape1{0, 3});
  const auto count = static_cast<py::ssize_t>(list->size());
  const py::capsule owner = shape.mesh ? keep(std::shared_ptr<const void>(shape.mesh))
                                       : keep(std::shared_ptr<const void>(shape.terrain));
  return view(list->front().data(), {count, 3}, {3, 1}, owner);
}

// Long: one list of properties.
void bind_material(py::module_& m) {
  py::class_<Material>(m, "Material", R"(
Surface material. Two surfaces combine to the geometric mean of their frictions and the larger
restitution, torsional and rolling friction.

Parameters
----------
friction : float
    Coulomb's coefficient of sliding [-].
restitution : float
    Newton's, 0 to 1 [-].
static_friction : float
    Coefficient at rest [-]; friction where that is larger.
stribeck_speed : float
    Sliding speed at which 1 / e of the excess of static friction is left [m/s].
stiffness : float, optional
    Of a contact point [N/m]; None: as hard as the compliance of the scene. Two surfaces are springs
    in series.
damping, dissipation : float
    Of a contact point with finite stiffness: linear [N s/m]; Hunt and Crossley's [s/m].
stiffness_per_area, damping_per_area : float, optional
    The same of flat contacts, shared among the points of a patch [N/m^3, N s/m^3]; in place of
    stiffness and damping.
friction_axis : array_like, shape (3,), optional
    Direction in the frame of the shape along which friction acts; zero: all are alike.
friction_across : float
    Coefficient across friction_axis [-].
surface_velocity : array_like, shape (3,), optional
    Of the surface relative to its body (a belt), in the frame of the shape [m/s]; its part along
    the normal does not count.
torsional_friction, rolling_friction : float
    Torque about the normal, or rolling, over normal force [m].
)")
      .def(py::init([](double friction, double restitution, double torsional, double rolling,
                       double at_rest, double stribeck_speed, std::optional<double> stiffness,
                       double damping, double dissipation, const std::optional<Array>& axis,
                       double across, std::optional<double> stiffness_per_area,
                       double damping_per_area, const std::optional<Array>& velocity) {
             Material out{friction, restitution, torsional, rolling, at_rest, stribeck_speed};
             out.stiffness = stiffness.value_or(out.stiffness);
             out.damping = damping;
             out.per_area.stiffness = stiffness_per_area.value_or(out.per_area.stiffness);
             out.per_area.damping = damping_per_area;
             (stiffness_per_area ? out.per_area.dissipation : out.dissipation) = dissipation;
             if (axis) out.friction_axis = vector3(*axis, "friction_axis");
             out.friction_across = across;
             if (velocity) out.surface_velocity = vector3(*velocity, "surface_velocity");
             return out;
           }),
           py::arg("friction") = 0.8, py::arg("restitution") = 0.0,
           py::arg("torsional_friction") = 0.0, py::arg("rolling_friction") = 0.0,
           py::arg("static_friction") = 0.0, py::arg("stribeck_speed") = 0.01,
           py::arg("stiffness") = py::none(), py::arg("damping") = 0.0,
           py::arg("dissipation") = 0.0, py::arg("friction_axis") = py::none(),
           py::arg("friction_across") = 0.0, py::arg("stiffness_per_area") = py::none(),
           py::arg("damping_per_area") = 0.0, py::arg("surface_velocity") = py::none())
      .def_property(
          "stiffness_per_area", [](const Material& x) { return x.per_area.stiffness; },
          [](Material& x, double value) { x.per_area.stiffness = value; },
          "[N/m^3]; infinite: hard.")
      .def_property(
          "damping_per_area", [](const Material& x) { return x.per_area.damping; },
          [](Material& x, double value) { x.per_area.damping = value; }, "[N s/m^3]")
      .def_readwrite("stiffness", &Material::stiffness, "[N/m]; infinite: hard.")
      .def_readwrite("damping", &Material::damping, "[N s/m]")
      .def_readwrite("dissipation", &Material::dissipation, "Hunt and Crossley's [s/m].")
      .def_readwrite("friction", &Material::friction, "Sliding [-].")
      .def_readwrite("restitution", &Material::restitution, "Newton's, 0 to 1 [-].")
      .def_readwrite("torsional_friction", &Material::torsional_friction, "[m]")
      .def_readwrite("rolling_friction", &Material::rolling_friction, "[m]")
      .def_readwrite("static_friction", &Material::static_friction,
                     "At rest [-]; friction where that is larger.")
      .def_readwrite("stribeck_speed", &Material::stribeck_speed, "[m/s]")
      .def_property(
          "friction_axis", [](const Material& x) { return for_python(x.friction_axis); },
          [](Material& x, const Array& axis) { x.friction_axis = vector3(axis, "friction_axis"); },
          "In the frame of the shape.")
      .def_readwrite("friction_across", &Material::friction_across, "Across friction_axis [-].")
      .def_property(
          "surface_velocity", [](const Material& x) { return for_python(x.surface_velocity); },
          [](Material& x, const Array& v) { x.surface_velocity = vector3(v, "surface_velocity"); },
          "Relative to the body, in the frame of the shape [m/s].")
      .def("__repr__", [](const Material& x) {
        return py::str(
                   "Material(friction={:g}, restitution={:g}, torsional_friction={:g}, "
                   "rolling_friction={:g})")
            .format(x.friction, x.restitution, x.torsional_friction, x.rolling_friction);
      });
}

}  // namespace

constexpr const char* kShapeDoc = R"(
A collision shape in its own frame. Made by the functions below, one a type.)";

constexpr const char* kTerrainDoc = R"(
Static triangles that push bodies off the side from which they run counter-clockwise.

Parameters
----------
vertices : array_like, shape (n, 3)
    [m]
triangles : array_like of int, shape (m, 3)
    Indices into vertices.
)";

constexpr const char* kHeightFieldDoc = R"(
Terrain from a grid of heights, about the origin.

Parameters
----------
file : path
    A grayscale image (.png, black 0) or a table of heights [m] (.csv), row 0 at the largest y.
size : (float, float)
    Along x and y [m].
height : float, optional
    Of white [m]; for images only.
)";

void bind_shape_properties(py::class_<Shape>& shape) {
  shape
      .def_property_readonly(
          "type", [](const Shape& s) { return shape_type_name(s.type); },
          "plane, sphere, box, capsule, cylinder, convex_mesh or terrain.")
      .def_property_readonly(
          "size", [](const Shape& s) { return copy(VectorX(s.size)); },
          "By type [m], shape (3,): half lengths of a box, (radius, half length) of the round "
          "ones.")
      .def_property_readonly("vertices", &vertices,
                             "Of a hull or terrain [m], shape (n, 3), read-only; else empty.")
      .def(
          "inertia", [](const Shape& s, double mass) { return solid_inertia(s, mass); },
          py::arg("mass"),
          "SpatialInertia of a solid of uniform density and this mass [kg]: sphere, box, cylinder, "
          "capsule.")
      .def("__repr__", [](const Shape& s) {
        return py::str("<Shape {} {}>").format(shape_type_name(s.type), copy(VectorX(s.size)));
      });
}

void bind_shapes(py::module_& m) {
  py::class_<Shape> shape(m, "Shape", kShapeDoc);
  shape
      .def_static(
          "plane", [] { return plain(ShapeType::kPlane, Vector3::Zero()); },
          "The half-space z <= 0, outward normal +z.")
      .def_static(
          "sphere",
          [](double r) { return plain(ShapeType::kSphere, Vector3(positive(r, "radius"), 0, 0)); },
          py::arg("radius"), "A ball about the origin, radius [m].")
      .def_static(
          "box",
          [](double x, double y, double z) {
            return plain(ShapeType::kBox,
                         0.5 * Vector3(positive(x, "x"), positive(y, "y"), positive(z, "z")));
          },
          py::arg("x"), py::arg("y"), py::arg("z"), "A box about the origin; its edges [m].")
      .def_static(
          "capsule",
          [](double r, double length) {
            return plain(ShapeType::kCapsule,
                         Vector3(positive(r, "radius"), 0.5 * positive(length, "length"), 0));
          },
          py::arg("radius"), py::arg("length"),
          "A segment of this length along z about the origin, thick by the radius [m].")
      .def_static(
          "cylinder",
          [](double r, double length) {
            return plain(ShapeType::kCylinder,
                         Vector3(positive(r, "radius"), 0.5 * positive(length, "length"), 0));
          },
          py::arg("radius"), py::arg("length"), "Along z about the origin [m].")
      .def_static(
          "convex_hull", &hull, py::arg("points"),
          "The hull of points [m], shape (n, 3). Raises InputError where they span no volume.")
      .def_static(
          "convex_mesh",
          [](const std::filesystem::path& file, const Array& scale, const std::string& kind,
             double tolerance, int most) {
            const Vector3 factors = vector3(scale, "scale");
            const MeshCollision collision{mesh_kind(kind), tolerance, most};
            return reading(file, [&] {
              return Shape{ShapeType::kConvexMesh, Vector3::Zero(),
                           load_convex_mesh(file, factors, collision)};
            });
          },
          py::arg("file"), py::arg("scale") = py::make_tuple(1, 1, 1), py::arg("kind") = "auto",
          py::arg("tolerance") = 0.0, py::arg("most") = 256,
          "A mesh file: STL, OBJ or DAE. kind: 'hull', its convex hull; 'pieces', at most `most` "
          "convex pieces that stand off it by at most tolerance [m], 0: 2 % of its diameter; "
          "'auto', pieces where the hull is far off.")
      .def_static("terrain", &terrain, py::arg("vertices"), py::arg("triangles"), kTerrainDoc)
      .def_static("triangle_mesh", &triangle_mesh, py::arg("file"),
                  py::arg("scale") = py::make_tuple(1, 1, 1),
                  "Terrain from a mesh file: STL, OBJ or DAE.")
      .def_static("height_field", &height_field, py::arg("file"), py::arg("size"),
                  py::arg("height") = py::none(), kHeightFieldDoc);
  bind_shape_properties(shape);
  bind_material(m);
}

}  // namespace counterpoint::python
