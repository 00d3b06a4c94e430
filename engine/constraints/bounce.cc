#include "counterpoint/engine/constraints/bounce.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/contact_finder.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/dynamics/euler_top.h"
#include "counterpoint/engine/dynamics/gravity_compensation.h"

namespace counterpoint {
namespace {

/// Fraction of the energy after a bounce that the fall across the gap takes (u as in bounce.h).
/// Above kMostOfWay a bounce at the start of the step cannot have the right energy.
constexpr double kMostOfWay = 0.5;
double share_of_way(double e, double d, double u, double a) {
  return -2.0 * (1.0 - e * e) * a * d / (e * e * u * u);
}

/// Bounce at the start of the step: (w+ - h a / 2)^2 = e^2 u^2 left(x) with x = share_of_way; left
/// = 1 - x, and the hyperbola that continues it beyond kMostOfWay.
Bounce bounce_at_start(double h, double e, double d, double u, double a) {
  if (!(d + h * (u + 0.5 * h * a) <= 0.0)) return {};
  const double x = share_of_way(e, d, u, a);
  const bool right = x <= kMostOfWay;
  const double left = right ? 1.0 - x : kMostOfWay * kMostOfWay / x,
               slope = right ? -1.0 : -left / x;
  const double parts = -e * u * std::sqrt(left);
  if (!(d + h * (parts + 0.5 * h * a) > 0.0)) return {};
  Bounce out;
  out.happens = true;
  out.speed = parts + 0.5 * h * a;
  // Derivatives of parts^2 / 2 by gap, u, a and e.
  const double by_x = 0.5 * e * e * u * u * slope, by_way = -2.0 * (1.0 - e * e) / (e * e * u * u);
  out.by_gap = by_x * by_way * a / parts;
  out.by_velocity = (e * e * u * left - 2.0 * by_x * x / u) / parts;
  out.by_fall = by_x * by_way * d / parts + 0.5 * h;
  out.by_restitution = (e * u * u * left + by_x * 4.0 * a * d / (e * e * e * u * u)) / parts;
  return out;
}

/// Bounce at its time of impact t.
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
                   double velocity, double fall) {
  // Derivative of u by the acceleration.
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

Vector3 spin_change(const Model& model, Integrator integrator, double h, int body,
                    const Matrix3& R_WB, const Vector3& omega) {
  if (body == 0) return Vector3::Zero();
  const Body& b = model.body(body);
  if (b.joint_type != JointType::kFloating || b.subtree_end != body + 1) return Vector3::Zero();
  const Matrix3& inertia = b.inertia.rotational;
  const Vector3 w = R_WB.transpose() * omega;
  if (integrator == Integrator::kSemiImplicitEuler)
    return R_WB * (EulerTop(inertia).advance(w, h) - w);
  // Fixed-point iteration of the implicit midpoint rule (midpoint.h); it converges by h |w| / 2 per
  // iteration.
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

/// Fraction of a tree's weight that gravity compensation leaves.
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

/// Whether a spring, a servo or an actuator may hold the joint, so that it does not fall freely.
bool is_carried(const Model& model, int joint) {
  const auto holds = [&](const JointSpring& spring) { return spring.joint == joint; };
  const auto drives = [&](const Actuator& a) {
    return a.transmission == Transmission::kJoint && a.joint == joint;
  };
  return model.find_servo(joint) >= 0 ||
         std::any_of(model.actuators().begin(), model.actuators().end(), drives) ||
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

Vector3 ContactFinder::relative_fall(EffectSet effects, const PairConstraint& contact) const {
  if (!effects.has(Effect::kGravity)) return Vector3::Zero();
  return fall_[contact.body_b] - fall_[contact.body_a];
}

Bounce ContactFinder::find_bounce(const Model& model, const SimulationOptions& options,
                                  EffectSet effects, const Kinematics& data,
                                  const Bouncing& what) const {
  const auto& [surface, contact, gap, v] = what;
  if (!(surface.restitution > 0.0)) return {};
  if (is_wedged(contact)) return {};
  const double h = options.time_step;
  const bool midpoint = options.integrator == Integrator::kImplicitMidpoint;
  // Under the midpoint rule a resting contact shows the velocity of half a step of free fall, or of
  // the load that presses it. Up to half a step of reach_acceleration this is no approach.
  if (midpoint && gap <= touching_gap(options.contact) &&
      -v[0] <= 0.5 * h * options.contact.reach_acceleration)
    return {};
  const Vector3 a = contact.frame.transpose() * relative_fall(effects, contact);
  Vector3 spin = Vector3::Zero();
  for (const int body : {contact.body_a, contact.body_b}) {
    if (body == 0 || !effects.has(Effect::kCoriolis)) continue;
    const Pose& X = data.X_WB[body];
    const Vector3 turned =
        spin_change(model, options.integrator, h, body, X.rotation, data.V[body].angular);
    const Vector3 at = turned.cross(contact.position - X * model.body(body).inertia.center);
    spin += body == contact.body_a ? -at : at;
  }
  const Vector3 seen = v + contact.frame.transpose() * spin;
  const bool alone = crowd_[contact.body_a] <= 1 && crowd_[contact.body_b] <= 1;
  Bounce out = counterpoint::find_bounce(options.integrator, alone, h, surface.restitution, gap,
                                         seen[0], a[0]);
  const double falls = midpoint ? -0.5 * h : 2.0 * out.time;
  // Stopping a separating contact at its gap would take more energy from the other contacts than it
  // gives back, by the part of the gap that its body's rotation takes. Moving back by no more than
  // it has come, it does not penetrate.
  out.parting = std::max(0.0, surface.restitution * (seen[0] + falls * a[0]));
  for (int i = 0; i < 2; ++i) out.slide[i] = seen[i + 1] + falls * a[i + 1];
  out.spins = !spin.isZero(0.0);
  return out;
}

/// Finds the wedged trees, and for each tree the number of contacts that it may close within the
/// step. It uses the speeds of the bodies' surfaces, so the result does not depend on the search
/// margins.
void ContactFinder::find_crowds(const StepContext& at,
                                const std::vector<collision::Candidate>& candidates) {
  std::fill(wedged_.begin(), wedged_.end(), 0);
  std::fill(crowd_.begin(), crowd_.end(), 0);
  const double h = at.h(), falls = h * h * at.model.gravity().norm();
  for (const collision::Candidate& candidate : candidates) {
    const int bodies[2] = {at.model.geometries()[candidate.geometry_a].body,
                           at.model.geometries()[candidate.geometry_b].body};
    const double fastest = search_.fastest_point(bodies[0]) + search_.fastest_point(bodies[1]);
    const bool wedged =
        candidate.gap < -at.options.contact.margin &&
        !at.model.pair_material(candidate.geometry_a, candidate.geometry_b).is_soft();
    const bool near = candidate.gap <= kImpactSpeedUp * h * fastest + falls;
    for (const int body : bodies) {
      if (body == 0) continue;
      const Tree& tree = at.model.trees()[at.model.body(body).tree];
      for (int b = tree.body_begin; b < tree.body_end; ++b) {
        if (wedged) wedged_[b] = 1;
        if (near) ++crowd_[b];
      }
    }
  }
}

}  // namespace counterpoint
