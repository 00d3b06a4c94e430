// Islands at rest are left out of the step, to the same bits.
//
// A step is a function of (q, w, input). Where it returned an island's (q, w) unchanged to the last
// bit, finds the same (q, w) and input there again, and nothing that moves has come near, its
// answer is known: nothing is computed. Hence sleeping cannot change a motion, needs no threshold,
// and waking has nothing to make up for. The memory is scratch: deleting it costs one step's time.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

class Sleepers {
 public:
  explicit Sleepers(const Model& model);

  /// Finds the trees that sleep through this step: those of islands whose state the last step left
  /// as it was, if state, input and options are what they were then.
  void begin(const Model& model, const SimulationOptions& options,
             const contact::Settings& settings, const State& state, const Input& input);
  /// Wakes the islands that a constraint joins to a body that is awake, and those in reach of a
  /// fast one (by tree), which have contacts looked for in a wider space; woken() lists their
  /// bodies. False if there are none.
  bool wake_touched(const Model& model, const ConstraintSet& constraints,
                    std::span<const char> in_reach);
  /// Finds the islands of what is awake. Always called, whether anything may sleep or not.
  void find_islands(const Model& model, const ConstraintSet& constraints);
  /// Leaves the poses of islands whose motion within the step is lost in rounding as they are in
  /// `state`: else they would tremble for ever, or creep by 1e-20 m a step where a coordinate
  /// happens to be zero. radii: by body [m]; displacement: the velocities they were moved with.
  /// Needs compute_poses and find_islands.
  void hold_still(const Model& model, double h, const std::vector<double>& radii,
                  const Kinematics& data, const State& state, const VectorX& displacement,
                  State& next);
  /// Remembers what this step did to the trees that were awake.
  void end(const Model& model, const State& state, const Input& input,
           const ConstraintSet& constraints, const State& next);
  /// After end: what this step did to a tree another one of the same state need not do.
  void keep_awake(int tree) { resting_[tree] = 0; }
  /// In place of begin: nothing sleeps through this step.
  void wake_all(const Model& model);
  /// The next step computes everything.
  void forget();

  bool asleep(int tree) const { return asleep_[tree] != 0; }
  int num_sleeping_bodies() const { return num_sleeping_bodies_; }
  SleepMask sleep_mask() const;
  const std::vector<BodyRange>& awake() const { return awake_; }
  const std::vector<BodyRange>& woken() const { return woken_; }
  /// Deepest penetration among the sleeping [m].
  double max_penetration() const;

 private:
  void list_awake(const Model& model);

  bool valid_ = false;
  SimulationOptions options_;
  contact::Settings settings_;
  Input last_input_;
  State last_;                       ///< what the trees at rest were given
  std::vector<char> resting_;        ///< by tree: the last step changed nothing
  std::vector<char> asleep_;         ///< by tree
  std::vector<char> idle_;           ///< by body
  contact::DisjointSets islands_;    ///< of trees
  std::vector<char> island_awake_;   ///< by tree: of the island that has it as root
  std::vector<char> touched_;        ///< by tree: there is a constraint on it
  std::vector<double> penetration_;  ///< by tree [m]
  std::vector<BodyRange> awake_, woken_;
  int num_sleeping_bodies_ = 0;
};

}  // namespace counterpoint
