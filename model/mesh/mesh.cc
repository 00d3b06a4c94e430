#include <assimp/DefaultIOSystem.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <numeric>
#include <tuple>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/mesh/ear_cutting.h"
#include "counterpoint/model/mesh/plain_collada.h"

namespace counterpoint {
namespace {

/// Gives assimp access to one file only: a mesh may name materials and images anywhere.
class OneFile : public Assimp::DefaultIOSystem {
 public:
  explicit OneFile(std::string file) : file_(std::move(file)) {}
  bool Exists(const char* file) const override {
    return file_ == file && Assimp::DefaultIOSystem::Exists(file);
  }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return file_ == file ? Assimp::DefaultIOSystem::Open(file, mode) : nullptr;
  }

 private:
  std::string file_;
};

std::string lower_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

void check_file(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw InputError(fmt::format("{}: there is no such mesh file", file.string()));
  }
  const std::string extension = lower_extension(file);
  if (extension != ".stl" && extension != ".obj" && extension != ".dae") {
    throw InputError(fmt::format("{}: mesh format '{}' is not known; use .stl, .obj or .dae",
                                 file.string(), extension));
  }
  if (std::filesystem::file_size(file, error) > limits::kMaxMeshBytes) {
    throw InputError(fmt::format("{}: larger than {} MB; simplify the mesh", file.string(),
                                 limits::kMaxMeshBytes / 1'000'000));
  }
}

const aiScene* read_file(Assimp::Importer& importer, const std::filesystem::path& file) {
  importer.SetIOHandler(new OneFile(file.string()));  // the importer takes ownership
  return importer.ReadFile(file.string(), 0);
}

const aiScene* read_collada(Assimp::Importer& importer, const std::filesystem::path& file) {
  const std::string text = plain_collada(file);
  importer.SetIOHandler(new OneFile(""));
  return importer.ReadFileFromMemory(text.data(), text.size(), 0, "dae");
}

void check_extent(const aiScene& scene, const std::string& file) {
  size_t vertices = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    vertices += mesh.mNumVertices;
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices > static_cast<unsigned>(limits::kMaxPolygonCorners)) {
        throw InputError(
            fmt::format("{}: a polygon has {} corners; at most {} are taken: export "
                        "triangles",
                        file, face.mNumIndices, limits::kMaxPolygonCorners));
      }
      for (unsigned k = 0; k < face.mNumIndices; ++k) {
        if (face.mIndices[k] < mesh.mNumVertices) continue;
        throw InputError(fmt::format("{}: a triangle names vertex {} of {}", file, face.mIndices[k],
                                     mesh.mNumVertices));
      }
    }
  }
  if (vertices > limits::kMaxMeshVertices) {
    throw InputError(fmt::format("{}: {} vertices; at most {} are taken: simplify the mesh", file,
                                 vertices, limits::kMaxMeshVertices));
  }
}

/// Appends the submeshes of a node and of its descendants, transformed.
void append_node(const aiScene& scene, const aiNode& node, const aiMatrix4x4& above,
                 const std::string& file, TriangleMesh& out) {
  const aiMatrix4x4 transform = above * node.mTransformation;
  const bool mirrored = transform.Determinant() < 0;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[m]];
    const int first = static_cast<int>(out.vertices.size());
    if (out.vertices.size() + mesh.mNumVertices > limits::kMaxMeshVertices) {
      throw InputError(
          fmt::format("{}: more than {} vertices, those of instances counted wherever "
                      "they stand: simplify the mesh",
                      file, limits::kMaxMeshVertices));
    }
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D p = transform * mesh.mVertices[i];
      out.vertices.emplace_back(p.x, p.y, p.z);
    }
    std::vector<int> polygon;
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices < 3) continue;  // points and lines bound no solid
      polygon.assign(face.mIndices, face.mIndices + face.mNumIndices);
      for (int& vertex : polygon) vertex += first;
      const size_t from = out.triangles.size();
      if (polygon.size() == 3) {
        out.triangles.push_back({polygon[0], polygon[1], polygon[2]});
      } else {
        const auto ears = cut_ears(out.vertices, polygon);
        out.triangles.insert(out.triangles.end(), ears.begin(), ears.end());
      }
      for (size_t t = from; mirrored && t < out.triangles.size(); ++t)
        std::swap(out.triangles[t][1], out.triangles[t][2]);
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) {
    append_node(scene, *node.mChildren[c], transform, file, out);
  }
}

/// Merges vertices at the same place; removes unused vertices and triangles with repeated ones.
void weld(TriangleMesh& mesh) {
  const auto key = [&](int i) {
    const Vector3& p = mesh.vertices[i];
    return std::tuple(p.x(), p.y(), p.z());
  };
  std::vector<int> order;
  for (const auto& triangle : mesh.triangles) {
    order.insert(order.end(), triangle.begin(), triangle.end());
  }
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const auto ka = key(a);
    const auto kb = key(b);
    return ka != kb ? ka < kb : a < b;
  });
  order.erase(std::unique(order.begin(), order.end()), order.end());
  // The first vertex of each group of equal ones represents it; the order of the file is kept.
  std::vector<int> representative(mesh.vertices.size(), -1);
  for (size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
    representative[order[i]] = same ? representative[order[i - 1]] : order[i];
  }
  std::vector<int> new_index(mesh.vertices.size(), -1);
  std::vector<Vector3> kept;
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (representative[i] != static_cast<int>(i)) continue;
    new_index[i] = static_cast<int>(kept.size());
    kept.push_back(mesh.vertices[i]);
  }
  std::vector<std::array<int, 3>> triangles;
  for (auto triangle : mesh.triangles) {
    for (int& v : triangle) v = new_index[representative[v]];
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) {
      continue;
    }
    triangles.push_back(triangle);
  }
  mesh.vertices = std::move(kept);
  mesh.triangles = std::move(triangles);
}

}  // namespace

TriangleMesh load_mesh(const std::filesystem::path& file, const Vector3& scale,
                       PolygonSplit split) {
  check_file(file);
  if (!scale.allFinite() || (scale.array() == 0.0).any()) {
    throw InputError(fmt::format("{}: mesh scale ({}, {}, {}) must be finite and not zero",
                                 file.string(), scale.x(), scale.y(), scale.z()));
  }
  const bool collada = lower_extension(file) == ".dae";
  Assimp::Importer importer;
  const aiScene* scene = collada ? read_collada(importer, file) : read_file(importer, file);
  if (scene != nullptr) check_extent(*scene, file.string());
  if (scene != nullptr && split == PolygonSplit::kInside)
    scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    throw InputError(
        fmt::format("{}: the mesh cannot be read: {}", file.string(), importer.GetErrorString()));
  }
  // Assimp rotates Collada files to y up; here z is up.
  aiMatrix4x4 axes;
  if (collada) {
    axes = aiMatrix4x4(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1);
  }
  TriangleMesh mesh;
  append_node(*scene, *scene->mRootNode, axes, file.string(), mesh);
  for (Vector3& p : mesh.vertices) {
    p = p.cwiseProduct(scale);
    if (!(p.array().abs() <= limits::kMaxLength).all()) {  // false for NaN, too
      throw InputError(
          fmt::format("{}: a vertex is not a finite number, or farther out than {:g} m",
                      file.string(), limits::kMaxLength));
    }
  }
  if (scale.prod() < 0.0) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  weld(mesh);
  if (mesh.triangles.empty()) {
    throw InputError(fmt::format("{}: the mesh has no triangles", file.string()));
  }
  return mesh;
}

bool is_closed(const TriangleMesh& mesh) {
  std::vector<std::pair<int, int>> edges;
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) edges.emplace_back(t[k], t[(k + 1) % 3]);
  }
  std::sort(edges.begin(), edges.end());
  if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return false;
  return std::all_of(edges.begin(), edges.end(), [&](const std::pair<int, int>& e) {
    return std::binary_search(edges.begin(), edges.end(), std::pair(e.second, e.first));
  });
}

double enclosed_volume(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0.0;
  const Vector3& origin = mesh.vertices[0];  // a point of the mesh: less cancellation
  double volume = 0.0;
  for (const auto& t : mesh.triangles) {
    const Vector3 a = mesh.vertices[t[0]] - origin;
    const Vector3 b = mesh.vertices[t[1]] - origin;
    const Vector3 c = mesh.vertices[t[2]] - origin;
    volume += a.dot(b.cross(c)) / 6.0;
  }
  return volume;
}

}  // namespace counterpoint
