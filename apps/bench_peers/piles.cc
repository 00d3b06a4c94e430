// Steps of random piles and of many robots, at our default softness and at MuJoCo's.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "runners.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kSoftCompliance = 0.1;

void make_soft(Scene& scene) {
  scene.options.contact.compliance = kSoftCompliance;
  scene.options.contact.friction_model = FrictionModel::kConvex;
}

struct Named {
  std::string name;
  Scene scene;
};

/// Maps each folder directly below `folder` (robots/X counts as X) to its URDF with the shortest
/// file name.
std::map<std::string, fs::path> one_urdf_a_robot(const fs::path& folder) {
  std::map<std::string, fs::path> chosen;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".urdf") continue;
    const fs::path below = entry.path().lexically_relative(folder);
    auto part = below.begin();
    if (*part == "robots" && std::distance(below.begin(), below.end()) > 2) ++part;
    fs::path& best = chosen[part->string()];
    const auto rank = [](const fs::path& path) {
      return std::pair(path.filename().string().size(), path);
    };
    if (best.empty() || rank(entry.path()) < rank(best)) best = entry.path();
  }
  return chosen;
}

bool touches_ground(const Scene& scene) {
  return std::any_of(scene.model.geometries().begin(), scene.model.geometries().end(),
                     [](const Geometry& g) { return g.body != 0; });
}

/// Robots below options.robots that can be dropped on the ground; options.robot_count at most.
std::vector<Named> robots(const PeerOptions& options) {
  std::vector<Named> found;
  if (!fs::is_directory(options.robots)) {
    fmt::print("Skipped: robots; --robots: expected a folder with URDFs below it.\n");
    return found;
  }
  for (const auto& [folder, urdf] : one_urdf_a_robot(options.robots)) {
    if (static_cast<int>(found.size()) == options.robot_count) break;
    const std::string name = folder.substr(0, folder.find("_description"));
    try {
      Named robot{name, dropped(urdf)};
      if (touches_ground(robot.scene)) {
        found.push_back(std::move(robot));
      } else {
        fmt::print("Skipped: {}: it has no shapes that collide.\n", name);
      }
    } catch (const std::exception& error) {
      fmt::print("Skipped: {}: {}\n", name, error.what());
    }
  }
  return found;
}

std::vector<Named> bundled(const PeerOptions& options, const std::vector<std::string>& names) {
  std::vector<Named> found;
  found.reserve(names.size());
  for (const std::string& name : names)
    found.push_back(
        {fs::path(name).filename().string(), load_scene(options.scenes / (name + ".yaml"))});
  return found;
}

std::vector<Named> piles(const PeerOptions& options) {
  return bundled(options, {"piles/pile_16", "piles/pile_64", "piles/pile_200", "piles/bin_64",
                           "piles/chain_into_pile", "piles/pile_16_masses"});
}

void compare(const std::vector<Named>& scenes, const std::string& name, const PeerOptions& options,
             PeerTable& table) {
  for (const Named& n : scenes)
    try_scene(n.scene,
              {name, n.name, steps_of(n.scene, options), options.step_rounds, false, options.limit},
              table);
}

}  // namespace

void compare_piles(const PeerOptions& options, PeerTable& table) {
  compare(piles(options), "piles", options, table);
}

void compare_robots(const PeerOptions& options, PeerTable& table) {
  compare(robots(options), "robots", options, table);
}

void compare_softness(const PeerOptions& options, PeerTable& table) {
  for (std::vector<Named> scenes :
       {bundled(options, kKnownScenes), piles(options), robots(options)}) {
    for (Named& n : scenes) make_soft(n.scene);
    compare(scenes, "softness", options, table);
  }
}

}  // namespace counterpoint::apps
