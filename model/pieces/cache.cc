#include "counterpoint/model/pieces/cache.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>

#include "counterpoint/model/files/archive.h"

namespace counterpoint {
namespace {

// Grows whenever pieces of the same mesh change, or the format.
constexpr std::uint64_t kVersion = 4;
// Read with another byte order it is another number.
constexpr std::uint64_t kMagic = 0x43504e5450494543;
// Meshes of fewer triangles are cut about as fast as a file is read.
constexpr std::size_t kLeastTriangles = 100;
constexpr std::uintmax_t kMostBytes = 256'000'000;

/// Two hashes of 64 bits (multiply and rotate).
struct Hash {
  std::uint64_t a = 0x9e3779b97f4a7c15, b = 0xc2b2ae3d27d4eb4f;

  void add(std::uint64_t word) {
    a = (a ^ word) * 0xff51afd7ed558ccd;
    a ^= a >> 29;
    b = (b + word) * 0xc4ceb9fe1a85ec53;
    b = (b << 31) | (b >> 33);
  }
  void add(const char* bytes, std::size_t count) {
    for (std::size_t i = 0; i < count; i += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes + i, std::min<std::size_t>(8, count - i));
      add(word);
    }
    add(count);
  }
};

Hash key_of(const TriangleMesh& mesh, const MeshCollision& options) {
  Hash out;
  out.add(kVersion);
  const double tolerance = options.tolerance;
  out.add(reinterpret_cast<const char*>(&tolerance), sizeof tolerance);
  out.add(static_cast<std::uint64_t>(options.most));
  out.add(reinterpret_cast<const char*>(mesh.vertices.data()),
          mesh.vertices.size() * sizeof(Vector3));
  out.add(reinterpret_cast<const char*>(mesh.triangles.data()),
          mesh.triangles.size() * sizeof(std::array<int, 3>));
  return out;
}

/// Hash of the contents, which tells a damaged file.
std::uint64_t sum_of(const Hash& key, const std::string& bytes) {
  Hash sum = key;
  sum.add(bytes.data(), bytes.size());
  return sum.a ^ sum.b;
}

std::optional<Pieces> read(const std::filesystem::path& file, const Hash& key,
                           const std::string& source) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error || size > kMostBytes) return std::nullopt;
  std::ifstream in(file, std::ios::binary);
  std::uint64_t head[2] = {};
  in.read(reinterpret_cast<char*>(head), sizeof head);
  if (!in || head[0] != kMagic) return std::nullopt;
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  if (head[1] != sum_of(key, bytes)) return std::nullopt;
  Pieces out;
  try {
    archive::Reader reader(bytes, "pieces");
    std::uint64_t count = 0;
    reader(out.tolerance, out.outside, out.inside, out.reason, count);
    for (std::uint64_t i = 0; i < count; ++i) {
      auto piece = std::make_shared<ConvexMesh>();
      reader(*piece);
      piece->source = source;
      out.pieces.push_back(std::move(piece));
    }
    if (count == 0 || !reader.bytes.empty()) return std::nullopt;
  } catch (const InputError&) {
    return std::nullopt;
  }
  return out;
}

/// Writes a file of another name and renames it, so that no reader sees a part.
void write(const std::filesystem::path& file, const Hash& key, const Pieces& pieces) {
  static std::atomic<int> count = 0;  // names of threads differ
  archive::Writer writer;
  Pieces copy = pieces;
  std::uint64_t size = copy.pieces.size();
  writer(copy.tolerance, copy.outside, copy.inside, copy.reason, size);
  for (const auto& piece : copy.pieces) {
    ConvexMesh one = *piece;
    writer(one);
  }
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  if (error) return;
  const std::filesystem::path draft =
      file.parent_path() /
      fmt::format("{}.{}.{}", file.filename().string(), ::getpid(), count.fetch_add(1));
  {
    std::ofstream out(draft, std::ios::binary);
    const std::uint64_t head[2] = {kMagic, sum_of(key, writer.bytes)};
    out.write(reinterpret_cast<const char*>(head), sizeof head);
    out.write(writer.bytes.data(), static_cast<std::streamsize>(writer.bytes.size()));
    if (out.flush()) std::filesystem::rename(draft, file, error);
  }
  std::filesystem::remove(draft, error);
}

}  // namespace

std::filesystem::path cache_folder() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value == nullptr ? "" : value);
  };
  if (variable("COUNTERPOINT_CACHE") == "off") return {};
  const std::filesystem::path cache = variable("XDG_CACHE_HOME"), home = variable("HOME");
  if (cache.is_absolute()) return cache / "counterpoint";
  return home.is_absolute() ? home / ".cache" / "counterpoint" : std::filesystem::path();
}

Pieces cached_pieces(const TriangleMesh& mesh, const MeshCollision& options,
                     const std::string& source, const std::filesystem::path& folder) {
  if (folder.empty() || mesh.triangles.size() < kLeastTriangles)
    return convex_pieces(mesh, options, source);
  const Hash key = key_of(mesh, options);
  const std::filesystem::path file = folder / fmt::format("{:016x}{:016x}.pieces", key.a, key.b);
  if (std::optional<Pieces> found = read(file, key, source)) return std::move(*found);
  Pieces out = convex_pieces(mesh, options, source);
  write(file, key, out);
  return out;
}

}  // namespace counterpoint
