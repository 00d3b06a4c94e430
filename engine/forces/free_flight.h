// Single bodies turn as Euler's top does, exactly.
//
// A tree of one body on a floating joint, or on a spherical joint in the world, has velocity terms
// that depend on its angular velocity alone. Taken at the start of the step, as those of all other
// trees are, they add energy to every body that spins, without bound from about a radian a step.
// So their mean over the step is taken, n_flight = I (w_free - w) / h, where w_free is the
// velocity at its end if nothing else acted. It depends on w alone: the inverse knows it.
//
// A top on a ball joint is turned by its weight as well. That torque acts in the middle of the
// step, between two halves of the free motion: with poses half a step from velocities this is the
// leapfrog scheme, and no energy goes into nutation. n_flight holds the difference to the weight at
// the start, known from (q, w) as well.
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

  /// -n_flight of the flying body `index` in its own axes, at its origin [N m, N], as a function of
  /// angular velocity [rad/s] and gravity [m/s^2] in these axes; gravity matters to tops alone.
  Force mean_force(const Model& model, int index, double h, const Vector3& omega,
                   const Vector3& gravity) const;
  int num_flyers() const { return static_cast<int>(flyers_.size()); }
  int body(int index) const { return flyers_[static_cast<size_t>(index)].body; }

 private:
  struct Flyer {
    int body;
    EulerTop top;
    Vector3 carried;     ///< sum m c of its carried weight that turns it, in its axes [kg m]
    Matrix3 rotational;  ///< inertia about the centre of mass that `top` is of [kg m^2]
  };
  std::vector<Flyer> flyers_;  ///< by body
};

}  // namespace counterpoint
