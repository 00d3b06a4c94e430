// The tables that the benchmark against peers fills.
#pragma once

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <utility>
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
  /// Of the solver, mean of a step; NaN: there is none.
  double iterations = std::numeric_limits<double>::quiet_NaN();
};

/// A file of figures, in a folder that is made if need be. @throws std::runtime_error if it cannot
/// be written.
std::ofstream open_figures(const std::filesystem::path& file, std::ios::openmode mode);

/// The figures so far: each is printed and written as soon as it is there.
class PeerTable {
 public:
  /// csv: file that holds every figure; empty: none.
  explicit PeerTable(std::filesystem::path csv) : csv_(std::move(csv)) {}
  /// @throws std::runtime_error if the file cannot be written.
  void add(const PeerRow& row);
  const std::vector<PeerRow>& rows() const { return rows_; }

 private:
  std::filesystem::path csv_;
  std::vector<PeerRow> rows_;
};

struct PeerOptions {
  std::filesystem::path scenes;  ///< our data/scenes
  std::filesystem::path robots;  ///< folder of URDFs searched for robots by name; may be empty
  int rounds = 21;               ///< of algorithms
  double slice = 1e-3;           ///< seconds that an algorithm runs at a time
  int step_rounds = 5;           ///< of whole trajectories
  double duration = 2.0;         ///< longest trajectory [s]
  int robot_count = 25;          ///< of the table of robots, at most; MuJoCo refuses some
  double limit = 60.0;           ///< seconds an engine may take for a pile's or robot's trajectory
};

/// RNEA, ABA, CRBA and poses against Pinocchio; nothing without it.
void compare_algorithms(const PeerOptions& options, PeerTable& table);

/// Derivatives of RNEA and ABA against Pinocchio, nothing without it; then of steps, inverse and
/// forward, against differences of ours and MuJoCo's own; ours alone without it.
void compare_derivatives(const PeerOptions& options, PeerTable& table);
void compare_step_derivatives(const PeerOptions& options, PeerTable& table);

/// Steps forward and inverse against MuJoCo; ours alone without it.
void compare_steps(const PeerOptions& options, PeerTable& table);

/// The same from one robot to a thousand and from a hundred boxes to ten thousand, and memory;
/// MuJoCo up to kLargestForPeers velocities. Before them ours in all sizes in turn ("growth").
void compare_scale(const PeerOptions& options, PeerTable& table);

/// Steps alone: random piles, and robots found below options.robots.
void compare_piles(const PeerOptions& options, PeerTable& table);
void compare_robots(const PeerOptions& options, PeerTable& table);

/// Steps of all these scenes with ours as soft and smooth as MuJoCo is by default: compliance 0.1,
/// convex friction.
void compare_softness(const PeerOptions& options, PeerTable& table);

/// A file of this name anywhere below `folder`, or empty.
std::filesystem::path find_below(const std::filesystem::path& folder, const std::string& name);

}  // namespace counterpoint::apps
