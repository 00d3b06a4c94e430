// Files with the pieces of meshes: the same bits as without, and no harm from bad files or folders.
#include "counterpoint/model/pieces/cache.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <iterator>

#include "support/shapes/solids.h"

namespace counterpoint::pieces_test {
namespace {

namespace fs = std::filesystem;

const MeshCollision kOptions{MeshKind::kPieces, 0.0, 64};

class PiecesCache : public testing::Test {
 protected:
  PiecesCache() : folder_(fs::path(testing::TempDir()) / name()) { fs::remove_all(folder_); }
  ~PiecesCache() override { fs::remove_all(folder_); }

  static std::string name() {
    return std::string("pieces_cache_") +
           testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  Pieces get(const MeshCollision& options = kOptions) const {
    return cached_pieces(mesh_, options, "mesh", folder_ / "new");
  }
  std::vector<fs::path> files() const {
    std::vector<fs::path> out;
    for (const auto& entry : fs::directory_iterator(folder_ / "new")) out.push_back(entry.path());
    return out;
  }
  static std::string read(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void write(const fs::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
  }

  TriangleMesh mesh_ = test::cup(0.04, 0.1, 0.004, 16);
  fs::path folder_;
};

void expect_same(const Pieces& a, const Pieces& b) {
  EXPECT_EQ(a.tolerance, b.tolerance);
  EXPECT_EQ(a.outside, b.outside);
  EXPECT_EQ(a.inside, b.inside);
  EXPECT_EQ(a.reason, b.reason);
  ASSERT_EQ(a.pieces.size(), b.pieces.size());
  for (std::size_t i = 0; i < a.pieces.size(); ++i) {
    const ConvexMesh &p = *a.pieces[i], &q = *b.pieces[i];
    EXPECT_EQ(p.vertices, q.vertices);
    EXPECT_EQ(p.faces, q.faces);
    EXPECT_EQ(p.face_normals, q.face_normals);
    EXPECT_EQ(p.face_offsets, q.face_offsets);
    EXPECT_EQ(p.vertex_neighbors.begin, q.vertex_neighbors.begin);
    ASSERT_EQ(p.vertex_neighbors.all.size(), q.vertex_neighbors.all.size());
    for (std::size_t k = 0; k < p.vertex_neighbors.all.size(); ++k) {
      EXPECT_EQ(p.vertex_neighbors.all[k].place, q.vertex_neighbors.all[k].place);
      EXPECT_EQ(p.vertex_neighbors.all[k].vertex, q.vertex_neighbors.all[k].vertex);
    }
    EXPECT_EQ(p.vertex_faces, q.vertex_faces);
    EXPECT_EQ(p.vertex_columns, q.vertex_columns);
    EXPECT_EQ(p.normal_columns, q.normal_columns);
    EXPECT_EQ(p.interior_point, q.interior_point);
    EXPECT_EQ(p.radius, q.radius);
    EXPECT_EQ(p.volume, q.volume);
    EXPECT_EQ(p.source, q.source);
  }
}

TEST_F(PiecesCache, AFileGivesTheSameBits) {
  const Pieces without = convex_pieces(mesh_, kOptions, "mesh");
  expect_same(get(), without);
  ASSERT_EQ(files().size(), 1U);  // and no draft
  expect_same(get(), without);
}

TEST_F(PiecesCache, OneFileForEachMeshScaleAndSetting) {
  get();
  const fs::path first = files()[0];
  get({MeshKind::kPieces, 0.01, 64});
  get({MeshKind::kPieces, 0.0, 3});
  for (Vector3& p : mesh_.vertices) p *= 2.0;
  get();
  EXPECT_EQ(files().size(), 4U);
  const auto time = fs::last_write_time(first) - std::chrono::hours(1);
  fs::last_write_time(first, time);
  for (Vector3& p : mesh_.vertices) p *= 0.5;
  get();
  EXPECT_EQ(fs::last_write_time(first), time);  // read, not written
}

TEST_F(PiecesCache, DamagedAndForeignFilesAreWrittenAnew) {
  const Pieces good = get();
  const fs::path file = files()[0];
  const std::string bytes = read(file);
  std::string flipped = bytes, longer = bytes + "x", other = bytes;
  flipped[bytes.size() / 2] ^= 1;
  other[0] ^= 1;
  for (const std::string& bad :
       {flipped, longer, other, bytes.substr(0, bytes.size() / 2), bytes.substr(0, 9),
        std::string(), std::string("a file of someone else"), std::string(100, '\xff')}) {
    write(file, bad);
    expect_same(get(), good);
    EXPECT_EQ(read(file), bytes);
  }
}

TEST_F(PiecesCache, FoldersThatCannotBeWrittenAreNoError) {
  const Pieces good = convex_pieces(mesh_, kOptions, "mesh");
  fs::create_directories(folder_);
  write(folder_ / "file", "");
  for (const fs::path& folder : {fs::path(), folder_ / "file" / "below", fs::path("/proc/none")})
    expect_same(cached_pieces(mesh_, kOptions, "mesh", folder), good);
}

}  // namespace
}  // namespace counterpoint::pieces_test
