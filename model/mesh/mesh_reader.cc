#include "counterpoint/model/mesh/mesh_reader.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/Importer.hpp>

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

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& file, bool collada, PolygonSplit split) {
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
  return mesh;
}

}  // namespace counterpoint

extern "C" [[gnu::visibility("default")]] const counterpoint::MeshReader COUNTERPOINT_MODULE = {
    counterpoint::read_mesh};
