// Linear momentum of groups of floating trees that touch nothing outside the group.
//
// Internal forces of a group cannot accelerate its centre of mass C. In joint coordinates they do,
// by the truncation error of a step, since the point of a floating base to which its linear
// velocity refers moves within the step. Therefore v_C is integrated from the sum F of the external
// forces only: weight, wrenches and generalized forces on the bases. With m the mass of the group
// and c the position of C:
//
//   v_C(q+, v+) = v_C(q, v) + h F / m        c(q+) = c(q) + h v,   v = v_C(q+, v+), or with
//                                            implicit_midpoint and runge_kutta_4 the mean of both
//
// All bodies of a group get the same additional velocity and displacement, so their relative
// motion, and with it closures and internal contacts, stays that of the step. With
// `velocity_forces: start` positions follow from v+ alone, q+ = q (+) h v+, as trajectory
// optimization assumes.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// Centre of mass of a group. Its velocity is a sum of two parts, so that the difference of two
/// nearly equal velocities is not lost in round-off.
struct CenterMotion {
  Vector3 position = Vector3::Zero();  ///< from Group::origin, in W [m]
  Vector3 bases = Vector3::Zero();     ///< mean linear velocity of the bases by mass, in W [m/s]
  Vector3 turning = Vector3::Zero();   ///< velocity without translation of the bases, in W [m/s]
};
/// Returns v_C of b minus v_C of a, in W [m/s].
inline Vector3 velocity_between(const CenterMotion& a, const CenterMotion& b) {
  return (b.bases - a.bases) + (b.turning - a.turning);
}

class FreeGroups {
 public:
  struct Group {
    std::span<const int> trees;        ///< ascending indices
    double mass = 0.0;                 ///< [kg]
    double heavy_mass = 0.0;           ///< mass without that of gravity compensations [kg]
    Vector3 origin = Vector3::Zero();  ///< origin of the group's first body at q, in W [m]
    CenterMotion start;                ///< motion at (q, v)
    Vector3 shift = Vector3::Zero();   ///< acceleration that restore() found missing, in W [m/s^2]

    bool holds(int tree) const { return std::binary_search(trees.begin(), trees.end(), tree); }
  };

  explicit FreeGroups(const Model& model);

  /// Finds the groups of a step: floating trees that contacts, closures, mimic joints and tendons
  /// join with each other, and that have no drag and are neither touched by nor close to another
  /// tree or the world. Groups of only single bodies whose origin is their centre of mass need no
  /// correction and are left out. Needs compute_poses and compute_velocities.
  void find(const StepContext& at, const ConstraintSet& constraints, SleepMask idle,
            const Kinematics& data);
  std::span<const Group> groups() const { return {groups_.data(), count_}; }
  /// Trees of all free groups, including those that need no correction.
  std::span<const int> trees() const { return trees_; }

  /// Corrects next.v and next.q of a step. q_reached (nq): the poses at which next.v is taken;
  /// next.q itself unless the correction of overlaps moved bodies in addition to their velocity.
  void correct(const StepContext& at, const Input& input, const VectorRef& q_reached, State& next);

  /// Corrects the forces u (nv), which were recovered from v_next (nv) as if it were the solution
  /// of the step, at the poses in `data`. forces: scratch, one per body.
  void restore(const StepContext& at, const Input& known, const VectorRef& q_reached,
               const VectorRef& v_next, const Kinematics& data, std::vector<Force>& forces,
               VectorOut u);

  /// True if the model has trees that may need a correction.
  bool any() const { return any_; }

 private:
  void join_touched(const StepContext& at, const ConstraintSet& constraints);
  void list_free_trees(const Model& model);
  void add_group(const StepContext& at, std::span<const int> trees, const Kinematics& data);
  CenterMotion motion_of(const Model& model, const Group& group, const VectorRef& v,
                         const Kinematics& data);
  CenterMotion motion_at(const Model& model, const Group& group, const VectorRef& q,
                         const VectorRef& v);
  Vector3 weight_and_wrenches(const StepContext& at, const Group& group, const Input& input) const;

  bool any_ = false;              ///< value of any()
  std::vector<char> floats_;      ///< for each tree: floating base, no armature, damping, friction
  std::vector<char> off_center_;  ///< for each tree: not a single body about its centre of mass
  std::vector<char> held_;        ///< for each tree, and root of its set: not free in this step
  std::vector<double> carried_, mass_;  ///< for each tree: compensated mass, mass [kg]
  contact::DisjointSets sets_;
  std::vector<int> trees_;  ///< trees of the groups, group by group
  std::vector<Group> groups_;
  size_t count_ = 0;
  std::optional<Data> scratch_;  ///< poses other than those of the step
  std::vector<Motion> V_;        ///< velocities of bodies in motion_of
  VectorX v_, tau_;
};

}  // namespace counterpoint
