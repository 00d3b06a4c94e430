#include "live/inputs/hand.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace counterpoint::live {
namespace {

/// Natural frequency of the spring with the mass of the held tree [rad/s]; it is critically damped.
constexpr double kFrequency = 10.0;
/// Largest force over the tree's weight; largest torque over that weight times kLever [m].
constexpr double kMostWeights = 20.0, kLever = 0.2;
/// Steps after which the mobility is computed again.
constexpr int kMobilityAge = 8;

Vector3 limited(const Vector3& x, double most) {
  const double size = x.norm();
  return size > most ? Vector3(x * (most / size)) : x;
}

}  // namespace

std::vector<int> link_frames(const Model& model) {
  std::vector<int> out = {-1};
  for (const JointInfo& joint : model.joints()) out.push_back(model.find_frame(joint.link));
  return out;
}

Hand::Hand(const Model& model)
    : model_(model),
      dynamics_(model),
      frame_(link_frames(model)),
      zero_(VectorX::Zero(model.nv())) {}

void Hand::hold(int body) {
  if (body <= 0 || body >= model_.num_bodies())
    throw InputError("message: 'body': there is no such body that can move");
  if (body != body_) age_ = kMobilityAge;
  body_ = body;
  const Tree& tree = model_.trees()[model_.body(body).tree];
  mass_ = 0.0;
  for (int b = tree.body_begin; b < tree.body_end; ++b) mass_ += model_.body(b).inertia.mass;
}

void Hand::drag(int body, const Vector3& point, const Vector3& target) {
  hold(body);
  turns_ = false;
  point_ = point;
  target_ = target;
}

void Hand::turn(int body, const Vector3& torque) {
  hold(body);
  turns_ = true;
  point_ = model_.body(body).inertia.center;
  target_ = torque;
}

/// Returns the largest eigenvalue of J M^-1 J' at the held point [1/kg], without constraints.
double Hand::mobility(const State& state, const Vector3& arm) {
  dynamics_.set_state(state.q, state.v);
  dynamics_.frame_jacobian(frame_[body_], jacobian_);
  Matrix3 cross;
  cross << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
  const MatrixX J = jacobian_.bottomRows<3>() - cross * jacobian_.topRows<3>();
  rest_.resize(model_.nv());
  push_.resize(model_.nv());
  if (!dynamics_.forward_dynamics(zero_, model_.armature(), rest_)) return 0.0;
  Matrix3 inverse_mass;
  for (int i = 0; i < 3; ++i) {
    tau_ = J.row(i).transpose();
    if (!dynamics_.forward_dynamics(tau_, model_.armature(), push_)) return 0.0;
    inverse_mass.col(i) = J * (push_ - rest_);
  }
  const Matrix3 symmetric = 0.5 * (inverse_mass + inverse_mass.transpose());
  return std::max(Eigen::SelfAdjointEigenSolver<Matrix3>(symmetric).eigenvalues()[2], 0.0);
}

/// The spring is taken at the end of the step, for a point that moves freely with the largest
/// mobility a:
///
///   F = (k (target - x - h v) - d v) / (1 + a h (d + h k)),
///
/// which is stable for any mass and step, where k and d alone would throw light links about.
void Hand::update(const State& state, double h) {
  wrench_ = Force();
  force_ = Vector3::Zero();
  if (body_ == 0) return;
  dynamics_.set_state(state.q, state.v);
  const FrameMotion at = dynamics_.frame(frame_[body_]);
  const Vector3 arm = at.X_WF.rotation * point_;
  point_W_ = at.X_WF.translation + arm;
  const double weight = mass_ * kStandardGravity;
  if (turns_) {
    force_ = limited(target_, kMostWeights * weight * kLever);
    wrench_ = {force_, Vector3::Zero()};
    return;
  }
  if (++age_ > kMobilityAge) {
    age_ = 0;
    mobility_ = mobility(state, arm);
  }
  const Vector3 velocity = at.velocity + at.angular_velocity.cross(arm);
  const double k = mass_ * kFrequency * kFrequency, d = 2.0 * mass_ * kFrequency;
  const Vector3 wanted = k * (target_ - point_W_ - h * velocity) - d * velocity;
  force_ = limited(wanted / (1.0 + mobility_ * h * (d + h * k)), kMostWeights * weight);
  wrench_ = {arm.cross(force_), force_};
}

}  // namespace counterpoint::live
