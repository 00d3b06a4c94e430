#include "counterpoint/engine/optimize/terms/kinematic_terms.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/model/spatial.h"

namespace counterpoint::optimization {
namespace {

/// Heights near zero are smoothed over this fraction of the length.
constexpr double kRounding = 0.25;

/// A factor that decreases with height, and its logarithmic derivative with respect to height.
struct Fading {
  double value = 1.0, slope = 0.0;
};
Fading fading(double height, double length) {
  // Negative heights count as zero; the transition is smooth, since Newton's method stalls at a
  // kink.
  const double root = std::hypot(height, kRounding * length);
  return {std::exp(-0.5 * (height + root) / length), -0.5 * (1.0 + height / root) / length};
}

/// Writes the derivatives of fading.value times x (2 rows), from those of x times `scale` and of
/// the height. Written by rows, since a product of two would need memory.
void add_fading(const Fading& fading, const VectorOut& value, double scale,
                const Eigen::Ref<const MatrixX>& by_x,
                const Eigen::Ref<const Eigen::RowVectorXd, 0, Eigen::InnerStride<>>& by_height,
                MatrixX& out) {
  out.resize(2, by_x.cols());
  for (Eigen::Index i = 0; i < 2; ++i)
    out.row(i) = scale * by_x.row(i) + (fading.slope * value[i]) * by_height;
}

BodyRange bodies_of(const Model& model, int body) {
  if (body == 0) return moving_bodies(model);
  const Tree& tree = model.trees()[static_cast<std::size_t>(model.body(body).tree)];
  return {tree.body_begin, tree.body_end};
}

struct CenterOfMass {
  Vector3 position = Vector3::Zero();
  double mass = 0.0;
};

CenterOfMass center_of_mass(const Model& model, BodyRange bodies, const Kinematics& data) {
  CenterOfMass center;
  for (int i = bodies.begin; i < bodies.end; ++i) {
    const SpatialInertia& inertia = model.body(i).inertia;
    center.mass += inertia.mass;
    center.position += inertia.mass * (data.X_WB[i] * inertia.center);
  }
  center.position /= center.mass;
  return center;
}

/// Jacobian (3 x nv) of the centre of mass, from mass and first moment of the subtree of each
/// joint.
void center_jacobian(const Model& model, BodyRange bodies, const Kinematics& data, double mass,
                     KinematicScratch& scratch, MatrixX& out) {
  out.setZero();
  for (int i = bodies.begin; i < bodies.end; ++i) {
    const SpatialInertia& inertia = model.body(i).inertia;
    scratch.mass[i] = inertia.mass;
    scratch.moment[i] = inertia.mass * (data.X_WB[i] * inertia.center);
  }
  for (int i = bodies.end - 1; i >= bodies.begin; --i) {
    const Body& body = model.body(i);
    const Vector3 arm = scratch.moment[i] - scratch.mass[i] * data.X_WB[i].translation;
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k)
      out.col(k) = (scratch.mass[i] * data.axis[k].linear + data.axis[k].angular.cross(arm)) / mass;
    if (body.parent < bodies.begin) continue;
    scratch.mass[body.parent] += scratch.mass[i];
    scratch.moment[body.parent] += scratch.moment[i];
  }
}

/// Slip over h of the material point that is lowest at the start of the step, as in contacts: the
/// centre of a rolling sphere moves, but its contact point does not slide. x, last: the centre at
/// the end and at the start; s.a, s.b: their Jacobians, if derivatives are wanted.
void evaluate_sliding(const FramePoses& frames, const Term& term, const Vector3& x,
                      const Vector3& last, KinematicScratch& s, TermValue& out) {
  const auto& [model, h, before, at, frame] = frames;
  const Vector3 z = Vector3::UnitZ();
  const Matrix3 turn = at.X_WB[term.body].rotation * before.X_WB[term.body].rotation.transpose();
  const Vector3 up = turn * z, slip = x - last - term.radius * (up - z);
  // Height at the end of the step: contacts exert force in steps that end with a closed gap.
  const Fading f = fading(x.z() - term.radius, term.length);
  out.value = f.value / h * slip.head<2>();
  if (!out.derivatives()) return;
  add_fading(f, out.value, f.value / h, s.a, s.a.row(2), *out.by_at);
  *out.by_before = -f.value / h * s.b.topRows(2);
  if (term.radius == 0.0) return;
  const double lever = term.radius * f.value / h;
  angular_jacobian(model, at, term.body, s.a);
  *out.by_at += (lever * skew(up).topRows<2>()).lazyProduct(s.a);
  angular_jacobian(model, before, term.body, s.b);
  *out.by_before -= (lever * (turn * skew(z)).topRows<2>()).lazyProduct(s.b);
}

void evaluate_point(const FramePoses& frames, const Term& term, KinematicScratch& s,
                    TermValue& out) {
  const auto& [model, h, before, at, frame] = frames;
  const Vector3 x = point_position(at, term.body, term.point);
  const bool differs =
      term.quantity == Quantity::kPointVelocity || term.quantity == Quantity::kSliding;
  const Vector3 last = differs ? point_position(before, term.body, term.point) : x;
  const bool derivatives = out.derivatives();
  if (derivatives) point_jacobian(model, at, term.body, x, s.a);
  if (derivatives && differs) point_jacobian(model, before, term.body, last, s.b);
  switch (term.quantity) {
    case Quantity::kPosition:
      out.value = x;
      if (derivatives) *out.by_at = s.a;
      break;
    case Quantity::kPointVelocity:
      out.value = (x - last) / h;
      if (!derivatives) break;
      *out.by_at = s.a / h;
      *out.by_before = -s.b / h;
      break;
    case Quantity::kClearance: {
      const double height = x.z() - term.radius, short_of = term.target_at(frame)[0] - height;
      out.value[0] = std::max(0.0, short_of);
      if (!derivatives) break;
      out.by_at->setZero(1, model.nv());
      if (short_of > 0.0) *out.by_at = -s.a.row(2);
      break;
    }
    default:
      evaluate_sliding(frames, term, x, last, s, out);
  }
}

Matrix3 orientation_at(const Term& term, int frame) {
  if (term.targets.empty()) return term.orientation;
  const VectorX& q = term.targets[static_cast<std::size_t>(frame)];
  return Quaternion(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

void evaluate_turn(const FramePoses& frames, const Term& term, KinematicScratch& s,
                   TermValue& out) {
  const auto& [model, h, before, at, frame] = frames;
  const Matrix3& R = at.X_WB[term.body].rotation;
  if (term.quantity == Quantity::kOrientation) {
    const Matrix3 off = orientation_at(term, frame).transpose() * R;
    const Vector3 r = quaternion_log(Quaternion(off));
    out.value = r;
    if (!out.derivatives()) return;
    // R' converts the angular velocity from W to body axes, where the right Jacobian applies.
    const double angle2 = r.squaredNorm(), angle = std::sqrt(angle2);
    const double c = angle2 < 1e-4 ? 1.0 / 12.0 + angle2 / 720.0
                                   : (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / angle2;
    const Matrix3 K = skew(r);
    angular_jacobian(model, at, term.body, s.a);
    const Matrix3 by_turn = (Matrix3::Identity() + 0.5 * K + c * K * K) * R.transpose();
    *out.by_at = by_turn.lazyProduct(s.a);
    return;
  }
  const Vector3 n = R * term.axis, x = point_position(at, term.body, term.point);
  const Fading f = fading(x.z() - term.radius, term.length);
  out.value = f.value * n.head<2>();
  if (!out.derivatives()) return;
  angular_jacobian(model, at, term.body, s.a);
  for (auto column : s.a.colwise()) column = Vector3(column).cross(n);
  point_jacobian(model, at, term.body, x, s.b);
  add_fading(f, out.value, f.value, s.a, s.b.row(2), *out.by_at);
}

void evaluate_center(const FramePoses& frames, const Term& term, KinematicScratch& s,
                     TermValue& out) {
  const auto& [model, h, before, at, frame] = frames;
  const BodyRange bodies = bodies_of(model, term.body);
  const CenterOfMass now = center_of_mass(model, bodies, at);
  if (term.quantity == Quantity::kCenterOfMass) {
    out.value = now.position;
    if (!out.derivatives()) return;
    center_jacobian(model, bodies, at, now.mass, s, s.a);
    *out.by_at = s.a;
    return;
  }
  const CenterOfMass last = center_of_mass(model, bodies, before);
  const double factor = now.mass / h;
  out.value = factor * (now.position - last.position);
  if (!out.derivatives()) return;
  center_jacobian(model, bodies, at, now.mass, s, s.a);
  *out.by_at = factor * s.a;
  center_jacobian(model, bodies, before, now.mass, s, s.b);
  *out.by_before = -factor * s.b;
}

}  // namespace

KinematicScratch::KinematicScratch(const Model& model)
    : a(3, model.nv()),
      b(3, model.nv()),
      moment(static_cast<std::size_t>(model.num_bodies())),
      mass(static_cast<std::size_t>(model.num_bodies())) {}

Vector3 point_position(const Kinematics& data, int body, const Vector3& point) {
  return body == 0 ? point : Vector3(data.X_WB[body] * point);
}

void point_jacobian(const Model& model, const Kinematics& data, int body, const Vector3& position,
                    Eigen::Ref<MatrixX> out) {
  out.setZero();
  for (int i = body; i > 0; i = model.body(i).parent) {
    const Body& b = model.body(i);
    const Vector3 arm = position - data.X_WB[i].translation;
    for (int k = b.v_index; k < b.v_index + joint_nv(b.joint_type); ++k)
      out.col(k) = data.axis[k].at(arm);
  }
}

void add_point_speed(const Model& model, const Kinematics& data, int body, const Vector3& position,
                     const Vector3& direction, VectorX& out) {
  for (int i = body; i > 0; i = model.body(i).parent) {
    const Body& b = model.body(i);
    const Vector3 arm = position - data.X_WB[i].translation;
    for (int k = b.v_index; k < b.v_index + joint_nv(b.joint_type); ++k)
      out[k] += direction.dot(data.axis[k].at(arm));
  }
}

void angular_jacobian(const Model& model, const Kinematics& data, int body, MatrixX& out) {
  out.setZero();
  for (int i = body; i > 0; i = model.body(i).parent) {
    const Body& b = model.body(i);
    for (int k = b.v_index; k < b.v_index + joint_nv(b.joint_type); ++k)
      out.col(k) = data.axis[k].angular;
  }
}

void evaluate_kinematic(const FramePoses& frames, const Term& term, KinematicScratch& scratch,
                        TermValue out) {
  if (out.by_before != nullptr) out.by_before->setZero(out.value.size(), frames.model.nv());
  switch (term.quantity) {
    case Quantity::kOrientation:
    case Quantity::kTilt:
      return evaluate_turn(frames, term, scratch, out);
    case Quantity::kCenterOfMass:
    case Quantity::kMomentum:
      return evaluate_center(frames, term, scratch, out);
    default:
      return evaluate_point(frames, term, scratch, out);
  }
}

Vector3 angular_momentum(const Model& model, const Kinematics& data) {
  const CenterOfMass center = center_of_mass(model, moving_bodies(model), data);
  Vector3 sum = Vector3::Zero();
  for (int i = 1; i < model.num_bodies(); ++i) {
    const SpatialInertia& inertia = model.body(i).inertia;
    const Matrix3& R = data.X_WB[i].rotation;
    const Vector3 arm = R * inertia.center;
    const Vector3 momentum = inertia.mass * data.V[i].at(arm);
    sum += R * (inertia.rotational * (R.transpose() * data.V[i].angular)) +
           (data.X_WB[i].translation + arm - center.position).cross(momentum);
  }
  return sum;
}

}  // namespace counterpoint::optimization
