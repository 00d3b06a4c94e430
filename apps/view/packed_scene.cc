#include "view/packed_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "counterpoint/collision/collider.h"
#include "counterpoint/model/geometry.h"
#include "view/packing.h"

namespace counterpoint::view {
namespace {

Json array(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

Json pose_array(const Pose& X) {
  const Quaternion q(X.rotation);
  return {X.translation.x(), X.translation.y(), X.translation.z(), q.w(), q.x(), q.y(), q.z()};
}

/// List of meshes without repetition.
class MeshList {
 public:
  /// Adds a mesh unless it is known by its key; returns its index. Faces become fans of triangles;
  /// `corners_of` returns the indices of a face's vertices.
  template <class Faces, class CornersOf = std::identity>
  int add(const void* key, const std::vector<Vector3>& vertices, const Faces& faces,
          CornersOf corners_of = {}) {
    const auto [entry, is_new] = index_.try_emplace(key, static_cast<int>(json_.size()));
    if (!is_new) return entry->second;
    std::vector<float> numbers;
    for (const Vector3& v : vertices)
      for (const double x : v) numbers.push_back(static_cast<float>(x));
    std::vector<std::uint32_t> triangles;
    for (const auto& face : faces) {
      const auto& corners = std::invoke(corners_of, face);
      for (size_t i = 2; i < corners.size(); ++i)
        for (const int corner : {corners[0], corners[i - 1], corners[i]})
          triangles.push_back(static_cast<std::uint32_t>(corner));
    }
    json_.push_back({{"vertices", pack_floats(numbers)}, {"triangles", pack_indices(triangles)}});
    return entry->second;
  }

  /// Index of the mesh from which a hull was made; -1 if it is not available.
  int given(const ConvexMesh& hull);

  Json take() { return std::move(json_); }

 private:
  Json json_ = Json::array();
  std::map<const void*, int> index_;
  std::map<const ConvexMesh*, int> given_;
};

/// Scale per axis that maps the bounding box of `mesh` to that of its hull, since the hull does not
/// store it. A negative scale means a mirrored axis.
Vector3 scale_between(const std::vector<Vector3>& mesh, const std::vector<Vector3>& hull) {
  const auto box = [](const std::vector<Vector3>& points) {
    std::pair<Vector3, Vector3> ends{points[0], points[0]};
    for (const Vector3& p : points) {
      ends.first = ends.first.cwiseMin(p);
      ends.second = ends.second.cwiseMax(p);
    }
    return ends;
  };
  const auto [mesh_low, mesh_high] = box(mesh);
  const auto [hull_low, hull_high] = box(hull);
  Vector3 scale = Vector3::Ones();
  for (int i = 0; i < 3; ++i) {
    const double extent = mesh_high[i] - mesh_low[i];
    if (!(extent > 0.0)) continue;
    const double s = (hull_high[i] - hull_low[i]) / extent;
    const bool mirrored =
        std::abs(-s * mesh_high[i] - hull_low[i]) < 0.9 * std::abs(s * mesh_low[i] - hull_low[i]);
    scale[i] = mirrored ? -s : s;
  }
  return scale;
}

int MeshList::given(const ConvexMesh& hull) {
  if (hull.source.empty()) return -1;
  const auto [entry, is_new] = given_.try_emplace(&hull, -1);
  if (!is_new) return entry->second;
  TriangleMesh mesh = load_mesh(hull.source);
  const Vector3 scale = scale_between(mesh.vertices, hull.vertices);
  for (Vector3& v : mesh.vertices) v = v.cwiseProduct(scale);
  if (scale.prod() < 0.0)  // mirrored
    for (std::array<int, 3>& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  entry->second = add(&entry->second, mesh.vertices, mesh.triangles);
  return entry->second;
}

/// Adds an entry for a collision shape or a visual; `X` is its pose in the frame of its body.
template <class Item>
Json& add_shape(const Item& item, const Pose& X, Json& shapes) {
  return shapes.emplace_back(Json{{"name", item.name},
                                  {"body", item.body},
                                  {"instance", item.instance},
                                  {"type", shape_type_name(item.shape.type, "mesh")},
                                  {"size", array(item.shape.size)},
                                  {"pose", pose_array(X)},
                                  {"given", -1}});
}

void pack_visuals(const Visuals& visuals, MeshList& meshes, Json& shapes) {
  for (const Visual& visual : visuals.shapes) {
    Json& out = add_shape(visual, visual.X_BV, shapes);
    if (visual.mesh >= 0) {
      const TriangleMesh& mesh = visuals.meshes[visual.mesh];
      out["mesh"] = meshes.add(&mesh, mesh.vertices, mesh.triangles);
    }
    if (visual.color) out["color"] = *visual.color;
    out["visual"] = true;
  }
}

Json pack_shapes(const Model& model, MeshList& meshes) {
  Json shapes = Json::array();
  for (const Geometry& geometry : model.geometries()) {
    Json& out = add_shape(geometry, geometry.X_BG, shapes);
    if (const auto& hull = geometry.shape.mesh) {
      out["mesh"] = meshes.add(hull.get(), hull->vertices, hull->faces);
      out["given"] = meshes.given(*hull);
    }
    if (const auto& terrain = geometry.shape.terrain)
      out["mesh"] = meshes.add(terrain.get(), terrain->vertices, terrain->triangles,
                               &Terrain::Triangle::vertices);
  }
  return shapes;
}

}  // namespace

void pack_model(const Model& model, const Visuals& visuals, Json& out) {
  out["trees"] = model.num_trees();
  Json bodies = Json::array();
  for (int i = 0; i < model.num_bodies(); ++i) {
    const SpatialInertia& inertia = model.body(i).inertia;
    const double mass = i == 0 ? 0.0 : inertia.mass;
    bodies.push_back({{"name", i == 0 ? "world" : model.joint(i - 1).link},
                      {"tree", model.body(i).tree},
                      {"parent", model.body(i).parent},
                      {"mass", mass},
                      {"com", array(mass > 0.0 ? inertia.center : Vector3(Vector3::Zero()))}});
  }
  out["bodies"] = bodies;
  Json frames = Json::array();
  for (const Frame& frame : model.frames())
    frames.push_back({{"name", frame.name}, {"body", frame.body}});
  out["frames"] = frames;
  MeshList meshes;
  out["shapes"] = pack_shapes(model, meshes);
  pack_visuals(visuals, meshes, out["shapes"]);
  out["dressed"] = visuals.instances;
  out["meshes"] = meshes.take();
  std::set<int> instances;
  for (const Geometry& geometry : model.geometries())
    if (geometry.instance >= 0) instances.insert(geometry.instance);
  out["instances"] = instances.size();
  Json closures = Json::array();
  for (const Closure& closure : model.closures())
    closures.push_back({{"name", closure.name},
                        {"body_a", closure.body_a},
                        {"body_b", closure.body_b},
                        {"anchor_a", array(closure.X_AC.translation)},
                        {"anchor_b", array(closure.X_BC.translation)}});
  out["closures"] = closures;
}

std::vector<double> drawn_radii(const Model& model) {
  std::vector<double> radii = collision::body_radii(model);
  radii[0] = 0.0;
  // The page draws the centre of mass of a body without shapes.
  for (int i = 1; i < model.num_bodies(); ++i)
    if (radii[i] == 0.0) radii[i] = model.body(i).inertia.center.norm();
  return radii;
}

namespace {

/// Range of the values after dropping a share of them at either end.
std::pair<double, double> range(std::vector<double>& low, std::vector<double>& high, double share) {
  const auto skip = static_cast<std::ptrdiff_t>(share * static_cast<double>(low.size()));
  std::nth_element(low.begin(), low.begin() + skip, low.end());
  std::nth_element(high.begin(), high.end() - 1 - skip, high.end());
  return {low[skip], high[high.size() - 1 - skip]};
}

/// Ball around the bounding boxes of all bodies in some states; with more than 50 bodies, 1 % at
/// either end may lie outside.
Ball ball_of(const Model& model, const std::vector<double>& radii,
             const std::vector<const State*>& states) {
  if (model.num_bodies() < 2) return {};
  std::array<std::vector<double>, 3> low, high;
  for (const State* state : states) {
    const std::vector<Pose> poses = body_poses(model, state->q);
    for (int i = 1; i < model.num_bodies(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        low[axis].push_back(poses[i].translation[axis] - radii[i]);
        high[axis].push_back(poses[i].translation[axis] + radii[i]);
      }
    }
  }
  Ball ball;
  Vector3 half;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [from, to] = range(low[axis], high[axis], model.num_bodies() > 50 ? 0.01 : 0.0);
    ball.center[axis] = 0.5 * (from + to);
    half[axis] = 0.5 * (to - from);
  }
  if (half.norm() > 0.0) ball.radius = half.norm();
  return ball;
}

}  // namespace

Ball bounds(const Model& model, const Clip& clip) {
  // About 200 states suffice to find the extent of a motion.
  std::vector<const State*> states;
  const size_t stride = std::max<size_t>(1, clip.states.size() / 200);
  for (size_t k = 0; k < clip.states.size(); k += stride) states.push_back(&clip.states[k]);
  states.push_back(&clip.states.back());
  const std::vector<double> radii = drawn_radii(model);
  const Ball all = ball_of(model, radii, states);
  const Ball start = ball_of(model, radii, {&clip.states[0]});
  // If a body flies far away, the camera shows the start with some room, so that something is
  // visible.
  constexpr double kFar = 15.0, kRoom = 4.0;
  if (all.radius > kFar * start.radius) return {start.center, kRoom * start.radius};
  return all;
}

}  // namespace counterpoint::view
