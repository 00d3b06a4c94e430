#include "counterpoint/engine/estimate/sensors/sensor_rows.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/derivatives/dynamics/right_jacobian.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/terms/kinematic_terms.h"

namespace counterpoint::estimation {
namespace {

/// Step of differences by constants [m, rad, unit of the reading]: specific forces, of round-off
/// 1e-16 / h^2, keep six digits at h = 1 ms.
constexpr double kConstantStep = 1e-4;

Quaternion quaternion_of(const Reading& reading) {
  return {reading[0], reading[1], reading[2], reading[3]};
}

void reserve(Eigen::Index rows, Eigen::Index columns, Eigen::Index constants, WeightedRows& out) {
  out.residual.setZero(rows);
  out.term.assign(static_cast<std::size_t>(rows), 0);
  out.by_frames.setZero(rows, columns);
  out.by_constants.setZero(rows, constants);
}

}  // namespace

bool is_position(SensorKind kind) {
  return kind == SensorKind::kPoint || kind == SensorKind::kOrientation ||
         kind == SensorKind::kCoordinate;
}

bool is_force(SensorKind kind) {
  return kind == SensorKind::kContactForce || kind == SensorKind::kJointForce || is_wrench(kind);
}

bool is_wrench(SensorKind kind) {
  return kind == SensorKind::kLinkForce || kind == SensorKind::kLinkTorque;
}

double read_time(const SensorFrames& frames, int t, const SensorTerm& term) {
  const double unknown = term.delay_constant >= 0 ? frames.constants[term.delay_constant] : 0.0;
  return frames.start + t * frames.h + term.delay + unknown;
}

SensorPlace place_of(const SensorTerm& term, const SensorFrames& frames) {
  SensorPlace out{term.sensor.point, term.sensor.axes};
  if (term.position_constant >= 0)
    out.point += out.axes * frames.constants.segment<3>(term.position_constant);
  if (term.rotation_constant >= 0) {
    const Vector3 turn = frames.constants.segment<3>(term.rotation_constant);
    out.axes = out.axes * quaternion_exp(turn).toRotationMatrix();
  }
  return out;
}

double factor_of(const SensorTerm& term, const SensorFrames& frames) {
  return term.scale_constant >= 0 ? 1.0 + frames.constants[term.scale_constant] : 1.0;
}

Vector3 reading_of(const SensorTerm& term, const SensorFrames& frames, const Vector3& value) {
  Vector3 out = factor_of(term, frames) * value;
  if (term.offset_constant < 0) return out;
  const int size = error_size(term.sensor.kind);
  out.head(size) += frames.constants.segment(term.offset_constant, size);
  return out;
}

void difference_constants(const SensorTerm& term, const SensorFrames& frames,
                          const ResidualOfConstants& residual, Eigen::Ref<MatrixX> out) {
  VectorX constants = frames.constants;
  const SensorFrames changed{frames.q, constants, frames.start, frames.h};
  const auto add = [&](int first, int count, double step) {
    for (int k = first; first >= 0 && k < first + count; ++k) {
      const double at = constants[k];
      Vector3 ahead, back;
      constants[k] = at + step;
      bool known = residual(changed, ahead);
      constants[k] = at - step;
      known = residual(changed, back) && known;
      constants[k] = at;
      if (known) out.col(k) = (ahead - back).head(out.rows()) / (2.0 * step);
    }
  };
  add(term.delay_constant, 1, 0.5 * frames.h);
  add(term.offset_constant, error_size(term.sensor.kind), kConstantStep);
  add(term.scale_constant, 1, kConstantStep);
  add(term.position_constant, 3, kConstantStep);
  add(term.rotation_constant, 3, kConstantStep);
}

SensorRows::SensorRows(const Model& model, const std::vector<SensorTerm>& terms, int constants)
    : terms_(&terms), gravity_(model.gravity()) {
  Eigen::Index frame = 0, motion = 0;
  for (const SensorTerm& term : terms) {
    if (is_position(term.sensor.kind))
      frame += error_size(term.sensor.kind);
    else if (!is_force(term.sensor.kind))
      motion += error_size(term.sensor.kind);
  }
  moving_ = motion > 0;
  for (int i = 0; i < 3 && !terms.empty(); ++i) poses_.emplace_back(model);
  reserve(frame, model.nv(), constants, of_frame_);
  reserve(motion, 3 * model.nv(), constants, of_motion_);
  point_.resize(3, model.nv());
  angular_.resize(3, model.nv());
}

void SensorRows::set_poses(const Model& model, const SensorFrames& frames, int t) {
  const int last = static_cast<int>(frames.q.size()) - 1;
  for (int i = moving_ ? 0 : 1; i < (moving_ ? 3 : 2); ++i) {
    const int at = std::clamp(t - 1 + i, 0, last);
    compute_poses(model, frames.q[static_cast<std::size_t>(at)],
                  poses_[static_cast<std::size_t>(i)]);
  }
}

void SensorRows::evaluate(const Model& model, const SensorFrames& frames, int t, bool derivatives) {
  of_frame_.size = of_motion_.size = 0;
  if (terms_->empty()) return;
  set_poses(model, frames, t);
  const bool inner = t > 0 && t + 1 < static_cast<int>(frames.q.size());
  for (std::size_t k = 0; k < terms_->size(); ++k) {
    const SensorKind kind = (*terms_)[k].sensor.kind;
    if (!is_force(kind) && (inner || is_position(kind)))
      add(model, frames, t, static_cast<int>(k), derivatives);
  }
}

void SensorRows::add(const Model& model, const SensorFrames& frames, int t, int index,
                     bool derivatives) {
  const SensorTerm& term = (*terms_)[static_cast<std::size_t>(index)];
  const double time = read_time(frames, t, term);
  Reading reading;
  if (!term.signal.read_frame(time, frames.h, reading)) return;
  const bool alone = is_position(term.sensor.kind);
  WeightedRows& out = alone ? of_frame_ : of_motion_;
  const int size = error_size(term.sensor.kind), at = out.size;
  const Vector3 error = residual(frames, t, term, reading);
  out.residual.segment(at, size) = term.weight * error.head(size);
  std::fill_n(out.term.begin() + at, size, index);
  out.size += size;
  if (!derivatives) return;
  auto J = out.by_frames.middleRows(at, size);
  J.setZero();
  differentiate(model, frames, term, error, J);
  J *= term.weight;
  auto constants = out.by_constants.middleRows(at, size);
  constants.setZero();
  const auto weighted = [&](const SensorFrames& changed, Vector3& value) {
    if (!term.signal.read_frame(read_time(changed, t, term), changed.h, reading)) return false;
    value = term.weight * residual(changed, t, term, reading);
    return true;
  };
  difference_constants(term, frames, weighted, constants);
}

Vector3 SensorRows::residual(const SensorFrames& frames, int t, const SensorTerm& term,
                             const Reading& reading) const {
  const Sensor& s = term.sensor;
  const SensorPlace place = place_of(term, frames);
  const Matrix3& R = poses_[1].X_WB[s.body].rotation;
  Vector3 value = Vector3::Zero();
  switch (s.kind) {
    case SensorKind::kPoint:
      value = optimization::point_position(poses_[1], s.body, place.point);
      break;
    case SensorKind::kOrientation:
      return quaternion_log(quaternion_of(reading).conjugate() * Quaternion(R * place.axes));
    case SensorKind::kCoordinate:
      value[0] = frames.q[static_cast<std::size_t>(t)][s.position];
      break;
    case SensorKind::kAngularVelocity: {
      const Matrix3 turn = poses_[0].X_WB[s.body].rotation.transpose() * R;
      value = place.axes.transpose() * quaternion_log(Quaternion(turn)) / frames.h;
      break;
    }
    default:
      value = place.axes.transpose() * R.transpose() * acceleration(frames.h, s.body, place.point);
  }
  return reading_of(term, frames, value) - reading.head<3>();
}

/// Acceleration of a point of a body minus gravity, in W [m/s^2].
Vector3 SensorRows::acceleration(double h, int body, const Vector3& point) const {
  const auto at = [&](int i) {
    return optimization::point_position(poses_[static_cast<std::size_t>(i)], body, point);
  };
  return (at(2) - 2.0 * at(1) + at(0)) / (h * h) - gravity_;
}

void SensorRows::differentiate(const Model& model, const SensorFrames& frames,
                               const SensorTerm& term, const Vector3& error,
                               Eigen::Ref<MatrixX> out) {
  const int nv = model.nv(), body = term.sensor.body;
  const double h = frames.h;
  const SensorPlace place = place_of(term, frames);
  const Matrix3& R = poses_[1].X_WB[body].rotation;
  switch (term.sensor.kind) {
    case SensorKind::kCoordinate:
      out(0, term.sensor.coordinate) = 1.0;
      break;
    case SensorKind::kPoint:
      optimization::point_jacobian(model, poses_[1], body,
                                   optimization::point_position(poses_[1], body, place.point), out);
      break;
    case SensorKind::kOrientation:
      optimization::angular_jacobian(model, poses_[1], body, angular_);
      out = right_jacobian(error).inverse() * (R * place.axes).transpose() * angular_;
      break;
    case SensorKind::kAngularVelocity: {
      const Matrix3& before = poses_[0].X_WB[body].rotation;
      const Vector3 turn = quaternion_log(Quaternion(Matrix3(before.transpose() * R)));
      const Matrix3 inverse = right_jacobian(turn).inverse(), to_sensor = place.axes.transpose();
      optimization::angular_jacobian(model, poses_[1], body, angular_);
      out.middleCols(nv, nv) = to_sensor * inverse * R.transpose() * angular_ / h;
      optimization::angular_jacobian(model, poses_[0], body, angular_);
      out.leftCols(nv) = -to_sensor * inverse.transpose() * before.transpose() * angular_ / h;
      break;
    }
    default: {
      const Matrix3 to_sensor = place.axes.transpose() * R.transpose();
      for (int i = 0; i < 3; ++i) {
        const Kinematics& data = poses_[static_cast<std::size_t>(i)];
        optimization::point_jacobian(model, data, body,
                                     optimization::point_position(data, body, place.point), point_);
        out.middleCols(i * nv, nv) = (i == 1 ? -2.0 : 1.0) / (h * h) * to_sensor * point_;
      }
      optimization::angular_jacobian(model, poses_[1], body, angular_);
      out.middleCols(nv, nv) += to_sensor * skew(acceleration(h, body, place.point)) * angular_;
    }
  }
  if (term.scale_constant >= 0) out *= factor_of(term, frames);
}

}  // namespace counterpoint::estimation
