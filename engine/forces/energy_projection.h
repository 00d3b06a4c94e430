// Trees that turn fast keep the kinetic energy that velocity-dependent forces cannot change.
//
// Coriolis, centrifugal and gyroscopic forces at the start of a step change a tree's energy at a
// relative rate proportional to h omega^2. Taken at mid-step (mid_velocity.h) they do no work to
// first order, but a whip or a flailing leg still diverges once a step turns it too far. Therefore
// trees that turn fast get the mean effect M (w_free - w) / h of these forces alone. w_free is the
// velocity that these forces alone lead to, scaled such that the kinetic energy is unchanged
// (projection: Hairer, Lubich, Wanner 2006, IV.4); on a floating tree the velocity of its centre of
// mass is kept as well. The share of this correction rises smoothly from 0 at h omega^2 = kSlow to
// 1 at kFast, for trees with a prediction at kPredictedFactor times these rates. It depends on (q,
// w) only, so the inverse knows it.
//
// A step applies its forces at q; there they change kinetic energy and momentum exactly by their
// work and impulse: T(q, w+) - T(q, w_free) = h u'(w_free + w+) / 2. A floating tree therefore
// keeps the energy at the pose where the last step acted, T(q, w_free) = T(q (-) h w, w), and no
// force, contact or step length adds more than its work
// (EnergyProjection.ForcesGiveNoMoreThanTheirWork). The energy of w+ at the pose reached, T(q+,
// w+), differs from it in either direction by up to the order of the rotation in a step. A tree
// held by the world keeps that energy instead, T(q (+) h w_free, w_free) = T(q, w): the energy that
// a user sees in free motion (measured: docs/decisions/integration.md).
//
// Trees with closures are left to mid_velocity.h: impulses of closures cancel most of the effect of
// the forces alone, so their effect without closures is no guide (measured:
// docs/decisions/README.md).
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// Momentum, mass and energy of a tree.
struct TreeMotion {
  Vector3 momentum = Vector3::Zero();  ///< linear [kg m/s]
  double mass = 0.0;
  double energy = 0.0;  ///< kinetic [J]; for floating trees relative to the centre of mass
  bool floats = false;
};

/// The joint of a tree with the largest rotation in a step.
struct JointTurn {
  double angle = 0.0;        ///< rotation in a step [rad]
  int first = 0, count = 0;  ///< its rotational coordinates of v
};
/// Returns that joint for a step h [s] and velocities v (nv) [m/s, rad/s].
JointTurn joint_turn(const Model& model, const Tree& tree, double h, const VectorRef& v);

class EnergyProjection {
 public:
  static constexpr double kSlow = 0.1, kFast = 0.3;  ///< bounds of h omega^2 [1/s]
  static constexpr double kPredictedFactor = 3.0;

  explicit EnergyProjection(const Model& model);

  /// Computes the correction of tree t for a step from (q, v). Returns its share of the tree's
  /// velocity-dependent forces, 0 ... 1. If that is not 0, writes the mean forces to
  /// data.has_mean_force, mean_force and mean_rotor_force and sets c to zero. Without a prediction
  /// (`predicted` false) they include the rest of the forces, at the start of the step; with one
  /// the caller adds the rest at the predicted velocity. rotors (nv): rotor inertia added to the
  /// diagonal of M. Needs compute_poses and compute_velocities; data must not have applied forces
  /// (has_external, added).
  double apply(const StepContext& at, bool predicted, const VectorX& rotors, int t, Data& data);

  /// Change of velocity by the velocity-dependent forces at the start of the step alone (nv) [m/s,
  /// rad/s]; valid for trees whose share is not 0.
  const VectorX& plain_change() const { return plain_; }
  /// Share of the energy-preserving change of velocity (nv); valid for the same trees.
  const VectorX& change() const { return change_; }
  /// Factor by which w + plain_change() was multiplied, and share, of tree t in its last apply().
  double scale(int t) const { return scale_[t]; }
  double share(int t) const { return share_[t]; }
  /// Share of a tree whose h omega^2 is `rate` [1/s], and its derivative [s].
  static double share_of(double rate);
  static double share_slope(double rate);

  /// The energy kept of (q, w) is T(q (-) lag h w, w). lag is 1 for floating trees, else 0. For
  /// trees with a prediction lag is 0.5 up to half this rotation [rad]: this is the middle of the
  /// last step, and the energy that slower trees keep; otherwise a tree that alternates between
  /// slow and fast would gain or lose the difference. From half of it to all of it lag moves to 1
  /// or 0.
  static constexpr double kFarTurn = 0.06;
  static double lag(double turn, bool predicted, bool floats);
  static double lag_slope(double turn, bool predicted, bool floats);  ///< [1/rad]

  /// Sets the relative tolerance of speeds in the scaling. Steps do not change it.
  void set_tolerance(double tolerance) { tolerance_ = tolerance; }

 private:
  static bool is_held(const StepContext& at, int t);
  /// Computes plain_ and change_ of tree t. False if M is singular.
  bool find_change(const StepContext& at, bool predicted, const VectorX& rotors, int t,
                   double share, Data& data);
  TreeMotion motion_at(const StepContext& at, int t, double from, const VectorRef& x,
                       bool predicted, const VectorX& rotors, const Kinematics& data);
  TreeMotion keep_energy(const StepContext& at, int t, bool predicted, const VectorX& rotors,
                         double energy, const Kinematics& data);
  void set_force(const Model& model, double h, const VectorX& rotors, const Tree& tree, Data& data);

  std::optional<Data> scratch_;  ///< present if a tree can be corrected
  std::vector<Motion> V_;        ///< velocities of bodies in motion_at
  VectorX q_;
  VectorX plain_;    ///< change of velocity by these forces at the start of the step
  VectorX change_;   ///< share of the energy-preserving change of velocity
  VectorX taken_;    ///< change of velocity whose forces set_force writes
  VectorX reached_;  ///< velocity, w_free
  VectorX zero_;
  std::vector<char> corrected_;        ///< for each tree: it can be corrected
  std::vector<char> switched_;         ///< for each tree: it has a switched closure
  std::vector<double> scale_, share_;  ///< for each tree
  double tolerance_ = 1e-7;            ///< 1e-4 of the energy per second at steps of 2 ms
};

}  // namespace counterpoint
