#include "counterpoint/engine/constraints/bounce.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics/gravity_compensation.h"

namespace counterpoint {
namespace {

Bounce bounce_at_start(double h, double restitution, double gap, double velocity) {
  Bounce out;
  out.happens = gap + h * velocity <= 0.0;
  out.speed = -restitution * velocity;
  out.by_velocity = -restitution;
  out.by_restitution = -velocity;
  return out;
}

}  // namespace

Bounce find_bounce(Integrator integrator, double h, double restitution, double gap, double velocity,
                   double fall) {
  if (!(velocity < 0.0 && restitution > 0.0)) return {};
  if (integrator != Integrator::kSemiImplicitEuler)
    return bounce_at_start(h, restitution, gap, velocity);
  const double e = restitution, a = fall, d = std::max(gap, 0.0);
  const double u = velocity + 0.5 * h * a, square = u * u - 2.0 * a * d;
  if (!(u < 0.0 && square > 0.0)) return {};
  const double s = std::sqrt(square), t = 2.0 * d / (s - u), left = h - t;
  if (!(left >= 0.0 && e * s + 0.5 * a * left > 0.0)) return {};
  Bounce out;
  out.happens = true;
  out.time = t;
  out.speed = e * s + a * (left - 0.5 * h);
  out.by_gap = gap > 0.0 ? -(1.0 + e) * a / s : 0.0;
  out.by_velocity = (e * u - a * t) / s;
  out.by_fall = e * (0.5 * h * u - d) / s + left - 0.5 * h - a * (0.5 * h * t + 0.5 * t * t) / s;
  out.by_restitution = s;
  out.time_by_gap = gap > 0.0 ? 1.0 / s : 0.0;
  out.time_by_velocity = t / s;
  out.time_by_fall = 0.5 * t * (h + t) / s;
  return out;
}

namespace {

/// What is left of a tree's weight where some is carried.
double share_of_weight(const Model& model, const Tree& tree) {
  const BodyRange bodies{tree.body_begin, tree.body_end};
  const auto carried = compensations_of(model, bodies);
  if (carried.empty()) return 1.0;
  double mass = 0.0, left = 0.0;
  for (int b = bodies.begin; b < bodies.end; ++b) mass += model.body(b).inertia.mass;
  left = mass;
  for (const GravityCompensation& c : carried) left -= c.mass;
  return mass > 0.0 ? left / mass : 1.0;
}

}  // namespace

std::vector<Vector3> free_fall(const Model& model) {
  std::vector<Vector3> fall(static_cast<size_t>(model.num_bodies()), Vector3::Zero());
  const Vector3& g = model.gravity();
  for (const Tree& tree : model.trees()) {
    const Body& root = model.body(tree.body_begin);
    Vector3 free = Vector3::Zero();
    if (root.joint_type == JointType::kFloating) free = g;
    if (root.joint_type == JointType::kPrismatic && tree.body_end == tree.body_begin + 1) {
      const Vector3 axis = root.X_PJ.rotation.col(2);
      free = axis.dot(g) * axis;
    }
    free *= share_of_weight(model, tree);
    std::fill(fall.begin() + tree.body_begin, fall.begin() + tree.body_end, free);
  }
  return fall;
}

}  // namespace counterpoint
