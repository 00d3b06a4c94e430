// Linear momentum of floating trees that nothing outside touches.
//
// Forces between the bodies of a group cannot move its centre of mass C. In joint coordinates they
// do, by the error of a step: the linear velocity of a floating base is that of another point a
// step later. So C moves by the sum F of the outer forces alone, weight, wrenches and what is
// applied to the bases, with m the mass of the group:
//
//   v_C(q+, v+) = v_C(q, v) + h F / m        c(q+) = c(q) + h v,   v = v_C(q+, v+), or with
//                                            implicit_midpoint and runge_kutta_4 the mean of both
//
// All bodies of a group get one more velocity and one more displacement, so that their motion
// relative to each other, and with it closures and inner contacts, are those of the step. With
// `velocity_forces: start` positions go by v+ alone, q+ = q (+) h v+, as an optimization reads
// them.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// The centre of mass of a group. Its velocity is the sum of two, so that the difference of two
/// nearly equal ones is not lost in rounding.
struct CenterMotion {
  Vector3 position = Vector3::Zero();  ///< from the origin of the group's first body at q, in W [m]
  Vector3 bases = Vector3::Zero();     ///< mean linear velocity of the bases by mass, in W [m/s]
  Vector3 turning = Vector3::Zero();   ///< velocity if the bases only turned, in W [m/s]
};
/// v_C of b less that of a [m/s].
inline Vector3 velocity_between(const CenterMotion& a, const CenterMotion& b) {
  return (b.bases - a.bases) + (b.turning - a.turning);
}

class FreeGroups {
 public:
  struct Group {
    std::span<const int> trees;        ///< ascending
    double mass = 0.0;                 ///< [kg]
    double heavy_mass = 0.0;           ///< of which no force carries the weight [kg]
    Vector3 origin = Vector3::Zero();  ///< of the first body at q, in W [m]
    CenterMotion start;                ///< at (q, v)
    Vector3 shift = Vector3::Zero();   ///< acceleration that restore() found missing, in W [m/s^2]

    bool holds(int tree) const { return std::binary_search(trees.begin(), trees.end(), tree); }
  };

  explicit FreeGroups(const Model& model);

  /// Finds the groups of a step: floating trees that contacts, closures and mimic joints join with
  /// each other, none of which drag, another tree or the world touches or is close to. Those of
  /// which all trees are single bodies about their centre of mass need no correction and are left
  /// out. Needs compute_poses and compute_velocities.
  void find(const StepContext& at, const ConstraintSet& constraints, Idle idle,
            const Kinematics& data);
  std::span<const Group> groups() const { return {groups_.data(), count_}; }
  /// The trees of all groups, those about their centre of mass too.
  std::span<const int> trees() const { return trees_; }

  /// Corrects next.v and next.q of a step; q_reached (nq): the poses at which next.v is taken,
  /// next.q itself where no overlap displaced bodies beside their velocity.
  void correct(const StepContext& at, const Input& input, const VectorRef& q_reached, State& next);

  /// Corrects the forces u (nv) that were recovered from v_next (nv) as if that were the solution
  /// of the step, at the poses in `data`. forces: scratch by body.
  void restore(const StepContext& at, const Input& known, const VectorRef& q_reached,
               const VectorRef& v_next, const Kinematics& data, std::vector<Force>& forces,
               VectorOut u);  // Parameters: what it depends on

  /// Whether the model has trees that may need a correction.
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

  bool any_ = false;          ///< some tree may need a correction
  std::vector<char> floats_;  ///< by tree: nothing but its joints and the world acts on its base
  std::vector<char> off_center_;        ///< by tree: more than a body about its centre of mass
  std::vector<char> held_;              ///< by tree
  std::vector<double> carried_, mass_;  ///< by tree [kg]
  contact::DisjointSets sets_;
  std::vector<int> trees_;  ///< those of the groups, one group after the other
  std::vector<Group> groups_;
  size_t count_ = 0;
  std::optional<Data> scratch_;  ///< poses elsewhere
  std::vector<Motion> V_;        ///< velocities there
  VectorX v_, tau_;
};

}  // namespace counterpoint
