// counterpoint.collision: queries on shapes and scenes.
#include <pybind11/stl.h>

#include "counterpoint/collision/collider.h"
#include "objects/handles.h"
#include "objects/properties.h"
#include "objects/typed.h"

namespace counterpoint::python {
namespace {

using collision::Candidate;
using collision::Distance;
using collision::RayHit;
using collision::SceneQuery;
using collision::SceneRayHit;

struct QueryHandle {
  explicit QueryHandle(ModelPtr m) : model(std::move(m)), query(model->model) {}
  ModelPtr model;
  SceneQuery query;
  Guard guard;

  const std::string& name(int geometry) const {
    return model->model.geometries()[static_cast<size_t>(geometry)].name;
  }
  int geometry(const Key& key) const { return geometry_index(*model, key); }
};
using QueryPtr = std::shared_ptr<QueryHandle>;
constexpr const char* kWhat = "SceneQuery";

/// A ray hit or a contact, with the names of its geometries.
struct NamedHit {
  RayHit hit;
  std::string geometry;
};
struct NamedContact {
  Candidate contact;
  std::string geometry_a, geometry_b;
};

void bind_results(py::module_& c) {
  py::class_<Distance>(c, "Distance", "Signed distance of shapes A and B.")
      .def_readonly("gap", &Distance::gap,
                    "[m]; negative: minus the least translation that parts them.")
      .def_property_readonly("normal", copy_of(&Distance::normal), "Unit, from A to B, shape (3,).")
      .def_property_readonly("point_a", copy_of(&Distance::point_a),
                             "On the surface of A, nearest to B [m], shape (3,).")
      .def_property_readonly("point_b", copy_of(&Distance::point_b),
                             "On the surface of B [m], shape (3,).")
      .def("__repr__",
           [](const Distance& d) { return py::str("<Distance: gap {:.9g} m>").format(d.gap); });
  py::class_<NamedHit>(c, "RayHit", "Where a ray first meets a surface.")
      .def_property_readonly("distance", through(&NamedHit::hit, &RayHit::distance),
                             "From the ray's origin [m].")
      .def_property_readonly("position", through(&NamedHit::hit, &RayHit::position),
                             "[m], shape (3,).")
      .def_property_readonly("normal", through(&NamedHit::hit, &RayHit::normal),
                             "Unit, out of the surface, shape (3,).")
      .def_readonly("geometry", &NamedHit::geometry,
                    "Name of what was hit; empty for a lone shape.")
      .def("__repr__", [](const NamedHit& h) {
        return py::str("<RayHit '{}' at {:.9g} m>").format(h.geometry, h.hit.distance);
      });
  py::class_<NamedContact>(c, "Contact", "Where two geometries touch, overlap, or come close.")
      .def_readonly("geometry_a", &NamedContact::geometry_a, "Name of the one of lower index.")
      .def_readonly("geometry_b", &NamedContact::geometry_b, "Name of the other one.")
      .def_property_readonly("position", through(&NamedContact::contact, &Candidate::position),
                             "Halfway between the surfaces, in the world [m], shape (3,).")
      .def_property_readonly("normal", through(&NamedContact::contact, &Candidate::normal),
                             "Unit, from A to B, shape (3,).")
      .def_property_readonly("gap", through(&NamedContact::contact, &Candidate::gap),
                             "Along the normal [m]; negative: overlap.")
      .def("__repr__", [](const NamedContact& n) {
        return py::str("<Contact {} - {}: gap {:.6g} m>")
            .format(n.geometry_a, n.geometry_b, n.contact.gap);
      });
}

std::optional<NamedHit> hit_of(const std::optional<RayHit>& hit) {
  if (!hit) return std::nullopt;
  return NamedHit{*hit, ""};
}

void bind_shape_queries(py::module_& c) {
  c.def(
      "distance",
      [](const Shape& a, const PoseLike& X_WA, const Shape& b, const PoseLike& X_WB) {
        const Pose A = pose_from(X_WA, "pose_a"), B = pose_from(X_WB, "pose_b");
        const py::gil_scoped_release release;
        return collision::distance(a, A, b, B);
      },
      py::arg("shape_a"), py::arg("pose_a"), py::arg("shape_b"), py::arg("pose_b"), R"(
Signed distance of two shapes, right to 1e-9 of their size.

Parameters
----------
shape_a, shape_b : Shape
pose_a, pose_b : Pose

Returns
-------
Distance or None
    None for two planes, or if a pose is not finite.
)");
  c.def(
      "overlap",
      [](const Shape& a, const PoseLike& X_WA, const Shape& b, const PoseLike& X_WB) {
        const Pose A = pose_from(X_WA, "pose_a"), B = pose_from(X_WB, "pose_b");
        const py::gil_scoped_release release;
        return collision::overlap(a, A, b, B);
      },
      py::arg("shape_a"), py::arg("pose_a"), py::arg("shape_b"), py::arg("pose_b"),
      "True if the shapes share more than their surfaces.");
  c.def(
      "cast_ray",
      [](const Shape& shape, const PoseLike& pose, const Array& origin, const Array& direction,
         double max_distance) {
        return hit_of(collision::cast_ray(shape, pose_from(pose, "pose"), vector3(origin, "origin"),
                                          vector3(direction, "direction"), max_distance));
      },
      py::arg("shape"), py::arg("pose"), py::arg("origin"), py::arg("direction"),
      py::arg("max_distance") = std::numeric_limits<double>::infinity(), R"(
First point of a shape on a ray.

Parameters
----------
shape : Shape
pose : Pose
origin : array_like, shape (3,)
    [m]; a ray that starts inside hits there, at distance 0.
direction : array_like, shape (3,)
    Of any length but zero.
max_distance : float
    [m]

Returns
-------
RayHit or None
)");
}

/// Casts rays; returns distances (inf: no hit) and geometries (-1: no hit).
py::tuple cast_rays(const QueryHandle& q, const Array& origins, const Array& directions,
                    double max_distance) {
  const auto to = matrix(directions, -1, 3, "directions");
  const Eigen::Index count = to.rows();
  const bool shared = origins.ndim() == 1;
  check_shape(origins, shared ? Shape1{3} : Shape1{count, 3}, "origins");
  py::array_t<double> distances(count);
  py::array_t<int> geometries(count);
  double* const d = distances.mutable_data();
  int* const g = geometries.mutable_data();
  const double* const from = origins.data();
  {
    const py::gil_scoped_release release;
    for (Eigen::Index i = 0; i < count; ++i) {
      const Vector3 origin = Eigen::Map<const Vector3>(from + (shared ? 0 : 3 * i));
      const auto hit = q.query.cast_ray(origin, to.row(i).transpose(), max_distance);
      d[i] = hit ? hit->distance : std::numeric_limits<double>::infinity();
      g[i] = hit ? hit->geometry : -1;
    }
  }
  return py::make_tuple(distances, geometries);
}

std::vector<NamedContact> contacts(QueryHandle& q, double margin) {
  const Guard::Lock lock(q.guard, kWhat);
  std::vector<Candidate> found;
  {
    const py::gil_scoped_release release;
    found = q.query.contacts(margin);
  }
  std::vector<NamedContact> out;
  for (const Candidate& c : found) out.push_back({c, q.name(c.geometry_a), q.name(c.geometry_b)});
  return out;
}

std::vector<std::pair<std::string, std::string>> overlapping_pairs(QueryHandle& q) {
  const Guard::Lock lock(q.guard, kWhat);
  std::vector<std::pair<int, int>> found;
  {
    const py::gil_scoped_release release;
    found = q.query.overlaps();
  }
  std::vector<std::pair<std::string, std::string>> out;
  for (const auto& [a, b] : found) out.emplace_back(q.name(a), q.name(b));
  return out;
}

constexpr const char* kSceneQueryDoc = R"(
Questions about all geometries of a model in a configuration; one thread at a time.

Parameters
----------
model : Model
    Bodies start at its default configuration.
)";

constexpr const char* kCastRaysDoc = R"(
Many rays at once.

Parameters
----------
origins : array_like, shape (n, 3) or (3,)
    [m]
directions : array_like, shape (n, 3)
max_distance : float
    [m]

Returns
-------
distances : ndarray, shape (n,)
    [m], inf where nothing is hit.
geometries : ndarray of int32, shape (n,)
    Indices into model.geometries, -1 where nothing is hit.
)";

void bind_pair_questions(py::class_<QueryHandle, QueryPtr>& query) {
  query
      .def(
          "distance",
          [](QueryHandle& q, const Key& a, const Key& b) {
            const Guard::Lock lock(q.guard, kWhat);
            return q.query.distance(q.geometry(a), q.geometry(b));
          },
          py::arg("geometry_a"), py::arg("geometry_b"),
          "Signed Distance of two geometries, by name or index; None for two planes.")
      .def(
          "overlaps",
          [](QueryHandle& q, const Shape& shape, const PoseLike& pose) {
            const Guard::Lock lock(q.guard, kWhat);
            std::vector<std::string> names;
            for (const int i : q.query.overlaps(shape, pose_from(pose, "pose")))
              names.push_back(q.name(i));
            return names;
          },
          py::arg("shape"), py::arg("pose"),
          "Names of the geometries that a shape at this pose would overlap.")
      .def("overlapping_pairs", &overlapping_pairs,
           "Names of pairs of geometries that overlap, of those that may touch at all.")
      .def("contacts", &contacts, py::arg("margin") = 0.0,
           "List of Contact with gap < margin [m], of all pairs that may touch.")
      .def("__repr__", [](const QueryHandle& q) {
        return py::str("<SceneQuery of {} geometries>").format(q.model->model.geometries().size());
      });
}

void bind_scene_query(py::module_& c) {
  py::class_<QueryHandle, QueryPtr> query(c, "SceneQuery", kSceneQueryDoc);
  query.def(py::init<ModelPtr>(), py::arg("model"))
      .def(
          "set_configuration",
          [](QueryHandle& q, const Array& given) {
            const Guard::Lock lock(q.guard, kWhat);
            const auto coordinates = vector(given, q.model->model.nq(), "q");
            const py::gil_scoped_release release;
            q.query.set_poses(body_poses(q.model->model, coordinates));
          },
          py::arg("q"), "Places the bodies at coordinates, shape (nq,).")
      .def(
          "pose",
          [](const QueryHandle& q, const Key& key) { return q.query.pose(q.geometry(key)); },
          py::arg("geometry"), "X_WG of a geometry, by name or index.")
      .def(
          "cast_ray",
          [](QueryHandle& q, const Array& origin, const Array& direction,
             double max_distance) -> std::optional<NamedHit> {
            const Guard::Lock lock(q.guard, kWhat);
            const auto hit = q.query.cast_ray(vector3(origin, "origin"),
                                              vector3(direction, "direction"), max_distance);
            if (!hit) return std::nullopt;
            return NamedHit{*hit, q.name(hit->geometry)};
          },
          py::arg("origin"), py::arg("direction"),
          py::arg("max_distance") = std::numeric_limits<double>::infinity(),
          "The nearest RayHit over all geometries, or None.")
      .def(
          "cast_rays",
          [](QueryHandle& q, const Array& origins, const Array& directions, double most) {
            const Guard::Lock lock(q.guard, kWhat);
            return cast_rays(q, origins, directions, most);
          },
          py::arg("origins"), py::arg("directions"),
          py::arg("max_distance") = std::numeric_limits<double>::infinity(), kCastRaysDoc);
  bind_pair_questions(query);
}

}  // namespace

void bind_collision(py::module_& m) {
  py::module_ c = m.def_submodule("collision", "Questions about shapes and scenes.");
  bind_results(c);
  bind_shape_queries(c);
  bind_scene_query(c);
}

}  // namespace counterpoint::python
