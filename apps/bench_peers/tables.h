// The tables that the benchmark against peers fills.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace counterpoint::apps {

/// One figure: what an engine takes for something on a scene, and how well it does it.
struct PeerRow {
  std::string table;     ///< "algorithms", "steps", ...
  std::string scene;     ///< or robot
  std::string quantity;  ///< "rnea", "step", ...
  std::string engine;
  double seconds = 0.0;  ///< median of the rounds, one evaluation
  double ratio = 0.0;    ///< ours over this one's, median of the ratios within a round; 1 for ours
  std::string quality;   ///< name of the error or residual
  double error = 0.0;    ///< its value; NaN: none
  int nv = 0;
  std::string remark;
};

struct PeerOptions {
  std::filesystem::path scenes;  ///< our data/scenes
  std::filesystem::path robots;  ///< folder of URDFs searched for robots by name; may be empty
  int rounds = 21;               ///< of algorithms
  double slice = 1e-3;           ///< seconds that an algorithm runs at a time
  int step_rounds = 5;           ///< of whole trajectories
  double duration = 2.0;         ///< longest trajectory [s]
};

/// RNEA, ABA, CRBA and poses against Pinocchio; empty without it.
std::vector<PeerRow> compare_algorithms(const PeerOptions& options);

/// Steps forward and inverse against MuJoCo; ours alone without it.
std::vector<PeerRow> compare_steps(const PeerOptions& options);

/// The same from one robot to a hundred and from a hundred boxes to two thousand, and memory.
std::vector<PeerRow> compare_scale(const PeerOptions& options);

/// A file of this name anywhere below `folder`, or empty.
std::filesystem::path find_below(const std::filesystem::path& folder, const std::string& name);

}  // namespace counterpoint::apps
