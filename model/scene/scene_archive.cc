#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <type_traits>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {
namespace {

/// Mark with the version of the format; increase it with every change of the content.
constexpr std::string_view kMark = "counterpoint scene 2\n";

template <class T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// Objects shared by several parts, in the order of their first occurrence.
template <class T>
using Shared = std::vector<std::shared_ptr<const T>>;

/// Writer and Reader are the two directions of an archive; the visit() functions below list the
/// content once for both.
class Writer {
 public:
  static constexpr bool kReads = false;
  template <class... T>
  void operator()(T&... parts);
  template <Plain T>
  void plain(T& x) {
    bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  }
  void size(std::uint64_t& n) { plain(n); }
  template <class T>
  void shared(std::shared_ptr<const T>& pointer, Shared<T>& known);

  std::string bytes;
  Shared<ConvexMesh> meshes;
  Shared<Terrain> terrains;
};

class Reader {
 public:
  static constexpr bool kReads = true;
  explicit Reader(std::string_view all) : bytes(all) {}
  template <class... T>
  void operator()(T&... parts);
  template <Plain T>
  void plain(T& x) {
    if (bytes.size() < sizeof x) throw InputError("scene archive: cut short");
    std::memcpy(&x, bytes.data(), sizeof x);
    bytes.remove_prefix(sizeof x);
  }
  /// Reads the size of a list. Every element takes at least one byte, so a damaged size cannot
  /// exhaust memory.
  void size(std::uint64_t& n) {
    plain(n);
    if (n > bytes.size())
      throw InputError("scene archive: damaged, a list is longer than the rest");
  }
  template <class T>
  void shared(std::shared_ptr<const T>& pointer, Shared<T>& known);

  std::string_view bytes;
  Shared<ConvexMesh> meshes;
  Shared<Terrain> terrains;
};

template <class A, Plain T>
void visit(A& a, T& x) {
  a.plain(x);
}
template <class A, class T, int R, int C, int O, int MR, int MC>
void visit(A& a, Eigen::Matrix<T, R, C, O, MR, MC>& m) {
  if constexpr (R == Eigen::Dynamic) {
    auto n = static_cast<std::uint64_t>(m.rows());
    a.size(n);
    m.resize(static_cast<Eigen::Index>(n), 1);
  }
  for (Eigen::Index i = 0; i < m.size(); ++i) a.plain(m.data()[i]);
}
template <class A>
void visit(A& a, std::string& s) {
  std::uint64_t n = s.size();
  a.size(n);
  s.resize(n);
  for (char& c : s) a.plain(c);
}
template <class A, class T>
void visit(A& a, std::vector<T>& list) {
  std::uint64_t n = list.size();
  a.size(n);
  list.resize(n);
  for (T& x : list) a(x);
}
template <class A, class T, std::size_t N>
void visit(A& a, std::array<T, N>& list) {
  for (T& x : list) a(x);
}
template <class A, class T, class U>
void visit(A& a, std::pair<T, U>& x) {
  a(x.first, x.second);
}
template <class A, class T>
void visit(A& a, std::optional<T>& x) {
  bool there = x.has_value();
  a.plain(there);
  if constexpr (A::kReads) {
    if (there) x.emplace();
  }
  if (there) a(*x);
}
template <class A>
void visit(A& a, EffectSet& effects) {
  for (int i = 0; i < kNumEffects; ++i) {
    bool on = effects.has(static_cast<Effect>(i));
    a.plain(on);
    effects.set(static_cast<Effect>(i), on);
  }
}

// Structures are visited through structured bindings of all their members: after adding a member
// the code does not compile until it is listed here.
template <class A>
void visit(A& a, Pose& x) {
  auto& [rotation, translation] = x;
  a(rotation, translation);
}
template <class A>
void visit(A& a, SpatialInertia& x) {
  auto& [mass, center, rotational] = x;
  a(mass, center, rotational);
}
template <class A>
void visit(A& a, Body& x) {
  auto& [parent, type, q, v, tree, end, X_PJ, inertia] = x;
  a(parent, type, q, v, tree, end, X_PJ, inertia);
}
template <class A>
void visit(A& a, Tree& x) {
  auto& [body_begin, body_end, v_begin, v_end] = x;
  a(body_begin, body_end, v_begin, v_end);
}
template <class A>
void visit(A& a, JointInfo& x) {
  auto& [name, link, lower, upper, effort, velocity, actuated] = x;
  a(name, link, lower, upper, effort, velocity, actuated);
}
template <class A>
void visit(A& a, JointSpring& x) {
  auto& [joint, stiffness, reference] = x;
  a(joint, stiffness, reference);
}
template <class A>
void visit(A& a, JointServo& x) {
  auto& [joint, stiffness, damping, position, velocity] = x;
  a(joint, stiffness, damping, position, velocity);
}
template <class A>
void visit(A& a, Drag& x) {
  auto& [linear, quadratic, angular, angular_quadratic] = x;
  a(linear, quadratic, angular, angular_quadratic);
}
template <class A>
void visit(A& a, BodyDrag& x) {
  auto& [body, center, drag] = x;
  a(body, center, drag);
}
template <class A>
void visit(A& a, GravityCompensation& x) {
  auto& [body, center, mass] = x;
  a(body, center, mass);
}
template <class A>
void visit(A& a, Frame& x) {
  auto& [name, body, X_BF] = x;
  a(name, body, X_BF);
}
template <class A>
void visit(A& a, Mimic& x) {
  auto& [joint, master, multiplier, offset] = x;
  a(joint, master, multiplier, offset);
}
template <class A>
void visit(A& a, Closure& x) {
  auto& [name, type, body_a, body_b, X_AC, X_BC, length] = x;
  a(name, type, body_a, body_b, X_AC, X_BC, length);
}
template <class A>
void visit(A& a, Note& x) {
  auto& [where, message] = x;
  a(where, message);
}
template <class A>
void visit(A& a, Material& x) {
  auto& [friction, restitution, torsional, rolling, at_rest, stribeck_speed, stiffness, damping,
         dissipation, axis, across, of_second] = x;
  a(friction, restitution, torsional, rolling, at_rest, stribeck_speed, stiffness, damping,
    dissipation, axis, across, of_second);
}
template <class A>
void visit(A& a, VertexNeighbors::Neighbor& x) {
  auto& [place, vertex] = x;
  a(place, vertex);
}
template <class A>
void visit(A& a, VertexNeighbors& x) {
  auto& [begin, all] = x;
  a(begin, all);
}
template <class A>
void visit(A& a, ConvexMesh& x) {
  auto& [vertices, faces, normals, offsets, neighbors, vertex_faces, vertex_columns, normal_columns,
         interior, radius, volume, source_volume, standoff, deviation, source, pieces,
         union_standoff, hull_reason] = x;
  static_cast<void>(pieces);  // a model has them as geometries
  a(vertices, faces, normals, offsets, neighbors, vertex_faces, vertex_columns, normal_columns,
    interior, radius, volume, source_volume, standoff, deviation, source, union_standoff,
    hull_reason);
}
template <class A>
void visit(A& a, Terrain::Triangle& x) {
  auto& [vertices, normal, neighbors, edges] = x;
  a(vertices, normal, neighbors, edges);
}
template <class A>
void visit(A& a, TriangleTree::Node& x) {
  auto& [low, high, first, count, right] = x;
  a(low, high, first, count, right);
}
template <class A>
void visit(A& a, Terrain& x) {
  auto& [vertices, triangles, low, high, dropped, misfits, source, tree, neighbors] = x;
  a(vertices, triangles, low, high, dropped, misfits, source, tree.nodes, tree.order, neighbors);
}
template <class A>
void visit(A& a, Shape& x) {
  auto& [type, size, mesh, terrain] = x;
  a(type, size);
  a.shared(mesh, a.meshes);
  a.shared(terrain, a.terrains);
}
template <class A>
void visit(A& a, Geometry& x) {
  auto& [name, body, frame, instance, assembly, whole, X_BG, shape, material] = x;
  a(name, body, frame, instance, assembly, whole, X_BG, shape, material);
}
template <class A>
void visit(A& a, PairMaterial& x) {
  auto& [geometry_a, geometry_b, material] = x;
  a(geometry_a, geometry_b, material);
}
template <class A>
void visit(A& a, ContactOptions& x) {
  auto& [model, compliance, smoothing, stabilization, speed, margin, reach, slip_time] = x;
  a(model, compliance, smoothing, stabilization, speed, margin, reach, slip_time);
}
template <class A>
void visit(A& a, StepControlOptions& x) {
  auto& [tolerance, relative, event, min_step, max_step, interval, strict] = x;
  a(tolerance, relative, event, min_step, max_step, interval, strict);
}
template <class A>
void visit(A& a, SimulationOptions& x) {
  auto& [h, integrator, duration, max_speed, closing_time, contact, effects, mean_forces, push_deep,
         control] = x;
  a(h, integrator, duration, max_speed, closing_time, contact, effects, mean_forces, push_deep,
    control);
}

template <class... T>
void Writer::operator()(T&... parts) {
  (visit(*this, parts), ...);
}
template <class... T>
void Reader::operator()(T&... parts) {
  (visit(*this, parts), ...);
}

/// Writes the index of a shared object in `known`, followed by the object at its first occurrence;
/// -1 for null.
template <class T>
void Writer::shared(std::shared_ptr<const T>& pointer, Shared<T>& known) {
  int index = -1;
  if (pointer) {
    index = static_cast<int>(std::find(known.begin(), known.end(), pointer) - known.begin());
  }
  plain(index);
  if (index < static_cast<int>(known.size())) return;
  known.push_back(pointer);
  visit(*this, const_cast<T&>(*pointer));  // Writer only reads the object
}
template <class T>
void Reader::shared(std::shared_ptr<const T>& pointer, Shared<T>& known) {
  int index = 0;
  plain(index);
  if (index < 0) return;
  if (index > static_cast<int>(known.size()))
    throw InputError("scene archive: damaged, no such mesh");
  if (index == static_cast<int>(known.size())) {
    auto made = std::make_shared<T>();
    visit(*this, *made);
    known.push_back(made);
  }
  pointer = known[static_cast<size_t>(index)];
}

/// 64-bit FNV-1a; detects damage, not manipulation.
std::uint64_t checksum(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return hash;
}

}  // namespace

/// Accesses the members of a model through ModelEditor.
class ModelArchive {
 public:
  template <class A>
  static void visit_model(A& a, Model& model) {
    std::apply([&](auto&... parts) { a(parts...); }, ModelEditor::parts(model));
  }
};

std::string archive_scene(const Scene& scene) {
  Writer out;
  Scene copy = scene;
  out.bytes = kMark;
  out(copy.name, copy.q, copy.v, copy.options);
  ModelArchive::visit_model(out, copy.model);
  std::uint64_t sum = checksum(out.bytes);
  out.plain(sum);
  return std::move(out.bytes);
}

Scene restore_scene(std::string_view bytes) {
  if (bytes.substr(0, kMark.size()) != kMark)
    throw InputError(
        "scene archive: not of this version of Counterpoint; load the scene's file, or "
        "archive it anew");
  std::uint64_t sum = 0;
  if (bytes.size() < kMark.size() + sizeof sum) throw InputError("scene archive: cut short");
  Reader(bytes.substr(bytes.size() - sizeof sum)).plain(sum);
  bytes.remove_suffix(sizeof sum);
  if (checksum(bytes) != sum) throw InputError("scene archive: damaged, or cut short");
  Reader in(bytes.substr(kMark.size()));
  Scene scene;
  in(scene.name, scene.q, scene.v, scene.options);
  ModelArchive::visit_model(in, scene.model);
  if (!in.bytes.empty()) throw InputError("scene archive: damaged, bytes are left over");
  if (scene.q.size() != scene.model.nq() || scene.v.size() != scene.model.nv())
    throw InputError("scene archive: damaged, sizes do not agree");
  return scene;
}

}  // namespace counterpoint
