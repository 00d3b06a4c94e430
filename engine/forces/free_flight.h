// Single free bodies follow the exact motion of Euler's top.
//
// A tree of one body on a floating joint, or on a spherical joint to the world, has
// velocity-dependent forces that depend only on its angular velocity. Taken at the start of the
// step, as on all other trees, they add energy to every spinning body, without bound from about one
// radian per step. Therefore their mean over the step is used, n_flight = I (w_free - w) / h, where
// w_free is the velocity at the end of the step if nothing else acts. It depends on w only, so the
// inverse knows it.
//
// A top on a ball joint is also turned by its weight. Its torque acts at mid-step, between two
// halves of the free motion: with poses half a step from velocities this is the leapfrog scheme,
// and nutation gains no energy. n_flight includes the difference to the weight at the start of the
// step, which is known from (q, w) too.
#pragma once

#include <vector>

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/dynamics/euler_top.h"

namespace counterpoint {

class FreeFlight {
 public:
  explicit FreeFlight(const Model& model);

  /// Fills forces.has_mean_force and mean_force of the flying bodies in a range for a step of h [s]
  /// from v (nv) under gravity [m/s^2]. Where nothing acts their angular velocity keeps energy and
  /// angular momentum, their centre of mass its velocity. Needs compute_poses.
  void apply(const Model& model, double h, const VectorRef& v, const Vector3& gravity,
             BodyRange bodies, const Kinematics& at, VelocityForces& forces) const;

  /// Returns -n_flight of free body `index` in its body frame, at its origin [N m, N], from its
  /// angular velocity [rad/s] and gravity [m/s^2] in the same frame. Gravity matters only on ball
  /// joints.
  Force mean_force(const Model& model, int index, double h, const Vector3& omega,
                   const Vector3& gravity) const;
  int num_flyers() const { return static_cast<int>(flyers_.size()); }
  int body(int index) const { return flyers_[static_cast<size_t>(index)].body; }

 private:
  struct Flyer {
    int body;
    EulerTop top;
    Vector3 carried;     ///< first moment sum m c of its gravity compensations, in its frame [kg m]
    Matrix3 rotational;  ///< inertia about the centre of mass from which `top` was made [kg m^2]
  };
  std::vector<Flyer> flyers_;  ///< in ascending order of body
};

}  // namespace counterpoint
