// Joints whose motion is prescribed (JointInfo::prescribed): their coordinates at the end of a step
// are given, and whatever force that takes acts on them.
//
//   w_p = difference(q, given) / h,     q+ = given
//
// The forward step takes these velocities as known. Forces and constraints on all other coordinates
// see the motion that they give the bodies, exactly: the recursive algorithms accelerate the joint
// by (w_p - w) / h whatever acts on it (lock), and the contact problem has w_p in the biases of its
// rows in place of columns of these coordinates (eliminate). The inverse needs nothing of this: the
// force that it recovers on these coordinates is the one that holds the motion.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

class PrescribedMotion {
 public:
  explicit PrescribedMotion(const Model& model);

  bool any() const { return !joints_.empty(); }
  /// Finds the velocities of a step. @throws InputError where a given coordinate is infinite or a
  /// quaternion is not of unit length.
  void find(const StepContext& at, const Input& input);
  /// Sets inertia and force (nv) so that the step of h [s] from v (nv) ends with the velocities.
  void lock(double h, const VectorRef& v, VectorOut diagonal, VectorOut tau) const;
  /// Takes the coordinates out of a problem and puts their velocities into its biases.
  void eliminate(const Model& model, const std::vector<int>& block_of_tree,
                 contact::Problem& problem);
  /// Bias that eliminate() gave the first row of each constraint [m/s]; empty if there was none.
  std::span<const double> shifts() const { return shifts_; }
  /// Sets coordinates (nq) and velocities (nv) at the end of the step.
  void set(const Model& model, VectorX& q, VectorX& v) const;

 private:
  std::vector<int> joints_;       ///< indices into Model::joints
  std::vector<int> coordinates_;  ///< their coordinates of v
  VectorX target_;    ///< nq: coordinates at the end of the step, of other joints at its start
  VectorX velocity_;  ///< nv: velocities that lead there
  std::vector<double> shifts_;
};

}  // namespace counterpoint
