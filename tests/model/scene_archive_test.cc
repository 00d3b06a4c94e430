#include <gtest/gtest.h>

#include <filesystem>

#include "counterpoint/model/scene.h"
#include "support/paths.h"

namespace counterpoint::scene_archive_test {
namespace {

const std::filesystem::path kScenes = test::source_dir() + "/data/scenes";

TEST(SceneArchive, GivesBackAllThatItTook) {
  // An archive contains every value: writing the restored scene gives the same bytes.
  for (const auto& entry : std::filesystem::directory_iterator(kScenes)) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string bytes = archive_scene(load_scene(entry.path()));
    EXPECT_EQ(archive_scene(restore_scene(bytes)), bytes) << entry.path();
  }
}

TEST(SceneArchive, SharesMeshesAsTheSceneDid) {
  const Scene scene = load_scene(kScenes / "terrain.yaml");
  const Scene twin = restore_scene(archive_scene(scene));
  const auto& a = scene.model.geometries();
  const auto& b = twin.model.geometries();
  ASSERT_EQ(a.size(), b.size());
  int meshes = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    EXPECT_EQ(a[i].shape.terrain != nullptr, b[i].shape.terrain != nullptr);
    for (size_t j = 0; j < i; ++j) {
      EXPECT_EQ(a[i].shape.mesh == a[j].shape.mesh, b[i].shape.mesh == b[j].shape.mesh);
    }
    meshes += a[i].shape.terrain != nullptr ? 1 : 0;
  }
  EXPECT_GT(meshes, 0);
}

TEST(SceneArchive, RefusesWhatIsDamaged) {
  const std::string bytes = archive_scene(load_scene(kScenes / "pendulum.yaml"));
  EXPECT_THROW(restore_scene(""), InputError);
  for (size_t length = 0; length < bytes.size(); length += 7)
    EXPECT_THROW(restore_scene(std::string_view(bytes).substr(0, length)), InputError) << length;
  for (size_t i = 0; i < bytes.size(); i += 5) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 4);
    EXPECT_THROW(restore_scene(damaged), InputError) << i;
  }
}

}  // namespace
}  // namespace counterpoint::scene_archive_test
