// Wrenches that links exert on the links hanging on them: inverse dynamics less the forces of
// contacts and closures.
#pragma once

#include <vector>

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/sensors/carried_part.h"
#include "counterpoint/engine/step.h"

namespace counterpoint {

/// Factor of a contact force in the sum over a set of geometries: 1, -1, or 0 if neither or both of
/// its geometries belong to the set. `has` tests membership of an index into Model::geometries.
template <class Has>
double sign_on(const ContactForce& one, const Has& has) {
  return (has(one.contact.geometry_b) ? 1.0 : 0.0) - (has(one.contact.geometry_a) ? 1.0 : 0.0);
}

/// Returns the force along a tendon from its own laws and the actuators on it [N]; pulling is
/// negative.
double tendon_tension(const Model& model, const Inverse& inverse, int tendon);

/// A wrench at a body's origin, in W, as force and as moment about a point of W, both along the
/// axes of S [N, N m].
inline Force seen_from(const Force& wrench, const Vector3& origin, const Pose& X_WS) {
  const Vector3 moment = wrench.torque + (origin - X_WS.translation).cross(wrench.force);
  return {X_WS.rotation.transpose() * moment, X_WS.rotation.transpose() * wrench.force};
}

class JointWrenches {
 public:
  explicit JointWrenches(const Model& model) : of_(static_cast<std::size_t>(model.num_bodies())) {}

  /// Computes the wrench of every joint. free: the same without contacts and closures, the F that
  /// rnea leaves in its scratch memory. Needs the poses in `at`.
  void compute(const Model& model, const Kinematics& at, const std::vector<Force>& free,
               const Inverse& inverse);
  /// Wrench on a body from its parent through the joint, at the body's origin, in W [N m, N].
  const Force& of(int body) const { return of_[static_cast<std::size_t>(body)]; }

 private:
  std::vector<Force> of_;
};

/// The acceleration of a body for a wrench through a weld, and what acts on its links from outside.
struct WeldMotion {
  const Kinematics& at;    ///< poses, and velocities V
  const Motion& A;         ///< spatial acceleration of the body minus gravity, in W
  const Inverse& inverse;  ///< contacts, closures, wrenches of actuators
  const JointWrenches& joints;
  const std::vector<ExternalWrench>* wrenches;  ///< input; null: none act
};

/// Returns the wrench on a welded part from the link that it hangs on, at the body's origin, in W
/// [N m, N]: mass times acceleration of its own links, less what acts on them, plus the wrenches of
/// the joints below.
Force weld_wrench(const Model& model, const CarriedPart& part, const WeldMotion& motion);

}  // namespace counterpoint
