// Trees that turn fast keep the kinetic energy that velocity-dependent forces cannot change.
//
// Coriolis, centrifugal and gyroscopic forces, taken at the start of a step, do work on a tree, in
// proportion to h omega^2 of its energy a second; taken in its middle (mid_velocity.h) they do none
// of first order, but still make a whip or a flailing leg diverge once a step turns it too
// far. So trees that turn fast take the mean effect of these forces alone, M (w_free
// - w) / h, where w_free is what they alone would lead to, moved along itself to where the kinetic
// energy is that of before (projection: Hairer, Lubich, Wanner 2006, IV.4); if the tree floats,
// with the motion of its centre of mass held. Below kSlow nothing is done, from kFast on all of it,
// in between a smooth share; of trees with a prediction at kPredictedFactor times these rates. It
// depends on (q, w) alone: the inverse knows it.
//
// A step applies its forces at q, and changes kinetic energy and momentum there by their work and
// impulse, exactly: T(q, w+) - T(q, w_free) = h u'(w_free + w+) / 2. So what a tree that floats
// keeps is what the last step left where it acted: w_free is such that T(q, w_free) = T(q (-) h w,
// w), and no force, contact or step length makes it gain more than the work
// (EnergyProjection.ForcesGiveNoMoreThanTheirWork). Energies of w+ at the pose reached, T(q+, w+),
// differ by up to the turn of a step, either way. Trees held by the world keep those: T(q (+) h
// w_free, w_free) = T(q, w), which free motion keeps as a user sees it (measured:
// docs/decisions/integration.md).
//
// Trees with closures are left to mid_velocity.h: the impulses of closures take most of what the
// forces alone would do, so what these do without them is no guide (measured:
// docs/decisions/README.md).
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// A tree's motion as a whole.
struct TreeMotion {
  Vector3 momentum = Vector3::Zero();  ///< linear [kg m/s]
  double mass = 0.0;
  double energy = 0.0;  ///< kinetic [J], less that of the centre of mass where that is free to move
  bool floats = false;
};

/// The joint that turns a tree most.
struct JointTurn {
  double angle = 0.0;        ///< a step [rad]
  int first = 0, count = 0;  ///< coordinates of v
};
/// h [s], v (nv) [m/s, rad/s].
JointTurn joint_turn(const Model& model, const Tree& tree, double h, const VectorRef& v);

class EnergyProjection {
 public:
  static constexpr double kSlow = 0.1, kFast = 0.3;  ///< of h omega^2 [1/s]
  static constexpr double kPredictedFactor = 3.0;

  explicit EnergyProjection(const Model& model);

  /// The share that this correction has of a tree's velocity-dependent forces, 0 ... 1, for a step
  /// from (q, v); that share of the mean forces into data.has_mean_force, mean_force and
  /// mean_rotor_force, and c zero, where it is not 0; with the rest of them, as they are at the
  /// start, unless predicted: the tree has a prediction, at which the caller adds the rest. rotors
  /// (nv): what is added to the diagonal of M. Needs compute_poses and compute_velocities;
  /// no applied forces in data (has_external, added).
  double apply(const StepContext& at, bool predicted, const VectorX& rotors, int t, Data& data);

  /// nv: what the forces at the start of the step alone would change of the velocity [m/s, rad/s],
  /// of the trees whose share is not 0.
  const VectorX& plain_change() const { return plain_; }
  /// nv: the share of the change that keeps the energy, of the same trees.
  const VectorX& change() const { return change_; }
  /// By what w + plain change was multiplied, and the share, of a tree; both as of the last time it
  /// was looked at.
  double scale(int t) const { return scale_[t]; }
  double share(int t) const { return share_[t]; }
  /// The share of a tree whose h omega^2 [1/s] is `rate`, and its slope [s].
  static double share_of(double rate);
  static double share_slope(double rate);

  /// The energy of (q, w) that is kept is T(q (-) lag h w, w): lag is 1 of trees that float, else
  /// 0. Of a tree with a prediction it is 0.5 up to half this turn [rad], that is at the middle of
  /// the last step, the energy that slower trees keep (otherwise a tree that alternates between
  /// slow and fast gains or loses the difference).
  static constexpr double kFarTurn = 0.06;
  static double lag(double turn, bool predicted, bool floats);
  static double lag_slope(double turn, bool predicted, bool floats);  ///< [1/rad]

  /// To which speeds are scaled right [-]. Steps leave it as it is.
  void set_tolerance(double tolerance) { tolerance_ = tolerance; }

 private:
  /// False if M is singular.
  bool find_change(const StepContext& at, bool predicted, const VectorX& rotors, int t,
                   double share, Data& data);
  // Parameters: a state, a tree of it and where to look.
  TreeMotion motion_at(const StepContext& at, int t, double from, const VectorRef& x,
                       bool predicted, const VectorX& rotors, const Kinematics& data);
  TreeMotion keep_energy(const StepContext& at, int t, bool predicted, const VectorX& rotors,
                         double energy, const Kinematics& data);
  void set_force(const Model& model, double h, const VectorX& rotors, const Tree& tree, Data& data);

  std::optional<Data> scratch_;  ///< if a tree can be corrected
  std::vector<Motion> V_;        ///< velocities of bodies where motion_at looks
  VectorX q_;
  VectorX plain_;    ///< change of velocity by these forces, as they are at the start
  VectorX change_;   ///< the share of that which keeps the energy
  VectorX taken_;    ///< change of velocity whose forces are given
  VectorX reached_;  ///< velocity
  VectorX zero_;
  std::vector<char> corrected_;        ///< by tree: can be
  std::vector<double> scale_, share_;  ///< by tree
  double tolerance_ = 1e-7;            ///< 1e-4 of the energy in a second of 2 ms steps
};

}  // namespace counterpoint
