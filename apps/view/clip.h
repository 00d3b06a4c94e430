// What a replay shows of a motion: some of its moments, and the contact forces that act in them.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "counterpoint/engine/motion_files.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::view {

/// A force between two shapes, as the table of `counterpoint inverse --contacts` has it.
struct Contact {
  int frame = 0;  ///< of the clip
  int geometry_a = 0, geometry_b = 0;
  Vector3 position = Vector3::Zero();  ///< in W [m]
  Vector3 force = Vector3::Zero();     ///< on geometry B, in W [N]
};

/// What holds two bodies together, at a moment.
struct ClosureArrow {
  int frame = 0;                       ///< of the clip
  int closure = 0;                     ///< index into Model::closures
  Vector3 position = Vector3::Zero();  ///< in W [m]
  Vector3 force = Vector3::Zero();     ///< on body B, in W [N]
};

/// Moments of a motion, in rising time.
struct Clip {
  std::string name;
  std::vector<State> states;                 ///< q always, v empty where nothing is known of it
  std::vector<VectorX> applied_force;        ///< nv, of the step from each; empty where unknown
  std::vector<std::vector<char>> asleep;     ///< by frame and tree; empty where unknown
  std::vector<Contact> contacts;             ///< by rising frame
  std::vector<ClosureArrow> closure_forces;  ///< by rising frame
  std::vector<int> newton_iterations;        ///< of the step from each frame; empty where unknown
  bool has_contacts = false;                 ///< contacts were looked for
  long rows = 0;                             ///< of the motion that the frames were taken from
  int num_frames() const { return static_cast<int>(states.size()); }
};

inline constexpr double kDefaultRate = 100.0;  ///< [frames/s]

/// Takes a motion step by step, and keeps `rate` moments a second of it [1/s]; 0: all.
class ClipRecorder {
 public:
  /// forces: those of contacts and closures are recovered from the motion, as `counterpoint
  /// inverse` does, where the integrator has an inverse. most: of frames; where there are more
  /// every other one goes, and the rate is halved; 0: no limit.
  ClipRecorder(const Scene& scene, double rate, bool forces, int most = 0);

  /// A step of length h [s] from `before` to `after` under `input`.
  /// newton_iterations: that it took; below 0: unknown.
  void add_step(const State& before, const Input& input, double h, const State& after,
                int newton_iterations = -1);
  /// The last state. The contacts of the last step are shown with it too.
  Clip finish(const State& last);

 private:
  void thin_out();
  void add_frame(const State& state, const VectorX& force);
  void add_contacts(const State& before, const Input& input, double h, const State& after);

  const Scene& scene_;
  SimulationOptions options_;
  double rate_;
  bool forces_;
  int most_;
  Workspace workspace_;
  Inverse inverse_;
  Clip clip_;
  double start_ = 0.0;  ///< [s]
  long next_ = 0;       ///< number of the next frame, counted at `rate`
  State before_, after_;
  Input input_;
  double h_ = 0.0;
};

/// The clip of a trajectory. step_lengths may be empty without forces. progress, if there is one,
/// is called with the number of steps done; false ends the clip there.
Clip clip_of(const Scene& scene, const Trajectory& trajectory,
             const std::vector<double>& step_lengths, double rate, bool forces,
             const std::function<bool(int)>& progress = {});

/// Reads the table of `inverse --contacts`; contacts at the times of the clip's frames become its
/// own. @throws InputError naming file and line for a shape that the scene has not, a number that
/// is none, a missing column, times that are all apart from the clip's.
void read_contacts(const std::filesystem::path& file, const Model& model, Clip& clip);

}  // namespace counterpoint::view
