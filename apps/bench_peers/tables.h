// Tables of the benchmark against other engines.
#pragma once

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace counterpoint::apps {

/// One figure: the time that an engine takes for a quantity on a scene, and its error.
struct PeerRow {
  std::string table;     ///< "algorithms", "steps", ...
  std::string scene;     ///< scene or robot
  std::string quantity;  ///< "rnea", "step", ...
  std::string engine;
  double seconds = 0.0;  ///< median over the rounds, for one evaluation
  double ratio = 0.0;    ///< our time divided by this one, median of the ratios within a round; 1
                         ///< for ours
  std::string quality;   ///< name of the error or residual
  double error = 0.0;    ///< value of the error; NaN: none
  int nv = 0;
  std::string remark;
  /// Solver iterations, mean per step; NaN: none.
  double iterations = std::numeric_limits<double>::quiet_NaN();
};

/// Opens a file for figures; creates its folder if necessary. @throws std::runtime_error if it
/// cannot be written.
std::ofstream open_metrics(const std::filesystem::path& file, std::ios::openmode mode);

/// The figures so far: each is printed and written immediately.
class PeerTable {
 public:
  /// csv: file for every figure; empty: none.
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
  int rounds = 21;               ///< rounds of algorithms
  double slice = 1e-3;           ///< duration of one run of an algorithm [s]
  int step_rounds = 5;           ///< rounds of whole trajectories
  double duration = 2.0;         ///< longest trajectory [s]
  int robot_count = 25;          ///< largest number of robots in a table; MuJoCo refuses some
  double limit = 60.0;           ///< largest time of an engine for a trajectory [s]
};

/// Compares RNEA, ABA, CRBA and poses with Pinocchio; does nothing without it.
void compare_algorithms(const PeerOptions& options, PeerTable& table);

/// Compares derivatives of RNEA and ABA with Pinocchio, if available; then derivatives of steps,
/// inverse and forward, with differences of ours and with MuJoCo's own, if available.
void compare_derivatives(const PeerOptions& options, PeerTable& table);
void compare_step_derivatives(const PeerOptions& options, PeerTable& table);

/// Compares steps forward and inverse with MuJoCo; times ours alone without it.
void compare_steps(const PeerOptions& options, PeerTable& table);

/// Compares steps and memory from one robot to a thousand and from a hundred boxes to ten thousand;
/// MuJoCo up to kLargestForPeers velocities. First times ours in all sizes in turn ("growth").
void compare_scale(const PeerOptions& options, PeerTable& table);

/// Compares steps only, for random piles and for robots found below options.robots.
void compare_piles(const PeerOptions& options, PeerTable& table);
void compare_robots(const PeerOptions& options, PeerTable& table);

/// Compares steps of all these scenes with our contacts as soft and smooth as MuJoCo's defaults:
/// compliance 0.1, convex friction.
void compare_softness(const PeerOptions& options, PeerTable& table);

/// Path of a file with this name anywhere below options.robots; empty, with a message, if there is
/// none.
std::filesystem::path find_robot(const PeerOptions& options, const std::string& name);

/// Scenes of data/scenes that steps are compared on.
inline const std::vector<std::string> kKnownScenes = {"humanoid_drop", "stack_5", "pyramid_5",
                                                      "grid_5", "pack_4"};

}  // namespace counterpoint::apps
