#include "counterpoint/engine/constraints/bounce.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics/euler_top.h"
#include "counterpoint/engine/dynamics/gravity_compensation.h"

namespace counterpoint {
namespace {

/// What the way to the gap takes of the energy after a bounce, as a share of it: u as in bounce.h.
/// Above this share a bounce at the start cannot have the right energy.
constexpr double kMostOfWay = 0.5;
double share_of_way(double e, double d, double u, double a) {
  return -2.0 * (1.0 - e * e) * a * d / (e * e * u * u);
}

/// (w+ - h a / 2)^2 = e^2 u^2 left(x), x the share of the way: left = 1 - x, and beyond kMostOfWay
/// the hyperbola that goes on from there.
Bounce bounce_at_start(double h, double e, double d, double u, double a) {
  if (!(d + h * (u + 0.5 * h * a) <= 0.0)) return {};
  const double x = share_of_way(e, d, u, a);
  const bool right = x <= kMostOfWay;
  const double left = right ? 1.0 - x : kMostOfWay * kMostOfWay / x, slope = right ? -1.0 : -left / x;
  const double parts = -e * u * std::sqrt(left);
  if (!(d + h * (parts + 0.5 * h * a) > 0.0)) return {};
  Bounce out;
  out.happens = true;
  out.speed = parts + 0.5 * h * a;
  // Of parts^2 / 2 by the gap, u, a and e.
  const double by_x = 0.5 * e * e * u * u * slope, by_way = -2.0 * (1.0 - e * e) / (e * e * u * u);
  out.by_gap = by_x * by_way * a / parts;
  out.by_velocity = (e * e * u * left - 2.0 * by_x * x / u) / parts;
  out.by_fall = by_x * by_way * d / parts + 0.5 * h;
  out.by_restitution = (e * u * u * left + by_x * 4.0 * a * d / (e * e * e * u * u)) / parts;
  return out;
}

Bounce bounce_at_impact(double h, double e, double d, double u, double a) {
  const double square = u * u - 2.0 * a * d;
  if (!(square > 0.0)) return {};
  const double s = std::sqrt(square), t = 2.0 * d / (s - u), left = h - t;
  if (!(left >= 0.0 && e * s + 0.5 * a * left > 0.0)) return {};
  Bounce out;
  out.happens = true;
  out.time = t;
  out.speed = e * s + a * (left - 0.5 * h);
  out.by_gap = -(1.0 + e) * a / s;
  out.by_velocity = (e * u - a * t) / s;
  out.by_fall = -e * d / s + left - 0.5 * h - 0.5 * a * t * t / s;
  out.by_restitution = s;
  out.time_by_gap = 1.0 / s;
  out.time_by_velocity = t / s;
  out.time_by_fall = 0.5 * t * t / s;
  return out;
}

}  // namespace

Bounce find_bounce(Integrator integrator, bool alone, double h, double restitution, double gap,
                   double velocity, double fall) {  // Parameters: what it depends on, one by one
  // By the acceleration, what u is from there.
  const bool euler = integrator == Integrator::kSemiImplicitEuler;
  const double by_fall = euler ? 0.5 * h : 0.0, u = velocity + by_fall * fall;
  if (!(velocity < 0.0 && u < 0.0 && restitution > 0.0)) return {};
  const double d = std::max(gap, 0.0);
  const bool late = euler && (alone || share_of_way(restitution, d, u, fall) > kMostOfWay);
  Bounce out = late ? bounce_at_impact(h, restitution, d, u, fall)
                    : bounce_at_start(h, restitution, d, u, fall);
  out.by_fall += by_fall * out.by_velocity;
  out.time_by_fall += by_fall * out.time_by_velocity;
  if (!(gap > 0.0)) out.by_gap = out.time_by_gap = 0.0;
  return out;
}

Vector3 spin_change(const Model& model, Integrator integrator, double h, int body, const Matrix3& R_WB,
                    const Vector3& omega) {
  if (body == 0) return Vector3::Zero();
  const Body& b = model.body(body);
  if (b.joint_type != JointType::kFloating || b.subtree_end != body + 1) return Vector3::Zero();
  const Matrix3& inertia = b.inertia.rotational;
  const Vector3 w = R_WB.transpose() * omega;
  if (integrator == Integrator::kSemiImplicitEuler)
    return R_WB * (EulerTop(inertia).advance(w, h) - w);
  // The middle of the implicit rule (midpoint.h), which converges by h |w| / 2 an iteration.
  constexpr int kMost = 60;
  const Eigen::LLT<Matrix3> factor(inertia);
  Vector3 half = Vector3::Zero();
  for (int i = 0; i < kMost; ++i) {
    const Vector3 middle = w + half;
    const Vector3 next = -0.5 * h * factor.solve(middle.cross(inertia * middle));
    const bool settled = (next - half).squaredNorm() <= 1e-34 * middle.squaredNorm();
    half = next;
    if (settled) break;
  }
  return R_WB * (3.0 * half);
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

/// Whether a spring or a servo may hold a joint: it does not fall.
bool is_carried(const Model& model, int joint) {
  const auto holds = [&](const JointSpring& spring) { return spring.joint == joint; };
  return model.find_servo(joint) >= 0 ||
         std::any_of(model.springs().begin(), model.springs().end(), holds);
}

}  // namespace

std::vector<Vector3> free_fall(const Model& model) {
  std::vector<Vector3> fall(static_cast<size_t>(model.num_bodies()), Vector3::Zero());
  const Vector3& g = model.gravity();
  for (const Tree& tree : model.trees()) {
    const Body& root = model.body(tree.body_begin);
    Vector3 free = Vector3::Zero();
    if (root.joint_type == JointType::kFloating) free = g;
    if (root.joint_type == JointType::kPrismatic && tree.body_end == tree.body_begin + 1 &&
        !is_carried(model, tree.body_begin - 1)) {
      const Vector3 axis = root.X_PJ.rotation.col(2);
      free = axis.dot(g) * axis;
    }
    free *= share_of_weight(model, tree);
    std::fill(fall.begin() + tree.body_begin, fall.begin() + tree.body_end, free);
  }
  return fall;
}

}  // namespace counterpoint
