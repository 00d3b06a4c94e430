#include "counterpoint/engine/constraints/closures.h"

#include <algorithm>

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

/// Turns [rad] up to which a closure is aimed fully, and from which it is not aimed.
constexpr double kAimedWhole = 0.2, kNotAimed = 0.4;

/// Motion of one anchor in W.
struct Anchor {
  Vector3 position, velocity, acceleration;

  Anchor(const Kinematics& data, const std::vector<Motion>& A, int body, const Pose& X_BC)
      : position(data.X_WB[body] * X_BC.translation) {
    const Vector3 arm = data.X_WB[body].rotation * X_BC.translation;
    const Motion& V = data.V[body];
    velocity = V.at(arm);
    // The anchor moves with the body, hence the convective term.
    acceleration = A[body].at(arm) + V.angular.cross(velocity);
  }
};

/// p_B - p_A [m].
Vector3 anchors_apart(const Closure& closure, const Kinematics& data) {
  return data.X_WB[closure.body_b] * closure.X_BC.translation -
         data.X_WB[closure.body_a] * closure.X_AC.translation;
}

/// Rotation vector from A's anchor frame to B's [rad].
Vector3 anchors_turned(const Closure& closure, const Kinematics& data) {
  const Matrix3 R_WA = data.X_WB[closure.body_a].rotation * closure.X_AC.rotation;
  const Matrix3 R_WB = data.X_WB[closure.body_b].rotation * closure.X_BC.rotation;
  return quaternion_log(Quaternion(Matrix3(R_WB * R_WA.transpose())));
}

/// Error of a closure in the rows of `pair` [m or rad].
Vector3 error_of(const Closure& closure, const PairConstraint& pair, const Kinematics& data) {
  if (pair.first == 3) return anchors_turned(closure, data);
  const Vector3 apart = anchors_apart(closure, data);
  if (closure.type == ClosureType::kDistance) return {apart.norm() - closure.length, 0, 0};
  return apart;
}

}  // namespace

void find_closures(const Model& model, const SimulationOptions& options, const Kinematics& data,
                   const InverseWeights& weights, SleepMask idle, std::vector<Motion>& acceleration,
                   ConstraintSet& out) {
  const double h = options.time_step;
  compute_velocity_accelerations(model, data, acceleration);
  for (size_t i = 0; i < model.closures().size(); ++i) {
    const Closure& closure = model.closures()[i];
    if (idle(closure.body_a) && idle(closure.body_b)) continue;
    const ClosureWeight& weight = weights.closure[i];
    const Anchor a(data, acceleration, closure.body_a, closure.X_AC);
    const Anchor b(data, acceleration, closure.body_b, closure.X_BC);
    PairConstraint pair;
    pair.body_a = closure.body_a;
    pair.body_b = closure.body_b;
    pair.position = 0.5 * (a.position + b.position);
    const auto add = [&](int rows, double alpha, const Vector3& error, const Vector3& curvature) {
      if (!(alpha > 0.0)) return;  // the bodies cannot move in these directions
      pair.law = make_closure_law(options.contact, h, alpha, rows, error, curvature);
      out.pairs.push_back(pair);
      out.closures.push_back(static_cast<int>(i));
    };
    const Vector3 apart = b.position - a.position, parting = b.velocity - a.velocity;
    const Vector3 curvature = b.acceleration - a.acceleration;
    if (closure.type == ClosureType::kDistance) {
      const double d = apart.norm();
      const Vector3 n = d > kNoDirection ? Vector3(apart / d) : Vector3::UnitZ();
      const double along = n.dot(parting);
      const double turning = d > kNoDirection ? (parting.squaredNorm() - along * along) / d : 0.0;
      const Matrix3 t1_t2_n = frame_from_normal(n);
      pair.frame << t1_t2_n.col(2), t1_t2_n.col(0), t1_t2_n.col(1);
      add(1, weight.linear, Vector3(d - closure.length, 0, 0),
          Vector3(n.dot(curvature) + turning, 0, 0));
      continue;
    }
    add(3, weight.linear, apart, curvature);
    if (closure.type != ClosureType::kWeld) continue;
    pair.first = 3;
    add(3, weight.angular, anchors_turned(closure, data),
        acceleration[closure.body_b].angular - acceleration[closure.body_a].angular);
  }
}

void aim_closure(const Closure& closure, const ContactOptions& options, double h,
                 const Kinematics& data, const Kinematics& reached, const std::vector<Motion>& V,
                 PairConstraint& pair) {
  const Vector3 error = error_of(closure, pair, data);
  const contact::Rows y = relative_velocity(pair, data, V);
  // Change of the error beyond h y.
  Vector3 bend = error_of(closure, pair, reached) - error;
  for (int i = 0; i < pair.law.rows; ++i) bend[i] -= h * y[i];
  const Vector3 acceleration = bend * (2.0 / (h * h));
  const double regularizer = pair.law.regularizer;
  pair.law = make_closure_law(options, h, 1.0, pair.law.rows, error, acceleration);
  pair.law.regularizer = regularizer;
}

double share_aimed(double turn) {
  return std::clamp((kNotAimed - turn) / (kNotAimed - kAimedWhole), 0.0, 1.0);
}

double share_aimed_slope(double turn) {
  return turn > kAimedWhole && turn < kNotAimed ? -1.0 / (kNotAimed - kAimedWhole) : 0.0;
}

}  // namespace counterpoint
