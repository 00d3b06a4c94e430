// Trees that turn fast keep the kinetic energy that velocity-dependent forces cannot change.
//
// Coriolis, centrifugal and gyroscopic forces, taken at the start of a step, do work on a tree, in
// proportion to h omega^2 of its energy a second; taken in its middle (mid_velocity.h) they do none
// of first order, but still make a whip or a flailing leg diverge once a step turns it too
// far. So trees that turn fast take the mean effect of these forces alone, M (w_free
// - w) / h, where w_free is what they alone would lead to, moved along itself to where the kinetic
// energy at the pose reached is that of the start (projection: Hairer, Lubich, Wanner 2006, IV.4);
// if the tree floats, with the motion of its centre of mass held. Below kSlow nothing is done, from
// kFast on all of it, in between a smooth share; of trees with a prediction at kPredictedFactor times these
// rates. It depends on (q, w) alone: the inverse knows it.
//
// Trees with closures are left to mid_velocity.h: the impulses of closures take most of what the
// forces alone would do, so what these do without them is no guide (measured: docs/decisions/README.md).
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// A tree's motion as a whole.
struct TreeMotion {
  Vector3 momentum = Vector3::Zero();  ///< linear [kg m/s]
  double mass = 0.0;
  double energy = 0.0;  ///< kinetic [J], less that of the centre of mass where that is free to move
  bool floats = false;
};

class EnergyProjection {
 public:
  static constexpr double kSlow = 0.1, kFast = 0.3;  ///< of h omega^2 [1/s]
  static constexpr double kPredictedFactor = 3.0;

  explicit EnergyProjection(const Model& model);

  /// The share that this correction has of a tree's velocity-dependent forces, 0 ... 1, for a step
  /// of h [s] from (q, v); that share of the mean forces into data.has_mean_force, mean_force and
  /// mean_rotor_force, and c zero, where it is not 0. predicted: the tree has a prediction. rotors
  /// (nv): what is added to the diagonal of M. Needs compute_poses and compute_velocities;
  /// no applied forces in data (has_external, added).
  double apply(const Model& model, double h, const VectorRef& q, const VectorRef& v, bool predicted,
               const VectorX& rotors, int t, Data& data);  // Parameters: what it depends on, one by one

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

  /// Of a tree with a prediction: the energy kept is that of (q, w) as they are, from this angle a
  /// step [rad] on.
  static constexpr double kFarTurn = 0.06;
  /// Up to half of it the energy is that of velocities at the time of the pose, half a step apart:
  /// this share of the work of the velocity-dependent forces in that half step is added. Its slope
  /// [1/rad].
  static double share_of_work(double turn);
  static double share_of_work_slope(double turn);

  /// To which speeds are scaled right [-]. Steps leave it as it is.
  void set_tolerance(double tolerance) { tolerance_ = tolerance; }

 private:  // Parameters: what it depends on, one by one
  /// False if M is singular.
  bool find_change(const Model& model, double h, const VectorRef& q, const VectorRef& v,
                   bool predicted, const VectorX& rotors, int t, double share, Data& data);
  TreeMotion keep_energy(const Model& model, int t, double h, const VectorRef& q, bool predicted,
                         const VectorX& rotors, double energy);  // Parameters: what it depends on, one by one
  void set_force(const Model& model, double h, const VectorX& rotors, const Tree& tree, Data& data);

  std::optional<Data> scratch_;  ///< if a tree can be corrected
  VectorX q_;
  VectorX plain_;    ///< change of velocity by these forces, as they are at the start
  VectorX change_;   ///< the share of that which keeps the energy
  VectorX reached_;  ///< velocity
  VectorX zero_;
  std::vector<char> corrected_;        ///< by tree: can be
  std::vector<double> scale_, share_;  ///< by tree
  double tolerance_ = 1e-7;            ///< 1e-4 of the energy in a second of 2 ms steps
};

}  // namespace counterpoint
