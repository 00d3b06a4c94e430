// Gradients of the kinetic energy and the momentum of a tree by its configuration and velocity.
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Computes the gradients of one tree over its coordinates, in the order of v. With the
/// columns S and P = V x S (sweep.h) of a coordinate, and I and h the inertia and momentum of
/// everything it carries:
///
///   dT/dv = S'h     dT/dq = P'h     dp/dv = (I S)_force     dp/dq = (S x* h + I P)_force
class KineticGradient {
 public:
  explicit KineticGradient(const Model& model);

  /// Computes the gradients at the poses and inertias in `data` and velocities x (nv) [m/s, rad/s];
  /// rotors (nv) are added to the diagonal of M. For a floating tree T excludes the kinetic energy
  /// of its centre of mass.
  void compute(const Model& model, const Tree& tree, const Kinematics& data, const double* x,
               const VectorX& rotors);

  // Gradients of the tree computed last; entries up to its number of coordinates are valid.
  VectorX dv, dq;  ///< gradients of the energy by v and by q [J s/m, ...; J/m, ...]
  MatrixX momentum_dv, momentum_dq;  ///< 3 x nv, linear momentum in W
  double mass = 0.0;                 ///< [kg]
  bool floats = false;

 private:
  struct Body {
    Motion V;
    RigidInertia I;
    Force momentum;
  };
  std::vector<Body> bodies_;
  std::vector<Motion> S_, P_;
};

}  // namespace counterpoint
