// Closures as constraints of one step: error, acceleration of the error, and rows.
//
//   ball         d = p_B - p_A                          3 rows, in W
//   weld         d, and the rotation vector             3 + 3 rows, in W
//                that takes A's anchor frame to B's
//   distance     |p_B - p_A| - length                   1 row, along p_B - p_A
//   hinge        d, and z_A x z_B                       3 rows in W, 2 in A's anchor frame
//   slider       x and y of d in A's anchor frame       2 rows there
//   prismatic    those of the slider and of the weld's rotation
//   cylindrical  those of the slider, and z_A x z_B     2 + 2 rows in A's anchor frame
//   screw        those of cylindrical, and              1 row: velocity along z_A minus that of
//                z of d - pitch turns, modulo pitch     the thread, pitch / (2 pi) times z_A . w
//
// p: the anchors, z: the z axes of their frames, in W; w: angular velocity of B relative to A.
// Closures that hold d in W act halfway between the anchors, the others at B's anchor, where rows
// in A's anchor frame are the exact rate of the error. One point for both bodies conserves linear
// and angular momentum while the closure is open. When both bodies rotate together, rows in W see
// the error in rotating axes.
//
// Springs take the place of the rigid rows of d, in A's anchor frame, or of the angles: their rows
// have a law with the spring's own compliance (set_spring). Axes of different stiffness are
// constraints of one row each. A rope is a one-sided row along p_A - p_B.
#pragma once

#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// Adds the rows of all closures that act at the internal states to `out`, behind the contacts,
/// except for closures between idle bodies. Requires compute_poses and compute_velocities;
/// `acceleration` (num_bodies) is scratch.
void find_closures(const StepContext& at, const Kinematics& data, const InverseWeights& weights,
                   SleepMask idle, std::vector<Motion>& acceleration, ConstraintSet& out);

/// Sets the bias of one of these rows so that the closure closes over the step of h [s] from the
/// poses in `data` to the poses in `reached`, to which the predicted velocities V (num_bodies)
/// lead, instead of by the curvature at the initial velocities. The remaining error is of second
/// order in the error of the prediction, not in h. Not for springs and ropes.
void aim_closure(const Model& model, const ActingClosure& acting, const ContactOptions& options,
                 double h, const Kinematics& data, const Kinematics& reached,
                 const std::vector<Motion>& V, PairConstraint& pair);

/// Fraction of this correction that is used if the bodies turn by `turn` [rad] in the step. A
/// closure that cannot close, such as beyond the reach of an arm, may have any prediction, and
/// aiming by it diverges.
double share_aimed(double turn);
/// Derivative of share_aimed [1/rad].
double share_aimed_slope(double turn);

/// Distance of the anchors [m] below which a distance closure has no direction and an arbitrary one
/// is used.
inline constexpr double kNoDirection = 1e-12;

/// Whether the rows act at B's anchor, not halfway between the anchors.
bool acts_at_b(const Closure& closure);
/// The spring that the rows of a pair belong to; it may be rigid.
const ClosureSpring& spring_of(const Closure& closure, const PairConstraint& pair);
/// Damping of the implicit spring of a pair, d + h k [N s/m or N m s/rad].
double spring_damping(const Closure& closure, const PairConstraint& pair, double h);
/// Share of the error at the end of the step that counts in the bias of a pair: 1 of rigid rows,
/// h k / (d + h k) of a spring [-].
double error_share(const Closure& closure, const PairConstraint& pair, double h);
/// Whether the error of a pair is a vector seen from A's anchor frame, whose axes its rows have.
bool follows_a(const PairConstraint& pair);

/// Returns the second derivative, in the rotating axes of A, of a vector r between points of A and
/// B [m/s^2], in W. u, c: first and second derivative of r in W; omega, alpha: of A [rad/s,
/// rad/s^2].
inline Vector3 acceleration_seen(const Vector3& r, const Vector3& u, const Vector3& c,
                                 const Vector3& omega, const Vector3& alpha) {
  return c - alpha.cross(r) + omega.cross(omega.cross(r)) - 2.0 * omega.cross(u);
}

/// Extension of a distance beyond d + h n.u over a step of h [s] [m], for springs and ropes: r, u
/// and c are the vector between the anchors and its derivatives. Bounded, unlike h^2 / 2 times the
/// acceleration of the distance, as the anchors meet.
inline double bend_of_distance(double h, const Vector3& n, const Vector3& r, const Vector3& u,
                               const Vector3& c) {
  return (r + h * u + 0.5 * h * h * c).norm() - r.norm() - h * n.dot(u);
}

}  // namespace counterpoint
