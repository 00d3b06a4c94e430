#include "counterpoint/engine/estimate/sensors/sensor_rows.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/derivatives/dynamics/right_jacobian.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/terms/kinematic_terms.h"

namespace counterpoint::estimation {
namespace {

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
  if (term.sensor.kind == SensorKind::kCoordinate)
    J(0, term.sensor.coordinate) = 1.0;
  else
    differentiate(model, frames.h, term, error, J);
  J *= term.weight;
  auto constants = out.by_constants.middleRows(at, size);
  constants.setZero();
  if (term.offset_constant >= 0)
    constants.middleCols(term.offset_constant, size).diagonal().setConstant(term.weight);
  Reading early, late;
  const double reach = 0.5 * frames.h;
  if (term.delay_constant >= 0 && term.signal.read_frame(time - reach, frames.h, early) &&
      term.signal.read_frame(time + reach, frames.h, late))
    constants.col(term.delay_constant) =
        term.weight / frames.h *
        (residual(frames, t, term, late) - residual(frames, t, term, early)).head(size);
}

Vector3 SensorRows::residual(const SensorFrames& frames, int t, const SensorTerm& term,
                             const Reading& reading) const {
  const Sensor& s = term.sensor;
  Vector3 out = Vector3::Zero();
  switch (s.kind) {
    case SensorKind::kPoint:
      out = optimization::point_position(poses_[1], s.body, s.point) - reading.head<3>();
      break;
    case SensorKind::kOrientation:
      return quaternion_log(quaternion_of(reading).conjugate() *
                            Quaternion(poses_[1].X_WB[s.body].rotation * s.axes));
    case SensorKind::kCoordinate:
      out[0] = frames.q[static_cast<std::size_t>(t)][s.position] - reading[0];
      break;
    case SensorKind::kAngularVelocity: {
      const Matrix3& R = poses_[1].X_WB[s.body].rotation;
      const Matrix3 turn = poses_[0].X_WB[s.body].rotation.transpose() * R;
      out = s.axes.transpose() * quaternion_log(Quaternion(turn)) / frames.h - reading.head<3>();
      break;
    }
    default: {
      out = s.axes.transpose() * poses_[1].X_WB[s.body].rotation.transpose() *
                acceleration(frames.h, s) -
            reading.head<3>();
      break;
    }
  }
  if (term.offset_constant >= 0) {
    const int size = error_size(s.kind);
    out.head(size) += frames.constants.segment(term.offset_constant, size);
  }
  return out;
}

/// Acceleration of the sensor's point minus gravity, in W [m/s^2].
Vector3 SensorRows::acceleration(double h, const Sensor& s) const {
  const auto at = [&](int i) {
    return optimization::point_position(poses_[static_cast<std::size_t>(i)], s.body, s.point);
  };
  return (at(2) - 2.0 * at(1) + at(0)) / (h * h) - gravity_;
}

void SensorRows::differentiate(const Model& model, double h, const SensorTerm& term,
                               const Vector3& error, Eigen::Ref<MatrixX> out) {
  const Sensor& s = term.sensor;
  const int nv = model.nv();
  const Matrix3& R = poses_[1].X_WB[s.body].rotation;
  switch (s.kind) {
    case SensorKind::kPoint:
      optimization::point_jacobian(model, poses_[1], s.body,
                                   optimization::point_position(poses_[1], s.body, s.point), out);
      break;
    case SensorKind::kOrientation:
      optimization::angular_jacobian(model, poses_[1], s.body, angular_);
      out = right_jacobian(error).inverse() * (R * s.axes).transpose() * angular_;
      break;
    case SensorKind::kAngularVelocity: {
      const Matrix3& before = poses_[0].X_WB[s.body].rotation;
      const Vector3 turn = quaternion_log(Quaternion(Matrix3(before.transpose() * R)));
      const Matrix3 inverse = right_jacobian(turn).inverse();
      optimization::angular_jacobian(model, poses_[1], s.body, angular_);
      out.middleCols(nv, nv) = s.axes.transpose() * inverse * R.transpose() * angular_ / h;
      optimization::angular_jacobian(model, poses_[0], s.body, angular_);
      out.leftCols(nv) =
          -s.axes.transpose() * inverse.transpose() * before.transpose() * angular_ / h;
      break;
    }
    default: {
      const Matrix3 to_sensor = s.axes.transpose() * R.transpose();
      for (int i = 0; i < 3; ++i) {
        const Kinematics& data = poses_[static_cast<std::size_t>(i)];
        optimization::point_jacobian(model, data, s.body,
                                     optimization::point_position(data, s.body, s.point), point_);
        out.middleCols(i * nv, nv) = (i == 1 ? -2.0 : 1.0) / (h * h) * to_sensor * point_;
      }
      optimization::angular_jacobian(model, poses_[1], s.body, angular_);
      out.middleCols(nv, nv) += to_sensor * skew(acceleration(h, s)) * angular_;
    }
  }
}

}  // namespace counterpoint::estimation
