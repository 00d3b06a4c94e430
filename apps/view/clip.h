// The part of a motion that a replay shows: some of its states, and the contact forces in them.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/step.h"
#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::view {

/// A force between two shapes, as in the table of `counterpoint inverse --contacts`.
struct Contact {
  int frame = 0;  ///< frame of the clip
  int geometry_a = 0, geometry_b = 0;
  Vector3 position = Vector3::Zero();  ///< contact point in W [m]
  Vector3 force = Vector3::Zero();     ///< force on geometry B, in W [N]
};

/// The force of a closure at one frame.
struct ClosureArrow {
  int frame = 0;                       ///< frame of the clip
  int closure = 0;                     ///< index into Model::closures
  Vector3 position = Vector3::Zero();  ///< point of application in W [m]
  Vector3 force = Vector3::Zero();     ///< force on body B, in W [N]
};

/// Frames of a motion, by increasing time.
struct Clip {
  std::string name;
  std::vector<State> states;                 ///< q always; v may be empty if unknown
  std::vector<VectorX> applied_force;        ///< in the step from each frame (nv); empty if unknown
  std::vector<std::vector<char>> asleep;     ///< flags by frame and tree; empty if unknown
  std::vector<Contact> contacts;             ///< sorted by frame
  std::vector<ClosureArrow> closure_forces;  ///< sorted by frame
  std::vector<int> newton_iterations;        ///< in the step from each frame; empty if unknown
  bool has_contacts = false;                 ///< contacts were computed
  long rows = 0;                             ///< rows of the motion, before selecting frames
  int num_frames() const { return static_cast<int>(states.size()); }
};

/// Returns for each tree whether q and v are the same, to the bit, before and after a step.
std::vector<char> trees_at_rest(const Model& model, const State& before, const State& after);

/// Force that arrows show [N]: on body B, or on A if B is the world.
inline Vector3 force_on_moving(int body_b, const Vector3& force_on_b) {
  return body_b == 0 ? Vector3(-force_on_b) : force_on_b;
}

inline constexpr double kDefaultRate = 100.0;  ///< [frames/s]

/// Chooses the frames of a clip among the states of a motion.
class FrameClock {
 public:
  /// @param rate frames per second [1/s]; 0: every state is a frame
  explicit FrameClock(double rate) : rate_(rate) {}
  /// Returns true if the state at `time` [s] is a frame. Times increase.
  bool due(double time);
  /// Halves the rate after the frame at `last` [s].
  void halve(double last);
  double rate() const { return rate_; }

 private:
  double position(double time) const;

  double rate_;
  std::optional<double> start_;  ///< [s]
  double next_ = 0.0;            ///< index of the next frame, counted at `rate_`
};

/// Records a motion step by step, keeping `rate` frames per second [1/s]; 0 keeps all.
class ClipRecorder {
 public:
  /// @param forces recover contact and closure forces from the motion, as `counterpoint inverse`
  ///     does, if the integrator has an inverse
  /// @param most limit on the number of frames; beyond it every other frame is dropped and the rate
  ///     halved; 0: no limit
  ClipRecorder(const Scene& scene, double rate, bool forces, int most = 0);

  /// Frames from now on have the applied forces that the inverse finds, not those of the input.
  void find_applied_forces() { finds_applied_ = true; }
  /// Adds a step of length h [s] from `before` to `after` under `input`. newton_iterations: those
  /// of the step; negative if unknown.
  void add_step(const State& before, const Input& input, double h, const State& after,
                int newton_iterations = -1);
  /// Adds the last state and returns the clip. The last frame also shows the contacts of the last
  /// step.
  Clip finish(const State& last);

 private:
  void thin_out();
  void add_frame(const State& state, const VectorX& force);
  void add_contacts(const State& before, const Input& input, double h, const State& after);

  const Scene& scene_;
  SimulationOptions options_;
  FrameClock clock_;
  bool forces_, finds_applied_ = false;
  int most_;
  Workspace workspace_;
  Inverse inverse_;
  Clip clip_;
  State before_, after_;
  Input input_;
  double h_ = 0.0;
};

/// Returns the clip of a trajectory. step_lengths [s] may be empty if forces is false. Calls
/// `progress`, if given, with the number of steps done; if it returns false, the clip ends there.
Clip clip_of(const Scene& scene, const Trajectory& trajectory,
             const std::vector<double>& step_lengths, double rate, bool forces,
             const std::function<bool(int)>& progress = {});

/// Returns the clip of a motion given by its frames (nq), which are a time step of the scene's
/// options apart, the first at `start` [s]. Velocities are differences, forces those of the
/// inverse.
Clip clip_of_frames(const Scene& scene, double start, const std::vector<VectorX>& q, double rate);

/// Reads the table of `inverse --contacts` and adds the contacts at the times of the clip's frames.
/// @throws InputError naming file and line for an unknown shape, an invalid number or a missing
/// column, and if no time in the table matches the clip's.
void read_contacts(const std::filesystem::path& file, const Model& model, Clip& clip);

}  // namespace counterpoint::view
