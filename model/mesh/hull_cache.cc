#include <algorithm>
#include <atomic>
#include <thread>

#include "counterpoint/model/geometry.h"

namespace counterpoint {

std::optional<MeshKind> mesh_kind_from_name(const std::string& name) {
  if (name == "auto") return MeshKind::kAuto;
  if (name == "hull") return MeshKind::kHull;
  if (name == "pieces") return MeshKind::kPieces;
  return std::nullopt;
}

MeshCollision HullCache::collision_of(const MeshFile& mesh) const {
  if (!mesh.own || collisions_.named.contains(mesh.file.filename().string()))
    return collisions_.of(mesh.file);
  MeshCollision out = *mesh.own;
  if (out.tolerance == 0.0) out.tolerance = collisions_.others.tolerance;
  return out;
}

HullCache::Key HullCache::key_of(const MeshFile& mesh) const {
  std::error_code error;
  const std::filesystem::path path = std::filesystem::weakly_canonical(mesh.file, error);
  const Vector3& scale = mesh.scale;
  const MeshCollision how = collision_of(mesh);
  return {
      error ? mesh.file : path, scale.x(), scale.y(), scale.z(), how.kind, how.tolerance, how.most};
}

std::shared_ptr<const ConvexMesh> HullCache::loaded(const MeshFile& mesh) const {
  const auto hull = load_convex_mesh(mesh.file, mesh.scale, collision_of(mesh));
  return max_vertices_ > 0 ? reduce_hull(hull, max_vertices_) : hull;
}

std::shared_ptr<const ConvexMesh> HullCache::load(const std::filesystem::path& file,
                                                  const Vector3& scale,
                                                  const std::optional<MeshCollision>& own) {
  const MeshFile mesh{file, scale, own};
  std::shared_ptr<const ConvexMesh>& hull = hulls_[key_of(mesh)];
  if (!hull) hull = loaded(mesh);
  return hull;
}

void HullCache::load_ahead(const std::vector<MeshFile>& meshes) {
  std::map<Key, MeshFile> missing;
  for (const MeshFile& mesh : meshes) {
    const Key key = key_of(mesh);
    if (!hulls_.contains(key)) missing.emplace(key, mesh);
  }
  std::vector<std::pair<const MeshFile*, std::shared_ptr<const ConvexMesh>*>> jobs;
  for (const auto& [key, mesh] : missing) jobs.emplace_back(&mesh, &hulls_[key]);
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < jobs.size(); i = next++) {
      try {
        *jobs[i].second = loaded(*jobs[i].first);
      } catch (const std::exception&) {  // load() fails again
      }
    }
  };
  const std::size_t count = std::min<std::size_t>(jobs.size(), std::thread::hardware_concurrency());
  std::vector<std::jthread> threads;
  for (std::size_t i = 1; i < count; ++i) threads.emplace_back(work);
  work();
}

}  // namespace counterpoint
