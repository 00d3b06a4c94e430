#include <algorithm>
#include <atomic>
#include <thread>

#include "counterpoint/model/geometry.h"

namespace counterpoint {

HullCache::Key HullCache::key_of(const std::filesystem::path& file, const Vector3& scale) {
  std::error_code error;
  const std::filesystem::path path = std::filesystem::weakly_canonical(file, error);
  return {error ? file : path, scale.x(), scale.y(), scale.z()};
}

std::shared_ptr<const ConvexMesh> HullCache::loaded(const std::filesystem::path& file,
                                                    const Vector3& scale) const {
  const auto hull = load_convex_mesh(file, scale, collisions_.of(file));
  return max_vertices_ > 0 ? reduce_hull(hull, max_vertices_) : hull;
}

std::shared_ptr<const ConvexMesh> HullCache::load(const std::filesystem::path& file,
                                                  const Vector3& scale) {
  std::shared_ptr<const ConvexMesh>& hull = hulls_[key_of(file, scale)];
  if (!hull) hull = loaded(file, scale);
  return hull;
}

void HullCache::load_ahead(const std::vector<std::pair<std::filesystem::path, Vector3>>& meshes) {
  std::vector<std::tuple<Key, std::pair<std::filesystem::path, Vector3>>> missing;
  for (const auto& mesh : meshes) {
    const Key key = key_of(mesh.first, mesh.second);
    const auto same = [&](const auto& other) { return std::get<0>(other) == key; };
    if (!hulls_[key] && std::none_of(missing.begin(), missing.end(), same))
      missing.emplace_back(key, mesh);
  }
  std::vector<std::shared_ptr<const ConvexMesh>> hulls(missing.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < missing.size(); i = next++) {
      const auto& [file, scale] = std::get<1>(missing[i]);
      try {
        hulls[i] = loaded(file, scale);
      } catch (const std::exception&) {  // load() fails again
      }
    }
  };
  {
    const std::size_t count =
        std::min<std::size_t>(missing.size(), std::thread::hardware_concurrency());
    std::vector<std::jthread> threads;
    for (std::size_t i = 1; i < count; ++i) threads.emplace_back(work);
    work();
  }
  for (std::size_t i = 0; i < missing.size(); ++i) hulls_[std::get<0>(missing[i])] = hulls[i];
}

}  // namespace counterpoint
