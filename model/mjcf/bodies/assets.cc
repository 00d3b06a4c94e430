#include "counterpoint/model/mjcf/bodies/assets.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstring>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::mjcf {
namespace {

namespace fs = std::filesystem;

std::string stem_of(const std::string& file) { return fs::path(file).stem().string(); }

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

template <class T>
T take(const std::string& bytes, std::size_t& at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  at += sizeof value;
  return value;
}

/// Loads MuJoCo's MSH format: counts of vertices, normals, texture coordinates and triangles
/// (int32), then vertices, normals, texture coordinates (float) and triangles (int32).
TriangleMesh load_msh(const fs::path& file) {
  const auto fail = [&](const std::string& why) {
    throw InputError(fmt::format("{}: {}", file.string(), why));
  };
  const std::string bytes =
      read_text_file(file, limits::kMaxMeshBytes, "there is no such mesh file");
  if (bytes.size() < 16) fail("a mesh in MSH format has a header of 16 bytes");
  std::size_t at = 0;
  std::array<std::size_t, 4> counts{};
  for (std::size_t& count : counts) {
    const auto n = take<std::int32_t>(bytes, at);
    if (n < 0 || static_cast<std::size_t>(n) > limits::kMaxMeshVertices)
      fail(fmt::format("{} vertices or triangles; at most {} are taken", n,
                       limits::kMaxMeshVertices));
    count = static_cast<std::size_t>(n);
  }
  if (bytes.size() != 16 + 12 * counts[0] + 12 * counts[1] + 8 * counts[2] + 12 * counts[3])
    fail("its size is not that of its vertices and triangles");
  TriangleMesh mesh;
  for (std::size_t i = 0; i < counts[0]; ++i) {
    Vector3 p;
    for (int k = 0; k < 3; ++k) p[k] = take<float>(bytes, at);
    if (!(p.array().abs() <= limits::kMaxLength).all()) fail("a coordinate is not finite");
    mesh.vertices.push_back(p);
  }
  at += 12 * counts[1] + 8 * counts[2];
  for (std::size_t i = 0; i < counts[3]; ++i) {
    std::array<int, 3> t{};
    for (int& index : t) {
      index = take<std::int32_t>(bytes, at);
      if (index < 0 || static_cast<std::size_t>(index) >= counts[0])
        fail(fmt::format("a triangle names vertex {} of {}", index, counts[0]));
    }
    mesh.triangles.push_back(t);
  }
  return mesh;
}

/// Triangulates the polygons of a hull as fans.
TriangleMesh triangles_of(const ConvexMesh& hull) {
  TriangleMesh mesh{hull.vertices, {}};
  for (const auto& face : hull.faces)
    for (std::size_t i = 2; i < face.size(); ++i)
      mesh.triangles.push_back({face[0], face[i - 1], face[i]});
  return mesh;
}

}  // namespace

Assets::Assets(Document& document, const Defaults& defaults)
    : document_(document),
      cache_(document.options().hulls ? document.options().hulls : std::make_shared<HullCache>()) {
  document.each(document.section_children("asset"), [&](const Element& e) {
    const std::string kind = e.Name();
    if (kind == "mesh") read_mesh(e, defaults.values(e, ""));
    if (kind == "hfield") {
      const Values v(document, e);
      fields_[v.text("name", stem_of(v.text("file")))] = &e;
    }
  });
}

void Assets::read_mesh(const Element& element, const Values& v) {
  document_.expect(element,
                   {"name", "class", "content_type", "file", "scale", "inertia", "smoothnormal",
                    "maxhullvert", "vertex", "normal", "texcoord", "face", "refpos", "refquat",
                    "material", "needsdf", "octree_maxdepth", "builtin", "params"});
  if (v.has("builtin"))
    document_.fail(element, "builtin: meshes made by rule are not supported; name a file");
  Mesh mesh;
  mesh.element = &element;
  mesh.file = v.text("file");
  if (mesh.file.empty() && !v.has("vertex"))
    document_.fail(element, "a file or vertices are expected");
  mesh.scale = v.vector("scale", Vector3::Ones());
  if ((mesh.scale.array() == 0.0).any()) document_.fail(element, "scale: no number may be zero");
  mesh.reference = v.vector("refpos", Vector3::Zero());
  if (const auto q = v.numbers("refquat", 4, 4); !q.empty()) mesh.turned = rotation_of(q.data());
  mesh.max_hull_vertices = v.integer("maxhullvert", 0);
  const std::string inertia = v.word("inertia", {"legacy", "exact", "convex", "shell"}, "legacy");
  mesh.inertia = inertia == "exact"    ? MeshInertia::kExact
                 : inertia == "convex" ? MeshInertia::kConvex
                 : inertia == "shell"  ? MeshInertia::kShell
                                       : MeshInertia::kLegacy;
  const std::string name = v.text("name", stem_of(mesh.file));
  if (!meshes_.emplace(name, mesh).second)
    document_.fail(element, fmt::format("there is already a mesh '{}'", name));
}

Assets::Mesh& Assets::find(const std::string& name, const Element& user) {
  const auto found = meshes_.find(name);
  if (found != meshes_.end()) return found->second;
  document_.fail(user, fmt::format("there is no mesh '{}' among the assets", name));
}

fs::path Assets::path(const std::string& file, const Element& element, const char* kind) const {
  const Compiler& compiler = document_.compiler(element);
  std::string name = file;
  std::replace(name.begin(), name.end(), '\\', '/');
  if (compiler.strip_path) name = fs::path(name).filename().string();
  if (!fs::path(name).is_absolute()) name = compiler.mesh_folder + name;
  return find_mesh(name, document_.folder(element), document_.options().packages,
                   document_.where(element), kind)
      .file;
}

/// Transforms as MuJoCo does: subtracts refpos, applies the inverse of refquat, scales.
TriangleMesh Assets::triangles(const Mesh& mesh) const {
  TriangleMesh out;
  if (mesh.file.empty()) {
    const Values v(document_, *mesh.element);
    const std::vector<double> p = v.numbers("vertex", 12, limits::kMaxMeshVertices);
    if (p.size() % 3 != 0)
      document_.fail(*mesh.element, "vertex: three numbers a vertex are expected");
    for (std::size_t i = 0; i < p.size(); i += 3)
      out.vertices.emplace_back(p[i], p[i + 1], p[i + 2]);
    const std::vector<double> faces = v.numbers("face", 3, limits::kMaxMeshVertices);
    const auto index = [&](double x) {
      if (x >= 0.0 && x < static_cast<double>(out.vertices.size())) return static_cast<int>(x);
      document_.fail(*mesh.element, fmt::format("face: there is no vertex {}", x));
    };
    for (std::size_t i = 0; i + 2 < faces.size(); i += 3)
      out.triangles.push_back({index(faces[i]), index(faces[i + 1]), index(faces[i + 2])});
    if (out.triangles.empty()) out = triangles_of(*make_convex_hull(out.vertices));
  } else {
    const fs::path file = path(mesh.file, *mesh.element, "mesh");
    out = lower_extension(file) == ".msh" ? load_msh(file)
                                          : load_mesh(file, Vector3::Ones(), PolygonSplit::kEars);
  }
  for (Vector3& p : out.vertices)
    p = (mesh.turned.transpose() * (p - mesh.reference)).cwiseProduct(mesh.scale);
  if (mesh.scale.prod() < 0.0)
    for (auto& t : out.triangles) std::swap(t[1], t[2]);
  return out;
}

std::optional<HullCache::MeshFile> Assets::plain_file(const Mesh& mesh) const {
  if (mesh.file.empty() || !mesh.reference.isZero(0.0) || !mesh.turned.isIdentity(0.0)) return {};
  const fs::path file = path(mesh.file, *mesh.element, "mesh");
  if (lower_extension(file) == ".msh") return {};
  return HullCache::MeshFile{file, mesh.scale, {}};
}

void Assets::load_ahead(const std::vector<std::string>& names) {
  std::vector<HullCache::MeshFile> files;
  for (const std::string& name : names) {
    const auto found = meshes_.find(name);
    if (found == meshes_.end()) continue;
    try {
      if (const auto file = plain_file(found->second)) files.push_back(*file);
    } catch (const InputError&) {  // hull() says where
    }
  }
  cache_->load_ahead(files);
}

std::shared_ptr<const ConvexMesh> Assets::hull(const std::string& name, const Element& user) {
  Mesh& mesh = find(name, user);
  if (mesh.hull) return mesh.hull;
  try {
    if (const auto plain = plain_file(mesh)) {
      mesh.hull = cache_->load(plain->file, plain->scale);
    } else {
      const fs::path file = mesh.file.empty() ? fs::path() : path(mesh.file, *mesh.element, "mesh");
      const TriangleMesh all = triangles(mesh);
      ConvexMesh hull = *convex_mesh_of(all, cache_->collisions().of(file), file.string());
      hull.source.clear();  // the file alone does not give this hull: refpos, refquat or MSH
      mesh.hull = std::make_shared<const ConvexMesh>(std::move(hull));
    }
    if (mesh.max_hull_vertices >= 4) mesh.hull = reduce_hull(mesh.hull, mesh.max_hull_vertices);
  } catch (const InputError& error) {
    document_.fail(user, error.what());
  }
  if (const std::string note = hull_note(*mesh.hull); !note.empty())
    document_.note(*mesh.element, fmt::format("mesh '{}' {}", name, note));
  return mesh.hull;
}

MassProperties Assets::mesh_mass(const std::string& name, const Element& user) {
  const Mesh& mesh = find(name, user);
  try {
    if (mesh.inertia == MeshInertia::kConvex)
      return mass_properties(triangles_of(*make_convex_hull(triangles(mesh).vertices)),
                             MeshInertia::kExact);
    return mass_properties(triangles(mesh), mesh.inertia);
  } catch (const InputError& error) {
    document_.fail(user, error.what());
  }
}

TriangleMesh Assets::triangles(const std::string& name, const Element& user) {
  return triangles(find(name, user));
}

std::shared_ptr<const Terrain> Assets::height_field(const std::string& name, const Element& user) {
  const auto found = fields_.find(name);
  if (found == fields_.end())
    document_.fail(user, fmt::format("there is no hfield '{}' among the assets", name));
  const Element& element = *found->second;
  document_.expect(element, {"name", "content_type", "file", "nrow", "ncol", "elevation", "size"});
  const Values v(document_, element);
  // Half lengths along x and y, height of the top, depth of the base [m].
  const std::vector<double> size = v.numbers("size", 4, 4);
  if (size.empty() || !(size[0] > 0.0 && size[1] > 0.0 && size[2] > 0.0))
    document_.fail(element, "size: four positive numbers are expected");
  HeightGrid grid;
  std::string source;
  if (v.has("file")) {
    const fs::path file = path(v.text("file"), element, "hfield");
    if (lower_extension(file) != ".png")
      document_.fail(element, "only PNG is read; or give the heights as elevation");
    grid = load_height_image(file);
    source = file.string();
  } else {
    grid.rows = v.integer("nrow", 0);
    grid.columns = v.integer("ncol", 0);
    if (grid.rows < 2 || grid.columns < 2 || grid.rows > limits::kMaxHeightsPerSide ||
        grid.columns > limits::kMaxHeightsPerSide ||
        static_cast<std::size_t>(grid.rows) * grid.columns > limits::kMaxHeights)
      document_.fail(element,
                     fmt::format("nrow, ncol: 2 to {} are expected", limits::kMaxHeightsPerSide));
    const std::size_t count = static_cast<std::size_t>(grid.rows) * grid.columns;
    grid.heights = v.numbers("elevation", count, count);
    if (grid.heights.empty()) grid.heights.assign(count, 0.0);
  }
  // MuJoCo normalizes the lowest height to 0 and the highest to 1.
  const auto [low, high] = std::minmax_element(grid.heights.begin(), grid.heights.end());
  const double least = *low, range = *high - *low;
  for (double& h : grid.heights) h = range > 0.0 ? (h - least) / range : 0.0;
  return make_terrain(
      height_field_mesh(grid, 2.0 * size[0], 2.0 * size[1], size[2], document_.where(element)),
      source);
}

}  // namespace counterpoint::mjcf
