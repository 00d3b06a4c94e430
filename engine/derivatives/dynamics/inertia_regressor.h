// Inverse dynamics is linear in the inertial parameters of the bodies: tau = Y(q, v, a) pi
// (Atkeson, An, Hollerbach, *Estimation of inertial parameters of manipulator loads and links*,
// IJRR 1986).
#pragma once

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Scratch of one thread for one model.
class InertiaRegressor {
 public:
  explicit InertiaRegressor(const Model& model);

  /// Y, nv x 10 (num_bodies - 1), of what rnea gives at v, a (nv) under gravity [m/s^2] without
  /// external wrenches and carried weight: tau = Y inertial_parameters(model). data.has_coriolis =
  /// false leaves velocity-dependent forces out; mean forces are not looked at. Needs
  /// compute_poses. Nothing is allocated once Y has its size.
  void compute(const Model& model, const VectorRef& v, const VectorRef& a, const Vector3& gravity,
               const Kinematics& data, MatrixX& Y);

  /// Y times a change of one body's parameters: adds `factor` times that to tau (nv). After
  /// set_motion with the same poses.
  void add(const Model& model, int body, const InertialParameters& change, double factor,
           const Kinematics& data, VectorOut tau) const;
  /// The motion of all bodies that `add` is at. v may be null: zero.
  void set_motion(const Model& model, const double* v, const double* a, const Vector3& gravity,
                  const Kinematics& data);

 private:
  /// In body axes.
  struct Moving {
    Vector3 omega, alpha;  ///< [rad/s, rad/s^2]
    Vector3 a;             ///< of the origin, less gravity [m/s^2]
  };
  std::vector<Motion> V_, A_;   ///< by body, in W
  std::vector<Moving> moving_;  ///< by body
};

}  // namespace counterpoint
