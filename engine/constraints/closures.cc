#include "counterpoint/engine/constraints/closures.h"

#include <algorithm>
#include <array>
#include <cmath>

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
Vector3 anchors_apart(const Closure& closure, const Pose& X_BC, const Kinematics& data) {
  return data.X_WB[closure.body_b] * X_BC.translation -
         data.X_WB[closure.body_a] * closure.X_AC.translation;
}

Matrix3 axes_of_a(const Closure& closure, const Kinematics& data) {
  return data.X_WB[closure.body_a].rotation * closure.X_AC.rotation;
}

Matrix3 axes_of_b(const Closure& closure, const Pose& X_BC, const Kinematics& data) {
  return data.X_WB[closure.body_b].rotation * X_BC.rotation;
}

/// Rotation vector from A's anchor frame to B's [rad].
Vector3 anchors_turned(const Closure& closure, const Pose& X_BC, const Kinematics& data) {
  const Matrix3 R_WA = axes_of_a(closure, data);
  return quaternion_log(Quaternion(Matrix3(axes_of_b(closure, X_BC, data) * R_WA.transpose())));
}

/// Components of a vector along the rows of a pair.
Vector3 along_rows(const PairConstraint& pair, const Matrix3& frame, const Vector3& v) {
  Vector3 rows = Vector3::Zero();
  for (int i = 0; i < pair.law.rows; ++i) rows[i] = frame.col((pair.first + i) % 3).dot(v);
  return rows;
}

/// Error of a rigid closure in the rows of `pair` [m or rad].
Vector3 error_of(const Closure& closure, const Pose& X_BC, const PairConstraint& pair,
                 const Kinematics& data) {
  const Matrix3 R_WA = axes_of_a(closure, data);
  switch (pair.error) {
    case ClosureError::kApart:
      return anchors_apart(closure, X_BC, data);
    case ClosureError::kOffset:
      return along_rows(pair, R_WA, anchors_apart(closure, X_BC, data));
    case ClosureError::kDistance:
      return {anchors_apart(closure, X_BC, data).norm() - closure.length, 0, 0};
    case ClosureError::kTurn:
      return anchors_turned(closure, X_BC, data);
    case ClosureError::kAxis:
      return along_rows(pair, R_WA, R_WA.col(2).cross(axes_of_b(closure, X_BC, data).col(2)));
    case ClosureError::kThread:
      return {thread_error(closure, {R_WA.transpose() * axes_of_b(closure, X_BC, data),
                                     R_WA.transpose() * anchors_apart(closure, X_BC, data)}),
              0, 0};
  }
  return Vector3::Zero();
}

/// Whether the anchors coincide.
bool holds_point(ClosureType type) {
  return type == ClosureType::kBall || type == ClosureType::kWeld || type == ClosureType::kHinge;
}

/// Rows first, first + 1, ... of the six that hold one error.
struct Part {
  ClosureError error;
  int first, rows;
};

/// The parts of a closure.
class Parts {
 public:
  explicit Parts(const Closure& closure) {
    const ClosureType type = closure.type;
    const ClosureSpring &linear = closure.linear, &angular = closure.angular;
    if (type == ClosureType::kDistance) {
      add(ClosureError::kDistance, 0, 1);
    } else if (!acts_at_b(closure)) {
      add(ClosureError::kApart, 0, 3);
    } else {
      add(ClosureError::kOffset, 0, holds_point(type) ? 3 : 2, linear);
    }
    if (type == ClosureType::kWeld || type == ClosureType::kPrismatic) {
      add(ClosureError::kTurn, 3, 3, angular);
    } else if (holds_angles(type)) {
      add(ClosureError::kAxis, 3, 2, angular);
    }
    if (type == ClosureType::kScrew) add(ClosureError::kThread, 2, 1);
  }
  const Part* begin() const { return parts_.data(); }
  const Part* end() const { return parts_.data() + size_; }

 private:
  void add(ClosureError error, int first, int rows) { parts_[size_++] = {error, first, rows}; }
  /// Adds rows with a spring: one part if it is alike along all of them, else one each.
  void add(ClosureError error, int first, int rows, const ClosureSpring& spring) {
    const auto k = spring.stiffness.head(rows), d = spring.damping.head(rows);
    if (!spring.acts || (k.isConstant(k[0], 0.0) && d.isConstant(d[0], 0.0))) {
      if (!spring.acts || k[0] > 0.0 || d[0] > 0.0) add(error, first, rows);
      return;
    }
    for (int i = 0; i < rows; ++i)
      if (k[i] > 0.0 || d[i] > 0.0) add(error, first + i, 1);
  }

  std::array<Part, 6> parts_;
  size_t size_ = 0;
};

/// Error of a closure in the rows of one part, and its acceleration at constant joint velocities.
struct ErrorMotion {
  Vector3 error = Vector3::Zero(), acceleration = Vector3::Zero();
};

/// Finds the rows of one closure.
class ClosureRows {
 public:
  ClosureRows(const Closure& closure, const Pose& X_BC, double h, const Kinematics& data,
              const std::vector<Motion>& A)
      : closure_(closure),
        X_BC_(X_BC),
        h_(h),
        data_(data),
        A_(A),
        a_(data, A, closure.body_a, closure.X_AC),
        b_(data, A, closure.body_b, X_BC),
        apart_(b_.position - a_.position),
        parting_(b_.velocity - a_.velocity),
        curvature_(b_.acceleration - a_.acceleration) {}

  /// Sets everything but the law of a pair; law.rows is set.
  void place(const Part& part, PairConstraint& pair) const {
    pair.body_a = closure_.body_a;
    pair.body_b = closure_.body_b;
    pair.position = acts_at_b(closure_) ? b_.position : Vector3(0.5 * (a_.position + b_.position));
    pair.error = part.error;
    pair.first = part.first;
    pair.law.rows = part.rows;
    pair.soft = spring_of(closure_, pair).acts;
    if (part.error == ClosureError::kThread) pair.lead = -closure_.pitch / (2.0 * M_PI);
    if (part.error == ClosureError::kDistance) {
      const double d = apart_.norm();
      const Vector3 n = d > kNoDirection ? Vector3(apart_ / d) : Vector3::UnitZ();
      const Matrix3 t1_t2_n = frame_from_normal(closure_.rope ? Vector3(-n) : n);
      pair.frame << t1_t2_n.col(2), t1_t2_n.col(0), t1_t2_n.col(1);
    } else if (follows_a(pair)) {
      pair.frame = axes_of_a(closure_, data_);
    }
  }

  ErrorMotion motion(const PairConstraint& pair) const {
    const Vector3 &omega = data_.V[closure_.body_a].angular, &alpha = A_[closure_.body_a].angular;
    const Motion relative = data_.V[closure_.body_b] - data_.V[closure_.body_a];
    const Vector3 turning = A_[closure_.body_b].angular - alpha;
    const auto rows = [&](const Vector3& v) { return along_rows(pair, pair.frame, v); };
    const auto seen = [&](const Vector3& r, const Vector3& u, const Vector3& c) {
      return acceleration_seen(r, u, c, omega, alpha);
    };
    switch (pair.error) {
      case ClosureError::kApart:
        return {apart_, curvature_};
      case ClosureError::kOffset:
        return {rows(apart_), rows(seen(apart_, parting_, curvature_))};
      case ClosureError::kDistance:
        return distance(pair);
      case ClosureError::kTurn:
        if (!pair.soft) return {anchors_turned(closure_, X_BC_, data_), turning};
        return {rows(anchors_turned(closure_, X_BC_, data_)),
                rows(turning - omega.cross(relative.angular))};
      case ClosureError::kAxis: {
        const Vector3 z = axes_of_b(closure_, X_BC_, data_).col(2), of_a = pair.frame.col(2);
        const Vector3& spin = data_.V[closure_.body_b].angular;
        const Vector3 u = spin.cross(z);
        const Vector3 c = A_[closure_.body_b].angular.cross(z) + spin.cross(u);
        return {rows(of_a.cross(z)), rows(of_a.cross(seen(z, u, c)))};
      }
      case ClosureError::kThread:
        return {error_of(closure_, X_BC_, pair, data_),
                rows(seen(apart_, parting_, curvature_) +
                     pair.lead * (turning - omega.cross(relative.angular)))};
    }
    return {};
  }

 private:
  ErrorMotion distance(const PairConstraint& pair) const {
    const double d = apart_.norm(), sign = closure_.rope ? -1.0 : 1.0;
    const Vector3 n = sign * pair.frame.col(0);
    ErrorMotion out;
    out.error[0] = sign * (d - closure_.length);
    if (closure_.rope || pair.soft) {
      const double bend = bend_of_distance(h_, n, apart_, parting_, curvature_);
      out.acceleration[0] = sign * bend * 2.0 / (h_ * h_);
      return out;
    }
    const double along = n.dot(parting_);
    const double turning = d > kNoDirection ? (parting_.squaredNorm() - along * along) / d : 0.0;
    out.acceleration[0] = n.dot(curvature_) + turning;
    return out;
  }

  const Closure& closure_;
  const Pose& X_BC_;
  double h_;
  const Kinematics& data_;
  const std::vector<Motion>& A_;
  Anchor a_, b_;
  Vector3 apart_, parting_, curvature_;
};

}  // namespace

bool acts_at_b(const Closure& closure) {
  if (closure.type == ClosureType::kDistance) return false;
  return !holds_point(closure.type) || closure.linear.acts;
}

const ClosureSpring& spring_of(const Closure& closure, const PairConstraint& pair) {
  return pair.first < 3 ? closure.linear : closure.angular;
}

double spring_damping(const Closure& closure, const PairConstraint& pair, double h) {
  const ClosureSpring& spring = spring_of(closure, pair);
  return spring.damping[pair.first % 3] + h * spring.stiffness[pair.first % 3];
}

double error_share(const Closure& closure, const PairConstraint& pair, double h) {
  if (!pair.soft) return 1.0;
  return h * spring_of(closure, pair).stiffness[pair.first % 3] / spring_damping(closure, pair, h);
}

bool follows_a(const PairConstraint& pair) {
  return pair.error == ClosureError::kOffset || pair.error == ClosureError::kAxis ||
         pair.error == ClosureError::kThread || (pair.error == ClosureError::kTurn && pair.soft);
}

void find_closures(const StepContext& at, const Kinematics& data, const InverseWeights& weights,
                   SleepMask idle, std::vector<Motion>& acceleration, ConstraintSet& out) {
  const double h = at.h();
  bool first = true;
  for (size_t i = 0; i < at.model.closures().size(); ++i) {
    const Closure& closure = at.model.closures()[i];
    if ((idle(closure.body_a) && idle(closure.body_b)) || !closure.acts(at.z)) continue;
    if (first) compute_velocity_accelerations(at.model, data, acceleration);
    first = false;
    const ActingClosure acting{static_cast<int>(i), closure.anchor_b(at.z)};
    const ClosureRows rows(closure, acting.X_BC, h, data, acceleration);
    for (const Part& part : Parts(closure)) {
      const double alpha = part.first < 3 ? weights.closure[i].linear : weights.closure[i].angular;
      if (!(alpha > 0.0)) continue;  // the bodies cannot move in these directions
      PairConstraint pair;
      rows.place(part, pair);
      const auto [error, bend] = rows.motion(pair);
      const double share = error_share(closure, pair, h);
      pair.law = make_closure_law(at.options.contact, h, alpha, part.rows, error, bend);
      if (pair.soft) set_spring(h, spring_damping(closure, pair, h), share, error, bend, pair.law);
      if (closure.rope) set_rope(h, alpha, share, error[0], bend[0], pair.law);
      out.pairs.push_back(pair);
      out.closures.push_back(acting);
    }
  }
}

void aim_closure(const Model& model, const ActingClosure& acting, const ContactOptions& options,
                 double h, const Kinematics& data, const Kinematics& reached,
                 const std::vector<Motion>& V, PairConstraint& pair) {
  const Closure& closure = model.closures()[acting.index];
  const Vector3 error = error_of(closure, acting.X_BC, pair, data);
  const contact::Rows y = relative_velocity(pair, data, V);
  // Change of the error beyond h y.
  Vector3 bend = error_of(closure, acting.X_BC, pair, reached) - error;
  for (int i = 0; i < pair.law.rows; ++i) bend[i] -= h * y[i];
  if (pair.error == ClosureError::kThread) bend[0] = std::remainder(bend[0], closure.pitch);
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
