#include "closed_forms.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/dynamics/euler_top.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/step.h"
#include "families.h"

namespace counterpoint::apps::accuracy {
namespace {

constexpr double kExact = 1e-9;  ///< [m, rad, relative]: smaller differences count as zero

/// State of a free body.
struct FreeBody {
  Vector3 position, velocity, spin;  ///< origin, in W; spin in the body-fixed frame
  Matrix3 rotation;

  static FreeBody read(const VectorX& q, const VectorX& v, const Body& body) {
    const auto* at = q.data() + body.q_index;
    return {Vector3(at[0], at[1], at[2]), v.segment<3>(body.v_index),
            v.segment<3>(body.v_index + 3),
            Quaternion(at[3], at[4], at[5], at[6]).normalized().toRotationMatrix()};
  }
  void write(const Body& body, State& state) const {
    const Quaternion turn(rotation);
    state.q.segment<3>(body.q_index) = position;
    state.q.segment<4>(body.q_index + 3) << turn.w(), turn.x(), turn.y(), turn.z();
    state.v.segment<3>(body.v_index) = velocity;
    state.v.segment<3>(body.v_index + 3) = spin;
  }
};

State blank(const Scene& scene, double time) { return {time, scene.q, scene.v}; }

bool has_effect(const Scene& scene, Effect effect) {
  const collision::Collider collider(scene.model);
  for (const EffectUse& use : list_effects(scene.model, collider, scene.options))
    if (use.effect == effect) return use.on;
  return false;
}

Vector3 gravity_of(const Scene& scene) {
  return has_effect(scene, Effect::kGravity) ? scene.model.gravity() : Vector3(Vector3::Zero());
}

/// Reason why the bodies do not all fly freely; empty: they do.
std::string not_free(const Scene& scene) {
  const Model& model = scene.model;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (body.joint_type != JointType::kFloating || body.parent != 0)
      return fmt::format("'{}' is not free", model.joint(i - 1).name);
    if (!body.X_PJ.rotation.isIdentity(0.0) || !body.X_PJ.translation.isZero(0.0))
      return fmt::format("'{}' is not placed in the world's axes", model.joint(i - 1).name);
  }
  if (model.num_bodies() < 2) return "nothing moves";
  if (has_effect(scene, Effect::kDrag)) return "there is drag";
  if (!model.gravity_compensations().empty()) return "some weight is carried";
  if (!scene.options.effects.has(Effect::kCoriolis)) return "coriolis is switched off";
  return {};
}

/// Torque-free rotation: the angular momentum stays constant in W. A principal axis that never
/// comes near it precesses about it at a rate that is integrated (Gauss-Legendre, to round-off).
class TorqueFree {
 public:
  TorqueFree(const Matrix3& inertia, const Matrix3& rotation, const Vector3& spin)
      : inertia_(inertia),
        rotation_(rotation),
        spin_(spin),
        top_(inertia),
        momentum_(rotation * (inertia * spin)) {
    axis_ = farthest_axis();
  }

  void at(double time, Matrix3& rotation, Vector3& spin) const {
    spin = top_.advance(spin_, time);
    if (momentum_.norm() == 0.0) {
      rotation = rotation_;
      return;
    }
    const Vector3 n = momentum_.normalized();
    const Matrix3 start = rotation_ * triad(spin_);
    rotation =
        Eigen::AngleAxisd(turned(time), n).toRotationMatrix() * start * triad(spin).transpose();
  }

 private:
  Vector3 direction(const Vector3& spin) const { return (inertia_ * spin).normalized(); }

  /// Triad in the body-fixed frame: z along the angular momentum, the principal axis in the x-z
  /// plane.
  Matrix3 triad(const Vector3& spin) const {
    Matrix3 out;
    const Vector3 z = direction(spin);
    out.col(2) = z;
    out.col(0) = (axis_ - axis_.dot(z) * z).normalized();
    out.col(1) = z.cross(out.col(0));
    return out;
  }

  double rate(double time) const {
    const Vector3 spin = top_.advance(spin_, time), n = direction(spin);
    const double along = n.dot(axis_);
    return (n.dot(spin) - along * spin.dot(axis_)) / (1.0 - along * along);
  }

  double turned(double time) const {
    // Abscissae and weights of the eight-point rule on [-1, 1] (Abramowitz & Stegun 25.4.30).
    constexpr std::array<double, 4> x = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                         0.9602898564975363};
    constexpr std::array<double, 4> weight = {0.3626837833783620, 0.3137066458778873,
                                              0.2223810344533745, 0.1012285362903763};
    const double panels = std::max(1.0, std::ceil(4.0 * time * spin_.norm()));
    const double half = 0.5 * time / panels;
    double sum = 0.0;
    for (double k = 0.0; k < panels; ++k) {
      const double middle = (2.0 * k + 1.0) * half;
      for (size_t i = 0; i < x.size(); ++i)
        sum += weight[i] * (rate(middle - half * x[i]) + rate(middle + half * x[i]));
    }
    return half * sum;
  }

  /// Finds the principal axis whose largest |cosine| to the momentum during the motion is smallest.
  /// It is at most 0.71 for some axis, because the momentum can come close to only one axis at a
  /// time.
  Vector3 farthest_axis() const {
    const Matrix3 axes = principal_axes(inertia_).axes;
    Vector3 most = Vector3::Zero();
    if (momentum_.norm() == 0.0) return axes.col(0);
    for (int k = 0; k < 2000; ++k) {
      const double time = 0.02 * k / spin_.norm();
      most = most.cwiseMax((axes.transpose() * direction(top_.advance(spin_, time))).cwiseAbs());
    }
    Eigen::Index best = 0;
    most.minCoeff(&best);
    return axes.col(best);
  }

  Matrix3 inertia_, rotation_;
  Vector3 spin_;
  EulerTop top_;
  Vector3 momentum_, axis_;
};

std::string free_flight(const Scene& scene, Recognized& out) {
  if (std::string why = not_free(scene); !why.empty()) return why;
  if (rows_of(scene).any) return "bodies can touch, or are tied";
  const Vector3 gravity = gravity_of(scene);
  std::vector<TorqueFree> turns;
  for (int i = 1; i < scene.model.num_bodies(); ++i) {
    const Body& body = scene.model.body(i);
    const FreeBody start = FreeBody::read(scene.q, scene.v, body);
    turns.emplace_back(body.inertia.rotational, start.rotation, start.spin);
  }
  out.motion = [&scene, gravity, turns](double time) {
    State state = blank(scene, time);
    for (int i = 1; i < scene.model.num_bodies(); ++i) {
      const Body& body = scene.model.body(i);
      const Vector3& center = body.inertia.center;
      FreeBody at = FreeBody::read(scene.q, scene.v, body);
      const Vector3 p = at.position + at.rotation * center;
      const Vector3 v = at.velocity + at.rotation * at.spin.cross(center);
      turns[static_cast<size_t>(i - 1)].at(time, at.rotation, at.spin);
      at.position = p + time * v + 0.5 * time * time * gravity - at.rotation * center;
      at.velocity = v + time * gravity - at.rotation * at.spin.cross(center);
      at.write(body, state);
    }
    return state;
  };
  out.description = "closed form: free flight, parabola and Euler's top";
  return {};
}

/// One body with one shape on one plane.
struct OnPlane {
  const Body* body = nullptr;
  const Geometry* shape = nullptr;
  Vector3 normal = Vector3::UnitZ();    ///< outward normal of the plane
  double friction = 0.0, weight = 0.0;  ///< [-]; gravity towards the plane [m/s^2]
  Vector3 along = Vector3::Zero();      ///< component of gravity in the plane [m/s^2]
  FreeBody start;
};

std::string on_plane(const Scene& scene, ShapeType type, OnPlane& out) {
  if (std::string why = not_free(scene); !why.empty()) return why;
  const Model& model = scene.model;
  if (model.num_bodies() != 2 || model.geometries().size() != 2)
    return "it takes one body of one shape on one plane";
  const Geometry* plane = nullptr;
  for (const Geometry& g : model.geometries()) (g.body == 0 ? plane : out.shape) = &g;
  if (!plane || !out.shape || plane->shape.type != ShapeType::kPlane ||
      out.shape->shape.type != type)
    return "it takes one body of that shape on one plane";
  if (!model.gravity_compensations().empty()) return "some weight is carried";
  if (!has_effect(scene, Effect::kFriction)) return "there is no friction";
  const Material pair =
      model.pair_material(static_cast<int>(plane - model.geometries().data()),
                          static_cast<int>(out.shape - model.geometries().data()));
  if (pair.restitution > 0.0 || pair.torsional_friction > 0.0 || pair.rolling_friction > 0.0)
    return "restitution, torsional or rolling friction";
  out.body = &model.body(1);
  if ((out.shape->X_BG.translation - out.body->inertia.center).norm() > kExact)
    return "the centre of mass is not that of the shape";
  out.start = FreeBody::read(scene.q, scene.v, *out.body);
  out.normal = plane->X_BG.rotation.col(2);
  const Vector3 gravity = gravity_of(scene);
  out.weight = -gravity.dot(out.normal);
  out.along = gravity + out.weight * out.normal;
  out.friction = pair.friction;
  if (!(out.weight > 0.0)) return "gravity does not hold it on the plane";
  const Pose X_WG = Pose{out.start.rotation, out.start.position} * out.shape->X_BG;
  const double gap = [&] {
    Pose turned = X_WG;  // in the plane's frame, whose z axis is the height
    turned.rotation = plane->X_BG.rotation.transpose() * X_WG.rotation;
    turned.translation =
        plane->X_BG.rotation.transpose() * (X_WG.translation - plane->X_BG.translation);
    return lowest_point(out.shape->shape, turned);
  }();
  if (std::abs(gap) > kExact) return fmt::format("it starts {:.3g} m off the plane", gap);
  if (std::abs(out.start.velocity.dot(out.normal)) > kExact) return "it moves across the plane";
  return {};
}

/// Distance and speed along a line under a driving acceleration `pull` [m/s^2] and Coulomb friction
/// of at most `grip` [m/s^2].
struct Slide {
  double pull, grip, speed;  ///< speed >= 0 at the start; if it is 0, pull >= 0
  void at(double time, double& way, double& v) const {
    const double first = pull - grip;
    if (speed == 0.0 && first <= 0.0) {
      way = v = 0.0;
      return;
    }
    const double stop = first < 0.0 ? -speed / first : time + 1.0;
    const double moving = std::min(time, stop);
    way = speed * moving + 0.5 * first * moving * moving;
    v = time < stop ? speed + first * time : 0.0;
    const double back = pull + grip, rest = time - stop;
    if (rest <= 0.0 || back >= 0.0) return;
    way += 0.5 * back * rest * rest;
    v = back * rest;
  }
};

std::string sliding_block(const Scene& scene, Recognized& out) {
  OnPlane at;
  if (std::string why = on_plane(scene, ShapeType::kBox, at); !why.empty()) return why;
  if (at.start.spin.norm() > kExact) return "it spins";
  const Matrix3 axes = at.start.rotation * at.shape->X_BG.rotation;
  Eigen::Index up = 0;
  const double cosine = (axes.transpose() * at.normal).cwiseAbs().maxCoeff(&up);
  if (1.0 - cosine > kExact) return "it does not lie flat";
  const Vector3& half = at.shape->shape.size;
  const double narrow = std::min(half[(up + 1) % 3], half[(up + 2) % 3]);
  if (at.friction * half[up] >= narrow) return "friction may tip it";
  const Vector3& v = at.start.velocity;
  if (v.cross(at.along).norm() > kExact * (v.norm() * at.along.norm()))
    return "it slides across the slope";
  const bool moves = v.norm() > 0.0;
  const Vector3 line = moves                   ? Vector3(v.normalized())
                       : at.along.norm() > 0.0 ? Vector3(at.along.normalized())
                                               : Vector3(Vector3::Zero());
  const Slide slide{at.along.dot(line), at.friction * at.weight, v.norm()};
  out.motion = [&scene, at, line, slide](double time) {
    double way = 0.0, speed = 0.0;
    slide.at(time, way, speed);
    State state = blank(scene, time);
    FreeBody body = at.start;
    body.position += way * line;
    body.velocity = speed * line;
    body.write(*at.body, state);
    return state;
  };
  out.description = "closed form: a block slides on a plane by Coulomb's law";
  return {};
}

std::string sphere_to_roll(const Scene& scene, Recognized& out) {
  OnPlane at;
  if (std::string why = on_plane(scene, ShapeType::kSphere, at); !why.empty()) return why;
  const Matrix3& inertia = at.body->inertia.rotational;
  const double moment = inertia.trace() / 3.0;
  if (!inertia.isApprox(moment * Matrix3::Identity(), kExact)) return "its inertia is not round";
  if (at.body->inertia.center.norm() > kExact) return "its origin is not its centre";
  if (at.along.norm() > kExact) return "the plane is not level";
  const double radius = at.shape->shape.size[0];
  const Vector3 spin = at.start.rotation * at.start.spin;
  const Vector3 slip = at.start.velocity - radius * spin.cross(at.normal);
  const bool slips = slip.norm() > kExact;
  const Vector3 line = slips ? Vector3(slip.normalized()) : Vector3(Vector3::Zero());
  const Vector3 axle = slips               ? Vector3(at.normal.cross(line))
                       : spin.norm() > 0.0 ? Vector3(spin.normalized())
                                           : Vector3(Vector3::UnitX());
  if (spin.cross(axle).norm() > kExact) return "it spins about another axis than friction turns it";
  const double brake = at.friction * at.weight;
  const double turn = brake * radius * at.body->inertia.mass / moment;
  const double grips = slips ? slip.norm() / (brake + radius * turn) : 0.0;
  out.motion = [&scene, at, line, axle, spin, brake, turn, grips](double time) {
    const double s = std::min(time, grips), rest = time - s;
    State state = blank(scene, time);
    FreeBody body = at.start;
    body.velocity -= brake * s * line;
    body.position += s * (at.start.velocity - 0.5 * brake * s * line) + rest * body.velocity;
    const double rate = spin.dot(axle) + turn * s;
    const double angle = s * (spin.dot(axle) + 0.5 * turn * s) + rest * rate;
    body.rotation = Eigen::AngleAxisd(angle, axle).toRotationMatrix() * at.start.rotation;
    body.spin = body.rotation.transpose() * (rate * axle);
    body.write(*at.body, state);
    return state;
  };
  out.description = "closed form: a sphere slips by Coulomb's law until it rolls";
  return {};
}

}  // namespace

Recognized recognize(const Scene& scene) {
  Recognized out;
  const std::string flight = free_flight(scene, out);
  if (flight.empty()) return out;
  const std::string block = sliding_block(scene, out);
  if (block.empty()) return out;
  const std::string sphere = sphere_to_roll(scene, out);
  if (sphere.empty()) return out;
  out.why_not = fmt::format(
      "free flight ({}), a box that slides on a plane ({}), a sphere that "
      "slips until it rolls ({})",
      flight, block, sphere);
  return out;
}

}  // namespace counterpoint::apps::accuracy
