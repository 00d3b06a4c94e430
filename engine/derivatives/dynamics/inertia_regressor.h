// Inverse dynamics is linear in the inertial parameters of the bodies: tau = Y(q, v, a) pi
// (Atkeson, An, Hollerbach, *Estimation of inertial parameters of manipulator loads and links*,
// IJRR 1986).
#pragma once

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Computes Y and products with it. Scratch memory inside: one object per thread and model.
class InertiaRegressor {
 public:
  explicit InertiaRegressor(const Model& model);

  /// Computes Y, nv x 10 (num_bodies - 1), with tau = Y inertial_parameters(model) for the forces
  /// tau that rnea returns at v, a (nv) under gravity [m/s^2], without external wrenches and
  /// carried weight. If data.has_coriolis is false, velocity-dependent forces are left out; mean
  /// forces are ignored. Needs compute_poses. Nothing is allocated once Y has its size.
  void compute(const Model& model, const VectorRef& v, const VectorRef& a, const Vector3& gravity,
               const Data& data, MatrixX& Y);

  /// Adds `factor` times Y times a change of one body's inertial parameters to tau (nv). Needs
  /// set_motion at the same poses.
  void add(const Model& model, int body, const InertialParameters& change, double factor,
           const Kinematics& data, VectorOut tau) const;
  /// Sets the motion of all bodies that `add` uses, from v and a (nv); null means zero.
  void set_motion(const Model& model, const double* v, const double* a, const Vector3& gravity,
                  const Kinematics& data);

 private:
  /// Motion of a body, in body axes.
  struct Moving {
    Vector3 omega, alpha;  ///< [rad/s, rad/s^2]
    Vector3 a;             ///< acceleration of the origin minus gravity [m/s^2]
  };
  std::vector<Motion> V_, A_;   ///< per body, in W; A minus gravity
  std::vector<Moving> moving_;  ///< per body
};

}  // namespace counterpoint
