// Robots of many origins, some deliberately broken: each loads or is rejected with a reason.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/robot_files.h"
#include "support/paths.h"

namespace counterpoint::robots_test {
namespace {

struct IndexRow {
  std::string name, urdf, links, mass;
};

std::vector<IndexRow> read_index(const std::filesystem::path& folder) {
  std::ifstream stream(folder / "INDEX.csv");
  std::vector<IndexRow> rows;
  std::string line;
  std::getline(stream, line);
  while (std::getline(stream, line)) {
    std::vector<std::string> cells;
    std::istringstream cut(line);
    for (std::string cell; std::getline(cut, cell, ',');) cells.push_back(cell);
    if (cells.size() > 9) rows.push_back({cells[0], cells[1], cells[2], cells[9]});
  }
  return rows;
}

double total_mass(const RobotSpec& robot) {
  double mass = 0.0;
  for (const LinkSpec& link : robot.links) mass += link.inertia.mass;
  return mass;
}

// Required parts of the messages for unreadable files.
const std::map<std::string, std::string> kUnreadable = {
    {"malformed_wheel", "wheel.urdf:1: not well-formed XML"},
    {"drake_iiwa_inertial_only", "joint 'iiwa_joint_1': a revolute joint needs <limit"},
};
// Valid on a fixed base; with a floating base some direction would have no inertia.
const std::map<std::string, std::string> kMasslessRoot = {
    {"plane", "planeLink"},      {"cartpole", "slideBar"},   {"hinge_spherical", "baseLink"},
    {"drake_pendulum", "world"}, {"drake_acrobot", "world"}, {"rm75", "world_base"},
    {"prismatic", "baseLink"},
};

struct Outcome {
  bool loaded = false;
  std::string message;
};

/// Builds with the given base and prints a row of the table.
Outcome try_build(const RobotSpec& robot, Base base, const IndexRow& row) {
  const char* base_name = base == Base::kFixed ? "fixed" : "floating";
  try {
    ModelBuilder builder;
    builder.add_robot(robot, base, Pose());
    const Model model = builder.build();
    std::printf("%-26s %-8s %5zu %6d %4d %4d %9.3f %4zu %5zu\n", row.name.c_str(), base_name,
                robot.links.size(), model.num_bodies() - 1, model.nq(), model.nv(),
                total_mass(robot), model.geometries().size(), model.notes().size());
    return {true, ""};
  } catch (const InputError& error) {
    std::printf("%-26s %-8s %5zu refused: %s\n", row.name.c_str(), base_name, robot.links.size(),
                error.what());
    return {false, error.what()};
  }
}

/// Checks that every mesh is present as its full hull with a known standoff; returns their number.
int check_hulls(const RobotSpec& robot) {
  int meshes = 0;
  for (const LinkSpec& link : robot.links) {
    for (const auto& collision : link.collisions) {
      if (collision.shape.type != ShapeType::kConvexMesh) continue;
      ++meshes;
      const ConvexMesh& hull = *collision.shape.mesh;
      EXPECT_EQ(hull.deviation, 0.0) << hull.source;
      EXPECT_TRUE(hull.standoff >= 0.0 && hull.standoff < hull.radius) << hull.source;
    }
  }
  return meshes;
}

TEST(Robots, LoadOrAreRefusedWithAReason) {
  const std::filesystem::path folder = std::filesystem::path(test::shared_data()) / "robots";
  if (!std::filesystem::exists(folder / "INDEX.csv")) {
    GTEST_SKIP() << "no robots in " << folder << "; set COUNTERPOINT_SHARED_DATA";
  }
  std::printf("%-26s %-8s %5s %6s %4s %4s %9s %4s %5s\n", "name", "base", "links", "bodies", "nq",
              "nv", "mass [kg]", "geom", "notes");
  const std::vector<IndexRow> rows = read_index(folder);
  ASSERT_GE(rows.size(), 31u);
  int meshes = 0;
  for (const IndexRow& row : rows) {
    SCOPED_TRACE(row.name);
    RobotSpec robot;
    try {
      robot = load_urdf(folder / row.urdf);
    } catch (const InputError& error) {
      std::printf("%-26s refused: %s\n", row.name.c_str(), error.what());
      const auto reason = kUnreadable.find(row.name);
      if (reason == kUnreadable.end()) {
        ADD_FAILURE() << error.what();
      } else {
        EXPECT_NE(std::string(error.what()).find(reason->second), std::string::npos)
            << error.what();
      }
      continue;
    }
    EXPECT_EQ(kUnreadable.count(row.name), 0u);
    meshes += check_hulls(robot);
    // A link 'world' that joints refer to but the file does not define is added.
    const bool world_added = std::any_of(robot.notes.begin(), robot.notes.end(), [](const Note& n) {
      return n.message.find("no link 'world'") != std::string::npos;
    });
    EXPECT_EQ(robot.links.size(), std::stoul(row.links) + (world_added ? 1 : 0));
    // The index prints masses with three decimals: half a unit of the last one, plus round-off.
    EXPECT_NEAR(total_mass(robot), std::stod(row.mass), 0.5e-3 + 1e-9);
    const Outcome fixed = try_build(robot, Base::kFixed, row);
    EXPECT_TRUE(fixed.loaded) << fixed.message;
    const Outcome floating = try_build(robot, Base::kFloating, row);
    EXPECT_EQ(floating.loaded, kMasslessRoot.count(row.name) == 0) << floating.message;
    if (kMasslessRoot.count(row.name) > 0) {
      EXPECT_NE(floating.message.find("'" + kMasslessRoot.at(row.name) + "'"), std::string::npos);
    }
    for (const Note& note : robot.notes) {
      std::printf("    %s: %s\n", std::filesystem::path(note.where).filename().c_str(),
                  note.message.c_str());
    }
  }
  // 72 collision elements of the readable files are meshes; all must be present.
  EXPECT_EQ(meshes, 72);
}

}  // namespace
}  // namespace counterpoint::robots_test
