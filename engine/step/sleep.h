// Sleeping: islands at rest are left out of a step, with the same bits as if they were not.
//
// A step is a function of (q, w, input) and, in the last bits, of the memory that the last step
// left (contact_memory.h), which a resting island keeps. If the last step returned an island's (q,
// w) unchanged to the last bit, this step starts from the same (q, w) and input, and no moving body
// has come near, then the result is known and nothing is computed. Hence sleeping cannot change a
// motion, needs no threshold, and waking needs no correction. The memory is scratch: deleting it
// costs the time of one step.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

class Sleepers {
 public:
  explicit Sleepers(const Model& model);

  /// Finds the trees that sleep through this step: trees of islands whose state the last step left
  /// unchanged, if state, input and options are the same as then.
  void begin(const Model& model, const SimulationOptions& options,
             const contact::Settings& settings, const State& state, const Input& input);
  /// Wakes the islands that a constraint joins to an awake body, and islands in reach of a fast
  /// body (in_reach: per tree), whose contact search used a larger margin; woken() lists their
  /// bodies. False if there are none.
  bool wake_touched(const Model& model, const ConstraintSet& constraints,
                    std::span<const char> in_reach);
  /// Finds the islands of the awake trees, for hold_still and the next begin. Every semi-implicit
  /// Euler step calls it, whether trees may sleep or not.
  void find_islands(const Model& model, const ConstraintSet& constraints);
  /// Resets to `state` the poses of islands whose motion within the step is lost in rounding. They
  /// would otherwise tremble for ever, or creep by 1e-20 m per step where a coordinate is zero.
  /// radii: per body [m]; displacement: velocities (nv) that moved the bodies. Needs compute_poses
  /// and find_islands.
  void hold_still(const Model& model, double h, const std::vector<double>& radii,
                  const Kinematics& data, const State& state, const VectorX& displacement,
                  State& next);
  /// Stores which awake trees this step left unchanged.
  void end(const Model& model, const State& state, const Input& input,
           const ConstraintSet& constraints, const State& next);
  /// Keeps a tree awake in the next step, whose result at an equal state may differ. Call after
  /// end.
  void keep_awake(int tree) { resting_[tree] = 0; }
  /// Lets no tree sleep through this step; call it in place of begin.
  void wake_all(const Model& model);
  /// Drops the memory: no tree sleeps through the next step.
  void forget();

  bool asleep(int tree) const { return asleep_[tree] != 0; }
  int num_sleeping_bodies() const { return num_sleeping_bodies_; }
  SleepMask sleep_mask() const;
  const std::vector<BodyRange>& awake() const { return awake_; }
  const std::vector<BodyRange>& woken() const { return woken_; }
  /// Deepest penetration of sleeping bodies [m].
  double max_penetration() const;

 private:
  void list_awake(const Model& model);
  void wake_prescribed(const Model& model);

  bool valid_ = false;
  SimulationOptions options_;
  contact::Settings settings_;
  Input last_input_;
  bool still_states_ = false;  ///< the last step left the internal states as they were
  State last_;                 ///< state from which the last step left the resting trees unchanged
  std::vector<char> resting_;  ///< per tree: the last step changed nothing
  std::vector<char> asleep_;   ///< per tree
  std::vector<char> idle_;     ///< per body
  contact::DisjointSets islands_;    ///< sets of trees
  std::vector<char> island_awake_;   ///< per root tree of an island: the island is awake
  std::vector<char> touched_;        ///< per tree: there is a constraint on it
  std::vector<double> penetration_;  ///< per tree [m]
  std::vector<BodyRange> awake_, woken_;
  int num_sleeping_bodies_ = 0;
};

}  // namespace counterpoint
