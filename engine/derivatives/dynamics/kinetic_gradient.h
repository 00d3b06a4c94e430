// How the kinetic energy and the momentum of a tree change with its configuration and velocity.
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Of one tree, by its coordinates in the order of v. Columns S and P = V x S (sweep.h) of a
/// coordinate, I and momentum h of what it carries:
///
///   dT/dv = S'h     dT/dq = P'h     dp/dv = (I S)_force     dp/dq = (S x* h + I P)_force
class KineticGradient {
 public:
  explicit KineticGradient(const Model& model);

  /// At poses and inertias in `data`, x (nv) [m/s, rad/s]; rotors (nv) on the diagonal of M. Of a
  /// tree that floats T is less that of its centre of mass.
  void compute(const Model& model, const Tree& tree, const Kinematics& data, const double* x,
               const VectorX& rotors);

  // Of the tree computed last, valid up to its size.
  VectorX dv, dq;                    ///< of the energy [J s/m, ...; J/m, ...]
  MatrixX momentum_dv, momentum_dq;  ///< 3 x nv, of the linear momentum in W
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
