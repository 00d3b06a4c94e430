// Compares the convex pieces of meshes with the hulls that the robots of mujoco_menagerie have for
// the same bodies, made by hand or with other programs. Writes docs/measurements/pieces.md.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "counterpoint/model/mesh/round_hull.h"
#include "counterpoint/model/mjcf/bodies/bodies.h"
#include "counterpoint/model/pieces/solid.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

namespace fs = std::filesystem;

// Tolerance for the first measurement of their hulls, and the least at which ours are made,
// relative to the diameter.
constexpr double kFirst = 0.01, kLeast = 0.002;
// Difference of distances that count as equal, relative to theirs: the accuracy of measurement.
constexpr double kEqual = 0.05;
// Largest number of our pieces: a multiple of any number of theirs.
constexpr int kMost = 256;

constexpr const char* kIntroduction = R"(# Convex pieces beside hulls made by hand

Written by counterpoint_bench_pieces
([how, and what it finds](../guide/not-convex.md#beside-hulls-by-hand)). A row is a link of
mujoco_menagerie: its mesh for display (triangles; open: not closed; diameter [mm]), the hulls with
which it collides there (\*: of parts of that mesh; else made for contact), and our pieces at the
same distance. outside: the largest distance from a surface of hulls or pieces to the solid within
the mesh, closed hollows filled; inside: from the mesh to hulls or pieces [mm]; both by one
function. s: time of cutting. lost: ours are more, or farther off than the larger of the two by over
5 %.

)";
constexpr const char* kHead = R"(
| link | triangles | diameter | hulls | outside | inside | pieces | outside | inside | s | lost |
|---|---|---|---|---|---|---|---|---|---|---|
)";

/// A body with its mesh for display, and the hulls that touch in its place.
struct Link {
  std::string robot, body;
  TriangleMesh mesh;
  std::vector<std::shared_ptr<const ConvexMesh>> hulls;
  bool made_for_contact;  // no hull is that of a part of the mesh
};

std::shared_ptr<const ConvexMesh> moved(const ConvexMesh& hull, const Pose& X_BG) {
  std::vector<Vector3> points;
  for (const Vector3& p : hull.vertices) points.push_back(X_BG * p);
  return make_convex_hull(points);
}

/// The hull of a shape: round ones are polyhedra inside it.
std::shared_ptr<const ConvexMesh> hull_of(const Shape& shape) {
  constexpr int kCorners = 32;
  std::vector<Vector3> points;
  const Vector3& s = shape.size;
  switch (shape.type) {
    case ShapeType::kConvexMesh:
      return shape.mesh;
    case ShapeType::kSphere:
      return ellipsoid_hull(Vector3::Constant(s[0])).hull;
    case ShapeType::kBox:
      for (int k = 0; k < 8; ++k)
        points.emplace_back(k & 1 ? s[0] : -s[0], k & 2 ? s[1] : -s[1], k & 4 ? s[2] : -s[2]);
      break;
    case ShapeType::kCylinder:
      for (int k = 0; k < kCorners; ++k)
        for (const double z : {-s[1], s[1]})
          points.emplace_back(s[0] * std::cos(2.0 * M_PI * k / kCorners),
                              s[0] * std::sin(2.0 * M_PI * k / kCorners), z);
      break;
    case ShapeType::kCapsule:
      for (const Vector3& p : ellipsoid_hull(Vector3::Constant(s[0])).hull->vertices)
        for (const double z : {-s[1], s[1]}) points.push_back(p + Vector3(0, 0, z));
      break;
    default:
      throw InputError("planes and height fields have no hull");
  }
  return make_convex_hull(points);
}

void append(const TriangleMesh& part, const Pose& X_BG, TriangleMesh& whole) {
  const int first = static_cast<int>(whole.vertices.size());
  for (const Vector3& p : part.vertices) whole.vertices.push_back(X_BG * p);
  for (const auto& t : part.triangles)
    whole.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

/// Reads the bodies of a robot that have a mesh for display and at least two hulls of meshes.
/// `absent`: meshes that the folder lacks.
std::vector<Link> read_links(const std::string& robot, const fs::path& file,
                             const std::set<std::string>& absent) {
  MjcfOptions options;
  options.hulls = std::make_shared<HullCache>(0, MeshCollisions{{MeshKind::kHull, 0.0, 1}, {}});
  mjcf::Document document(file, options);
  const mjcf::Defaults defaults(document);
  MjcfModel model;
  mjcf::Assets assets(document, defaults);
  const mjcf::Bodies bodies = mjcf::read_bodies(document, defaults, model);
  std::vector<Link> links;
  for (std::size_t b = 1; b < bodies.bodies.size(); ++b) {
    Link link{robot, bodies.bodies[b].link, {}, {}, true};
    std::set<std::string> shown;
    int meshes = 0;
    bool whole = true;
    for (const bool touches : {false, true}) {
      for (const mjcf::Geom& given : bodies.geoms) {
        if (given.body != static_cast<int>(b)) continue;
        if (touches != ((given.contype | given.conaffinity) != 0)) continue;
        if (!touches && given.type != "mesh") continue;
        whole = whole && !absent.contains(given.mesh);
        if (touches) {
          const mjcf::Geom geom = mjcf::resolved(given, assets, document);
          link.hulls.push_back(moved(*hull_of(mjcf::shape_of(geom, assets, document)), geom.X_BG));
          meshes += given.type == "mesh";
          if (shown.contains(given.mesh)) link.made_for_contact = false;
        } else {
          append(assets.triangles(given.mesh, *given.element), given.X_BG, link.mesh);
          shown.insert(given.mesh);
        }
      }
    }
    if (meshes >= 2 && whole && !link.mesh.triangles.empty()) links.push_back(std::move(link));
  }
  return links;
}

struct Row {
  std::string name;
  bool made_for_contact, closed;
  std::size_t triangles;
  double diameter;                     // [m]
  int theirs;                          // number of hulls
  double their_outside, their_inside;  // [m]
  int ours;                            // number of pieces
  double our_outside, our_inside;      // [m]
  double seconds;

  double their_error() const { return std::max(their_outside, their_inside); }
  double our_error() const { return std::max(our_outside, our_inside); }
  /// True if ours are as near to the mesh, to the accuracy of the measurement.
  bool as_near() const { return our_error() <= (1.0 + kEqual) * their_error(); }
  bool won() const { return as_near() && ours <= theirs; }
};

Row compare(const Link& link) {
  const auto hull = make_convex_hull(link.mesh.vertices);
  const double diameter = 2.0 * hull->radius;
  TriangleMesh mesh = link.mesh;
  if (enclosed_volume(mesh) < 0.0)
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  Pieces theirs;
  theirs.pieces = link.hulls;
  double tolerance = kFirst * diameter;
  pieces::measure_pieces(pieces::Solid(mesh, mesh, *hull, tolerance), mesh, theirs);
  tolerance = std::max({theirs.outside, theirs.inside, kLeast * diameter});
  const pieces::Solid solid(mesh, mesh, *hull, tolerance);
  pieces::measure_pieces(solid, mesh, theirs);
  const auto start = std::chrono::steady_clock::now();
  Pieces ours = convex_pieces(mesh, {MeshKind::kPieces, tolerance, kMost});
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  pieces::measure_pieces(solid, mesh, ours);
  return {link.robot + ": " + link.body,
          link.made_for_contact,
          is_closed(mesh),
          mesh.triangles.size(),
          diameter,
          static_cast<int>(link.hulls.size()),
          theirs.outside,
          theirs.inside,
          static_cast<int>(ours.pieces.size()),
          ours.outside,
          ours.inside,
          seconds};
}

std::string line_of(const Row& r) {
  const auto mm = [](double metres) { return fmt::format("{:.2f}", 1e3 * metres); };
  return fmt::format("| {}{} | {}{} | {:.0f} | {} | {} | {} | {} | {} | {} | {:.2f} | {} |\n",
                     r.name, r.made_for_contact ? "" : " \\*", r.triangles, r.closed ? "" : " open",
                     1e3 * r.diameter, r.theirs, mm(r.their_outside), mm(r.their_inside), r.ours,
                     mm(r.our_outside), mm(r.our_inside), r.seconds,
                     r.won()       ? ""
                     : r.as_near() ? "more"
                                   : "farther");
}

/// Reads the meshes that a folder lacks: the stems of the files in ABSENT.txt, by robot.
std::map<std::string, std::set<std::string>> absent_in(const fs::path& folder) {
  std::map<std::string, std::set<std::string>> out;
  std::ifstream list(folder / "ABSENT.txt");
  for (std::string line; std::getline(list, line);)
    out[line.substr(0, line.find('/'))].insert(fs::path(line).stem().string());
  return out;
}

/// Compares the links of all robots; those of a robot that agree in their numbers of triangles and
/// hulls, such as left and right, count once.
std::vector<Row> compare_all(const fs::path& folder, const std::string& only) {
  auto absent = absent_in(folder);
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".xml" && entry.path().string().find(only) != std::string::npos)
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<Row> rows;
  std::set<std::tuple<std::string, std::size_t, std::size_t>> seen;
  for (const fs::path& file : files) {
    try {
      const std::string robot = fs::relative(file, folder).begin()->string();
      for (const Link& link : read_links(robot, file, absent[robot])) {
        if (!seen.insert({link.robot, link.mesh.triangles.size(), link.hulls.size()}).second)
          continue;
        rows.push_back(compare(link));
        fmt::print("{}", line_of(rows.back()));
        std::fflush(stdout);
      }
    } catch (const InputError& error) {
      fmt::print("Left out: {}\n", error.what());
    }
  }
  return rows;
}

std::string summary_of(const std::vector<Row>& rows, bool made_for_contact) {
  int links = 0, won = 0, theirs = 0, ours = 0;
  double seconds = 0.0;
  for (const Row& r : rows) {
    if (r.made_for_contact != made_for_contact) continue;
    ++links;
    won += r.won();
    theirs += r.theirs;
    ours += r.ours;
    seconds += r.seconds;
  }
  return fmt::format(
      "{} links with {} hulls;\n{} pieces at the same distance, cut in {:.1f} s; no more pieces "
      "than hulls for {} links.\n",
      links, theirs, ours, seconds, won);
}

int run(const fs::path& folder, const std::string& only, const fs::path& out) {
  if (!fs::is_directory(folder)) {
    fmt::print("Skipped: there is no folder {}; scripts/models/menagerie.py makes it.\n",
               folder.string());
    return 0;
  }
  const std::vector<Row> rows = compare_all(folder, only);
  const std::string summary =
      "Hulls made for contact: " + summary_of(rows, true) +
      "\nHulls of parts of the mesh for display (\\*): " + summary_of(rows, false);
  fmt::print("{}", summary);
  if (out.empty()) return 0;
  std::ofstream page(out);
  page << kIntroduction << summary << kHead;
  for (const Row& r : rows) page << line_of(r);
  return page ? 0 : 1;
}

}  // namespace
}  // namespace counterpoint

int main(int argc, char** argv) {
  CLI::App app("Compares convex pieces with the hulls of a collection of MJCF files.");
  std::string folder, only, out;
  app.add_option("FOLDER", folder, "The folder of mujoco_menagerie: a folder a robot")->required();
  app.add_option("--only", only, "Files whose paths hold this");
  app.add_option("--out", out, "Markdown file for the table");
  CLI11_PARSE(app, argc, argv);
  return counterpoint::run(folder, only, out);
}
