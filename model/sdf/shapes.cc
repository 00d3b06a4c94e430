#include "counterpoint/model/sdf/shapes.h"

#include <fmt/format.h>

#include <sdf/Box.hh>
#include <sdf/Capsule.hh>
#include <sdf/Cylinder.hh>
#include <sdf/Ellipsoid.hh>
#include <sdf/Link.hh>
#include <sdf/Plane.hh>
#include <sdf/Sphere.hh>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/mesh/mesh_mass.h"
#include "counterpoint/model/mesh/round_hull.h"
#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::sdf_file {
namespace {

constexpr double kPi = 3.14159265358979323846;
/// Gazebo's default for <threshold>: no impact is that fast, so that nothing bounces.
constexpr double kNeverBounces = 1e5;  // [m/s]

/// Default of <max_convex_hulls>, and the largest number taken.
constexpr double kMostHulls = 16.0, kMostPieces = 4096.0;

Shape simple(ShapeType type, const Vector3& size) { return {type, size, nullptr}; }

}  // namespace

ShapeReader::ShapeReader(Document& document)
    : document_(document),
      hulls_(document.options().hulls ? document.options().hulls : std::make_shared<HullCache>()) {}

void ShapeReader::load_ahead(const std::vector<const sdf::Model*>& models) {
  std::vector<HullCache::MeshFile> meshes;
  for (const sdf::Model* model : models) list_meshes(*model, false, meshes);
  hulls_->load_ahead(meshes);
}

void ShapeReader::list_meshes(const sdf::Model& model, bool is_static,
                              std::vector<HullCache::MeshFile>& out) {
  is_static = is_static || model.Static();
  for (std::uint64_t l = 0; l < model.LinkCount(); ++l) {
    const sdf::Link& link = *model.LinkByIndex(l);
    for (std::uint64_t c = 0; c < link.CollisionCount(); ++c) {
      const sdf::Collision& collision = *link.CollisionByIndex(c);
      if (collision.Geom()->Type() != sdf::GeometryType::MESH) continue;
      const sdf::Mesh& mesh = *collision.Geom()->MeshShape();
      const sdf::ElementPtr element = collision.Element();
      try {
        out.push_back(
            mesh_file(path_of(mesh.Uri(), element, "mesh").file, mesh, element, is_static));
      } catch (const InputError&) {  // read() says where
      }
    }
  }
  for (std::uint64_t i = 0; i < model.ModelCount(); ++i)
    list_meshes(*model.ModelByIndex(i), is_static, out);
}

CollisionRead ShapeReader::read(const sdf::Collision& in, bool is_static,
                                const std::optional<double>& density) {
  const sdf::ElementPtr element = in.Element();
  document_.pass_over_all_but(element, {"pose", "geometry", "surface", "max_contacts",
                                        "laser_retro", "density", "auto_inertia_params"});
  CollisionRead out;
  out.element = element;
  const sdf::ElementPtr contact = Document::child(Document::child(element, "surface"), "contact");
  if (Document::child(contact, "collide_bitmask"))
    out.bitmask = contact->GetElement("collide_bitmask")->Get<unsigned>() & 0xffffU;
  else
    out.touches = !Document::flag(contact, "collide_without_contact", false);
  out.touches = out.touches && out.bitmask != 0;
  if (!out.touches && !density) return out;
  const auto [shape, X_CS] = shape_of(*in.Geom(), element, is_static);
  const Pose X_LC = document_.resolve(in.SemanticPose(), "", element);
  if (density) {
    const double own = Document::later_number(element, "density").value_or(*density);
    if (!(own > 0.0)) document_.fail(element, fmt::format("<density> {} is not positive", own));
    const SpatialInertia unit = unit_inertia(*in.Geom(), element, shape, X_CS);
    out.inertia =
        SpatialInertia{own * unit.mass, unit.center, own * unit.rotational}.transformed(X_LC);
  }
  if (!out.touches) return out;
  out.collision.name = in.Name();
  out.collision.shape = shape;
  out.collision.X_LG = X_LC * X_CS;
  read_surface(element, out);
  Vector3& axis = out.collision.material.friction_axis;
  axis = X_CS.rotation.transpose() * axis;
  return out;
}

std::pair<Shape, Pose> ShapeReader::shape_of(const sdf::Geometry& in,
                                             const sdf::ElementPtr& element, bool is_static) {
  const auto radius = [&](const auto& shape) -> Vector3 {
    return {shape.Radius(), 0.5 * shape.Length(), 0};
  };
  Pose X_CS;
  switch (in.Type()) {
    case sdf::GeometryType::BOX:
      return {simple(ShapeType::kBox, 0.5 * to_vector(in.BoxShape()->Size())), X_CS};
    case sdf::GeometryType::SPHERE:
      return {simple(ShapeType::kSphere, {in.SphereShape()->Radius(), 0, 0}), X_CS};
    case sdf::GeometryType::CYLINDER:
      return {simple(ShapeType::kCylinder, radius(*in.CylinderShape())), X_CS};
    case sdf::GeometryType::CAPSULE:
      return {simple(ShapeType::kCapsule, radius(*in.CapsuleShape())), X_CS};
    case sdf::GeometryType::ELLIPSOID: {
      const Vector3 axes = to_vector(in.EllipsoidShape()->Radii());
      if (!(axes.minCoeff() > 0.0))
        document_.fail(element, "radii: three positive numbers are expected");
      const RoundHull round = ellipsoid_hull(axes);
      document_.note(element, round_hull_note(round));
      return {Shape{ShapeType::kConvexMesh, Vector3::Zero(), round.hull}, X_CS};
    }
    case sdf::GeometryType::PLANE: {
      if (!is_static)
        document_.fail(element,
                       "a plane on a model that can move; make the model <static>, or take a box");
      const Vector3 normal = to_vector(in.PlaneShape()->Normal());
      if (!(normal.norm() > 1e-9)) document_.fail(element, "normal: a direction cannot be zero");
      X_CS.rotation = rotation_z_to(normal.normalized());
      return {simple(ShapeType::kPlane, Vector3::Zero()), X_CS};
    }
    case sdf::GeometryType::MESH:
      return {mesh(*in.MeshShape(), element, is_static), X_CS};
    case sdf::GeometryType::HEIGHTMAP:
      if (!is_static)
        document_.fail(element, "a heightmap on a model that can move; make the model <static>");
      X_CS.translation = to_vector(in.HeightmapShape()->Position());
      return {height_map(*in.HeightmapShape(), element), X_CS};
    default:
      break;
  }
  const sdf::ElementPtr shape = in.Element() ? in.Element()->GetFirstElement() : nullptr;
  document_.fail(
      element,
      fmt::format("<{}> is not supported as a shape that touches; box, sphere, cylinder, capsule, "
                  "ellipsoid, plane, mesh or heightmap is expected",
                  shape ? shape->GetName() : "geometry"));
}

SpatialInertia ShapeReader::unit_inertia(const sdf::Geometry& in, const sdf::ElementPtr& element,
                                         const Shape& shape, const Pose& X_CS) {
  const auto solid = [](const MassProperties& m) {
    return SpatialInertia{m.mass, m.center, m.rotational};
  };
  switch (in.Type()) {
    case sdf::GeometryType::PLANE:
    case sdf::GeometryType::HEIGHTMAP:
      return {};
    case sdf::GeometryType::ELLIPSOID:
      return solid(ellipsoid_mass(to_vector(in.EllipsoidShape()->Radii())));
    case sdf::GeometryType::MESH: {
      const sdf::Mesh& of = *in.MeshShape();
      const TriangleMesh mesh =
          load_mesh(path_of(of.Uri(), element, "mesh").file, to_vector(of.Scale()));
      if (!is_closed(mesh))
        document_.fail(element, fmt::format("mesh '{}' is open, so that it encloses no volume with "
                                            "a mass; give the link <mass> and <inertia>",
                                            of.Uri()));
      return solid(mass_properties(mesh, MeshInertia::kExact));
    }
    default:
      return solid_inertia(shape, solid_volume(shape)).transformed(X_CS);
  }
}

MeshPath ShapeReader::path_of(const std::string& uri, const sdf::ElementPtr& element,
                              const char* kind) const {
  return find_mesh(uri, document_.folder_of(element), document_.options().packages,
                   document_.where(element), kind);
}

std::filesystem::path ShapeReader::find(const std::string& uri, const sdf::ElementPtr& element,
                                        const char* kind) {
  const MeshPath path = path_of(uri, element, kind);
  if (path.guessed)
    document_.note(element, fmt::format("'{}' is taken to be {}", uri, path.file.string()));
  return path.file;
}

/// Reads how a mesh collides from its `optimization` (SDF 1.11); nothing if that is not given.
std::optional<MeshCollision> ShapeReader::collision_of(const sdf::ElementPtr& collision) {
  const sdf::ElementPtr mesh = Document::child(Document::child(collision, "geometry"), "mesh");
  const std::string word = document_.later(mesh, "optimization");
  if (word.empty()) return {};
  if (word == "convex_hull") return MeshCollision{MeshKind::kHull, 0.0, 1};
  if (word != "convex_decomposition")
    document_.fail(mesh, fmt::format("optimization=\"{}\": convex_hull or convex_decomposition is "
                                     "expected",
                                     word));
  const double most =
      Document::later_number(Document::child(mesh, "convex_decomposition"), "max_convex_hulls")
          .value_or(kMostHulls);
  if (!(most >= 1.0 && most <= kMostPieces))
    document_.fail(mesh, fmt::format("max_convex_hulls: a number from 1 to {} is expected",
                                     static_cast<int>(kMostPieces)));
  return MeshCollision{MeshKind::kPieces, 0.0, static_cast<int>(most)};
}

HullCache::MeshFile ShapeReader::mesh_file(const std::filesystem::path& file, const sdf::Mesh& mesh,
                                           const sdf::ElementPtr& element, bool is_static) {
  const std::optional<MeshCollision> how = collision_of(element);
  // One that never moves needs no pieces: it has its triangles.
  return {file, to_vector(mesh.Scale()), is_static ? MeshCollision{MeshKind::kHull, 0.0, 1} : how};
}

Shape ShapeReader::mesh(const sdf::Mesh& in, const sdf::ElementPtr& element, bool is_static) {
  if (!in.Submesh().empty())
    document_.fail(element,
                   fmt::format("<submesh> '{}' is not supported; put it into a file of its own",
                               in.Submesh()));
  const auto [file, scale, how] =
      mesh_file(find(in.Uri(), element, "mesh"), in, element, is_static);
  try {
    std::shared_ptr<const ConvexMesh> hull;
    try {
      hull = hulls_->load(file, scale, how);
    } catch (const InputError&) {
      if (!is_static) throw;  // flat, for example: triangles may still do
    }
    if (is_static && (!hull || is_visibly_concave(*hull))) {
      const auto terrain = make_terrain(load_mesh(file, scale), file.string());
      document_.note(
          element,
          fmt::format(
              "mesh '{}' is hollow and never moves: it touches as {} triangles, from outside",
              in.Uri(), terrain->triangles.size()));
      return {ShapeType::kTerrain, Vector3::Zero(), nullptr, terrain};
    }
    if (const std::string note = hull_note(*hull); !note.empty())
      document_.note(element, fmt::format("mesh '{}' {}", in.Uri(), note));
    return {ShapeType::kConvexMesh, Vector3::Zero(), hull};
  } catch (const InputError& error) {
    document_.fail(element, error.what());
  }
}

Shape ShapeReader::height_map(const sdf::Heightmap& in, const sdf::ElementPtr& element) {
  const std::filesystem::path file = find(in.Uri(), element, "heightmap");
  if (file.extension() != ".png" && file.extension() != ".PNG")
    document_.fail(element, fmt::format("heightmap '{}': only PNG is read", in.Uri()));
  const Vector3 size = to_vector(in.Size());
  if (!(size.minCoeff() > 0.0))
    document_.fail(element, "size: three positive numbers are expected");
  try {
    const TriangleMesh triangles = height_field_mesh(load_height_image(file), size.x(), size.y(),
                                                     size.z(), document_.where(element));
    return {ShapeType::kTerrain, Vector3::Zero(), nullptr, make_terrain(triangles, file.string())};
  } catch (const InputError& error) {
    document_.fail(element, error.what());
  }
}

void ShapeReader::read_surface(const sdf::ElementPtr& collision, CollisionRead& out) {
  Material& material = out.collision.material;
  material.friction = 1.0;  // default of the SDF specification
  const sdf::ElementPtr surface = Document::child(collision, "surface");
  if (!surface) return;
  if (Document::child(surface, "soft_contact"))
    document_.fail(surface, "<soft_contact>: bodies are rigid here");
  if (const sdf::ElementPtr friction = Document::child(surface, "friction"))
    read_friction(friction, out);
  const sdf::ElementPtr bounce = Document::child(surface, "bounce");
  const double restitution = Document::number(bounce, "restitution_coefficient", 0.0);
  const double threshold = Document::number(bounce, "threshold", kNeverBounces);
  if (restitution > 0.0 && threshold >= kNeverBounces)
    document_.note(
        bounce,
        fmt::format(
            "restitution {} of impacts above {} m/s, which is never: nothing bounces; give a "
            "<threshold>",
            restitution, threshold));
  else
    material.restitution = restitution;
  read_stiffness(Document::child(Document::child(surface, "contact"), "ode"), material);
  if (material.restitution > 0.0 && threshold > 0.0)
    document_.note(
        bounce,
        fmt::format("<threshold> {} m/s: slower impacts bounce too, by the engine's own rule of "
                    "what comes to rest",
                    threshold));
}

/// Reads kp [N/m] and kd [N s/m]. Where the surface has a restitution, that counts.
void ShapeReader::read_stiffness(const sdf::ElementPtr& ode, Material& material) {
  const double kp = Document::number(ode, "kp", 0.0), kd = Document::number(ode, "kd", 0.0);
  if (!is_spring(kp)) return;
  if (material.restitution > 0.0) {
    document_.note(ode,
                   fmt::format("kp = {} N/m is not used, since the surface has a restitution", kp));
    return;
  }
  material.stiffness = kp;
  material.damping = std::max(kd, 0.0);
}

void ShapeReader::read_friction(const sdf::ElementPtr& friction, CollisionRead& out) {
  Material& material = out.collision.material;
  const sdf::ElementPtr ode = Document::child(friction, "ode"),
                        bullet = Document::child(friction, "bullet");
  // If both ODE and Bullet have values, those of ODE are used, as the more common.
  const sdf::ElementPtr& used = ode ? ode : bullet;
  const char* first = ode ? "mu" : "friction";
  const char* second = ode ? "mu2" : "friction2";
  if (used) {
    out.along = Document::number(used, first, 1.0);
    out.across = Document::number(used, second, out.along);
    material.friction = std::min(out.along, out.across);
    if (used->HasElement("fdir1")) {
      const Vector3 axis = to_vector(used->Get<ignition::math::Vector3d>("fdir1"));
      if (out.along != out.across && out.along > 0.0 && out.across > 0.0 && axis.norm() > 1e-9) {
        material.friction = out.along;
        material.friction_across = out.across;
        material.friction_axis = axis;
      }
    }
  }
  for (const char* slip : {"slip1", "slip2"})
    if (Document::number(ode, slip, 0.0) != 0.0)
      document_.refuse(ode, LeaveOut::kSlip,
                       fmt::format("<{}>: creep that grows with the force is not supported", slip));
  if (bullet) material.rolling_friction = Document::number(bullet, "rolling_friction", 0.0);
  const sdf::ElementPtr torsional = Document::child(friction, "torsional");
  if (!torsional) return;
  if (!Document::flag(torsional, "use_patch_radius", true)) {
    if (Document::number(torsional, "surface_radius", 0.0) > 0.0)
      document_.note(
          torsional,
          "a patch as wide as bodies sink in: they do not, so that there is no torsional "
          "friction; <patch_radius> would give some");
    return;
  }
  // A round patch of radius a with Hertz's pressure: torque = 3 pi / 16 a mu times the force.
  material.torsional_friction = 3.0 * kPi / 16.0 *
                                Document::number(torsional, "patch_radius", 0.0) *
                                Document::number(torsional, "coefficient", 1.0);
}

}  // namespace counterpoint::sdf_file
