#include "counterpoint/engine/derivatives/constraints/pair_response.h"

#include "counterpoint/contact/inverse.h"
#include "counterpoint/engine/derivatives/dynamics/right_jacobian.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

/// Finds next = -R G R', by_bias = -R G e_0, and the wrench.
void find_slopes(const PairConstraint& pair, const PairBodies& bodies, PairResponse& out) {
  const auto [R, y] = ContactRows(pair, bodies);
  const int rows = pair.law.rows;
  double f[contact::kMaxRows], hessian[contact::kMaxRows * contact::kMaxRows];
  contact::evaluate(pair.law, y.data(), f, hessian);
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> G(
      hessian, rows, rows);
  const Vector6 w = R * Eigen::Map<const VectorX>(f, rows);
  out.wrench = {w.head<3>(), w.tail<3>()};
  const ContactRows::Columns RG = R.lazyProduct(G);
  out.next = -RG.lazyProduct(R.transpose());
  out.by_bias = -RG.col(0);
}

/// Returns R df/dk, k the smoothing of the law.
Vector6 by_smoothing(const PairConstraint& pair, const PairBodies& bodies) {
  const auto [R, y] = ContactRows(pair, bodies);
  return R * contact::compute_sensitivity(pair.law, y).smoothing;
}

/// Returns R df/dR_N, R_N the regularizer of the normal row.
Vector6 by_softness(const PairConstraint& pair, const PairBodies& bodies) {
  const auto [R, y] = ContactRows(pair, bodies);
  return R * contact::compute_sensitivity(pair.law, y).normal;
}

/// Returns R df/dmu, mu the first coefficient of sliding, of which a spinning patch leaves
/// pair.strength. The second one is a multiple of it.
Vector6 by_friction(const PairConstraint& pair, const PairBodies& bodies) {
  const auto [R, y] = ContactRows(pair, bodies);
  const contact::Sensitivity law = contact::compute_sensitivity(pair.law, y);
  const double ratio = pair.law.friction[1] / pair.law.friction[0];
  return pair.strength * (R * (law.friction.col(0) + ratio * law.friction.col(1)));
}

/// Rotation of a contact's frame about its normal, by the normal and by the displacement of B
/// relative to A: t1 follows the axis of the surface. Zero without an axis: the
/// rotation is then arbitrary.
struct FrameSpin {
  Eigen::RowVector3d by_normal = Eigen::RowVector3d::Zero();
  Eigen::Matrix<double, 1, 6> by_displacement = Eigen::Matrix<double, 1, 6>::Zero();

  explicit FrameSpin(const PairConstraint& pair) {
    const Vector3 &a = pair.friction_axis, n = pair.frame.col(0);
    if (a.isZero(0.0)) return;
    const Vector3 across = n.cross(a);  // its length is that of the axis in the plane
    const double square = across.squaredNorm();
    by_normal = -n.dot(a) / square * across.transpose();
    if (pair.axis_of_b) by_displacement.head<3>() = a.cross(across).transpose() / square;
  }
};

/// Displacement within the step of a point at `arm` from its body's origin, beyond h omega x arm,
/// if the body keeps rotating: u = (exp(h omega) - 1 - [h omega]) arm.
struct Turning {
  Vector3 u;
  Matrix3 by_arm, by_omega;

  Turning(const Vector3& omega, const Vector3& arm, double h) {
    const Vector3 angle = h * omega;
    const Matrix3 turn = quaternion_exp(angle).toRotationMatrix();
    by_arm = turn - Matrix3::Identity() - skew(angle);
    u = by_arm * arm;
    by_omega = h * (skew(arm) - skew(turn * arm) * right_jacobian(angle).transpose());
  }
};

}  // namespace

ContactRows::ContactRows(const PairConstraint& pair, const PairBodies& bodies)
    : R(Columns::Zero(6, pair.law.rows)) {
  for (int i = 0; i < pair.law.rows; ++i) {
    const int row = pair.first + i;
    R.col(i).segment<3>(row < 3 ? 3 : 0) = pair.frame.col(row % 3);
    if (pair.lead != 0.0) R.col(i).head<3>() = pair.lead * pair.frame.col(row);
    if (pair.lead == 0.0 && (row == 1 || row == 2))
      R.col(i).head<3>() = pair.friction_point.cross(pair.frame.col(row));
  }
  Vector6 relative;
  relative << bodies.next_b.angular - bodies.next_a.angular,
      bodies.next_b.linear - bodies.next_a.linear;
  y = R.transpose() * relative;
  for (int i = 0; i < pair.law.rows; ++i) y[i] += pair.law.bias[static_cast<size_t>(i)];
}

Matrix6 motion_cross(const Motion& V) {
  Matrix6 m;
  const Matrix3 w = skew(V.angular);
  m << w, Matrix3::Zero(), skew(V.linear), w;
  return m;
}

Matrix6 carried(const Force& f) {
  Matrix6 m;
  const Matrix3 s = -skew(f.force);
  m << -skew(f.torque), s, s, Matrix3::Zero();
  return m;
}

PairBodies pair_bodies(const PairConstraint& pair, const Kinematics& data,
                       const std::vector<Motion>& V_next) {
  PairBodies out;
  out.arm_a = pair.position - data.X_WB[pair.body_a].translation;
  out.arm_b = pair.position - data.X_WB[pair.body_b].translation;
  if (pair.body_a != 0) {
    out.next_a = shift(V_next[pair.body_a], out.arm_a);
    out.start_a = shift(data.V[pair.body_a], out.arm_a);
  }
  if (pair.body_b != 0) {
    out.next_b = shift(V_next[pair.body_b], out.arm_b);
    out.start_b = shift(data.V[pair.body_b], out.arm_b);
  }
  return out;
}

Matrix6 PairResponse::displaced(const Motion& V_next, const Motion& V_start) const {
  Matrix6 D = still - next * motion_cross(V_next);
  if (by_v) D -= v_b * motion_cross(V_start);
  return D;
}

BodyResponse PairResponse::of_b(const Motion& V_next, const Motion& V_start) const {
  return {displaced(V_next, V_start) - carried(wrench), next, v_b};
}
BodyResponse PairResponse::of_a(const Motion& V_next, const Motion& V_start) const {
  return {displaced(V_next, V_start), next, -v_a};
}
BodyResponse PairResponse::of_b_by_a(const Motion& V_next, const Motion& V_start) const {
  return {carried(wrench) - displaced(V_next, V_start), -next, v_a};
}
BodyResponse PairResponse::of_a_by_b(const Motion& V_next, const Motion& V_start) const {
  return {-displaced(V_next, V_start), -next, -v_b};
}

void find_velocity_response(const PairConstraint& pair, const PairBodies& bodies,
                            PairResponse& out) {
  find_slopes(pair, bodies, out);
  out.still.setZero();
  out.v_a.setZero();
  out.v_b.setZero();
  out.by_v = false;
}

double turning_advance(const PairConstraint& pair, const PairBodies& bodies, double h) {
  const Vector3 a = Turning(bodies.start_a.angular, bodies.arm_a, h).u;
  const Vector3 b = Turning(bodies.start_b.angular, bodies.arm_b, h).u;
  return pair.frame.col(0).dot(a - b);
}

// Long: one formula, whose terms share their factors.
void find_contact_response(const PairConstraint& pair, const PairBodies& bodies,
                           const ContactMotion& motion, const LawSlopes& law, bool turning,
                           double h, PairResponse& out, const ImpulseShare& share) {
  using Rows36 = Eigen::Matrix<double, 3, 6>;
  using Row6 = Eigen::Matrix<double, 1, 6>;
  using Matrix63 = Eigen::Matrix<double, 6, 3>;
  find_slopes(pair, bodies, out);
  Vector6 whole;  // before the share is taken
  whole << out.wrench.torque, out.wrench.force;
  out.wrench = out.wrench * share.value;
  out.next *= share.value;
  out.by_bias *= share.value;
  Vector6 by_gap = law.gap * out.by_bias + share.gap * whole;
  if (law.smoothing != 0.0) by_gap += share.value * law.smoothing * by_smoothing(pair, bodies);
  if (law.softness != 0.0) by_gap += share.value * law.softness * by_softness(pair, bodies);
  const Motion next = bodies.next_b - bodies.next_a, start = bodies.start_b - bodies.start_a;
  const Vector3 n = pair.frame.col(0);
  const Matrix3 f = skew(out.wrench.force);
  // Derivatives of bias, share and friction by the velocity at the start and by the normal.
  Matrix63 by_speed =
      out.by_bias * (pair.frame * law.v).transpose() + whole * (pair.frame * share.v).transpose();
  const Matrix63 by_normal =
      out.by_bias * law.normal.transpose() + whole * share.normal.transpose();
  const bool rubs = !law.friction.isZero(0.0);
  if (rubs)
    by_speed += share.value * by_friction(pair, bodies) * (pair.frame * law.friction).transpose();
  const bool rebounds = rubs || !law.v.isZero(0.0) || !share.v.isZero(0.0);
  const Turning a(bodies.start_a.angular, bodies.arm_a, turning ? h : 0.0);
  const Turning o(bodies.start_b.angular, bodies.arm_b, turning ? h : 0.0);
  const Eigen::RowVector3d along = -n.transpose();  // the gap shrinks by n (u_A - u_B)
  // Response to a motion m of place, normal and gap; arm_b: motion of the place seen from B's
  // origin.
  const FrameSpin spin(pair);
  const auto respond = [&](const PlaceMotion& m, const Rows36& arm_b, const Row6& by_axis) {
    // The frame turns with the normal, and about it with the axis of friction.
    const Rows36 turned = skew(n) * m.normal + n * (spin.by_normal * m.normal + by_axis);
    Matrix6 y;
    y.topRows<3>() = skew(next.angular) * turned;
    y.bottomRows<3>() = skew(next.angular) * m.point + skew(next.linear) * turned;
    Row6 gap = m.gap;
    if (turning)
      gap += -(a.u - o.u).transpose() * m.normal + along * (a.by_arm * m.point - o.by_arm * arm_b);
    Matrix6 w = out.next * y + by_normal * m.normal + by_gap * gap;
    if (rebounds) w += by_speed * (skew(start.angular) * m.point + skew(start.linear) * turned);
    w.topRows<3>() -= skew(out.wrench.torque) * turned + f * m.point;
    w.bottomRows<3>() -= f * turned;
    return w;
  };
  Rows36 arm_b = motion.point;  // minus the motion of B's origin
  arm_b.leftCols<3>() -= skew(bodies.arm_b);
  arm_b.rightCols<3>() -= Matrix3::Identity();
  out.still = respond(motion, arm_b, spin.by_displacement);
  // If B is the world, everything here turns with A except gravity.
  if (pair.body_b == 0) out.still.leftCols<3>() += by_normal * skew(n);
  out.by_v = turning || rebounds || motion.by_v;
  Row6 gap_v_a = Row6::Zero(), gap_v_b = Row6::Zero();
  if (turning) {
    gap_v_a.head<3>() = along * a.by_omega;
    gap_v_b.head<3>() = -along * o.by_omega;
  }
  out.v_a = by_gap * gap_v_a;
  out.v_b = by_gap * gap_v_b;
  out.v_a.rightCols<3>() -= by_speed;
  out.v_b.rightCols<3>() += by_speed;
  if (!motion.by_v) return;
  out.v_a += respond(motion.v_a, motion.v_a.point, Row6::Zero());
  out.v_b += respond(motion.v_b, motion.v_b.point, Row6::Zero());
}

}  // namespace counterpoint
