#include "counterpoint/engine/dynamics.h"

namespace counterpoint {
namespace {

/// Inertia tensor m (c.c 1 - c c') of a point mass m at c.
Matrix3 of_point(double mass, const Vector3& c) {
  return mass * (c.squaredNorm() * Matrix3::Identity() - c * c.transpose());
}

}  // namespace

Matrix3 inertia_tensor(const InertialParameters& p) {
  Matrix3 I;
  I << p[4], p[5], p[7], p[5], p[6], p[8], p[7], p[8], p[9];
  return I;
}

InertialParameters inertial_parameters(const SpatialInertia& inertia) {
  const Matrix3 I = inertia.rotational + of_point(inertia.mass, inertia.center);
  InertialParameters p;
  p << inertia.mass, inertia.mass * inertia.center, I(0, 0), I(0, 1), I(1, 1), I(0, 2), I(1, 2),
      I(2, 2);
  return p;
}

SpatialInertia spatial_inertia(const InertialParameters& p) {
  if (!(p[0] > 0.0)) throw InputError("inertial parameters: the mass must be positive");
  SpatialInertia out;
  out.mass = p[0];
  out.center = p.segment<3>(1) / p[0];
  out.rotational = inertia_tensor(p) - of_point(out.mass, out.center);
  return out;
}

VectorX inertial_parameters(const Model& model) {
  VectorX p(10 * model.num_joints());
  for (int i = 1; i < model.num_bodies(); ++i)
    p.segment<10>(10 * (i - 1)) = inertial_parameters(model.body(i).inertia);
  return p;
}

}  // namespace counterpoint
