#include "counterpoint/engine/estimate/sensors/force_sensors.h"

#include <algorithm>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"

namespace counterpoint::estimation {
namespace {

/// Sum of the contact forces on some bodies, in W [N].
Vector3 force_on(const Model& model, const std::vector<int>& bodies, const Inverse& inverse) {
  const auto has = [&](int geometry) {
    const int body = model.geometries()[static_cast<std::size_t>(geometry)].body;
    return std::find(bodies.begin(), bodies.end(), body) != bodies.end();
  };
  Vector3 sum = Vector3::Zero();
  for (const ContactForce& one : inverse.contacts) sum += sign_on(one, has) * one.force;
  return sum;
}

/// Force, or moment about the sensor's point, that a link receives from its parent through the
/// joint, in the sensor's axes [N, N m].
Vector3 wrench_through(const Data& data, const JointWrenches& joints, const Sensor& sensor,
                       const SensorPlace& place) {
  const Pose& link = data.X_WB[static_cast<std::size_t>(sensor.body)];
  const Force wrench = seen_from(joints.of(sensor.body), link.translation,
                                 {link.rotation * place.axes, link * place.point});
  return sensor.kind == SensorKind::kLinkForce ? wrench.force : wrench.torque;
}

}  // namespace

ForceSensors::ForceSensors(const std::vector<SensorTerm>& terms) : terms_(&terms) {
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const SensorKind kind = terms[k].sensor.kind;
    if (!is_force(kind)) continue;
    any_wrenches_ = any_wrenches_ || is_wrench(kind);
    any_differences_ = any_differences_ || kind != SensorKind::kJointForce;
    term_of_row_.insert(term_of_row_.end(), static_cast<std::size_t>(error_size(kind)),
                        static_cast<int>(k));
  }
}

void ForceSensors::compute_joint_wrenches(const Model& model, const SensorFrames& frames, int t,
                                          const Inverse& inverse) {
  if (!data_) data_.emplace(model);
  if (!joints_) joints_.emplace(model);
  const auto i = static_cast<std::size_t>(t);
  VectorX v(model.nv()), w(model.nv()), tau(model.nv());
  configuration_difference(model, frames.q[i - 1], frames.q[i], v);
  configuration_difference(model, frames.q[i], frames.q[i + 1], w);
  compute_poses(model, frames.q[i], *data_);
  compute_velocities(model, v / frames.h, *data_);
  rnea(model, (w - v) / (frames.h * frames.h), model.gravity(), *data_, tau);
  joints_->compute(model, *data_, data_->F, inverse);
}

void ForceSensors::evaluate(const Model& model, const SensorFrames& frames, int t,
                            const Inverse& inverse, VectorX& out) {
  if (any_wrenches_) compute_joint_wrenches(model, frames, t, inverse);
  out.setZero(static_cast<Eigen::Index>(term_of_row_.size()));
  Eigen::Index at = 0;
  Vector3 error;
  for (const SensorTerm& term : *terms_) {
    if (!is_force(term.sensor.kind)) continue;
    const int size = error_size(term.sensor.kind);
    if (residual(model, frames, t, inverse, term, error)) out.segment(at, size) = error.head(size);
    at += size;
  }
}

bool ForceSensors::residual(const Model& model, const SensorFrames& frames, int t,
                            const Inverse& inverse, const SensorTerm& term, Vector3& out) const {
  Reading reading;
  if (!term.signal.read_frame(read_time(frames, t, term), frames.h, reading)) return false;
  Vector3 value = Vector3::Zero();
  if (term.sensor.kind == SensorKind::kContactForce)
    value = force_on(model, term.sensor.bodies, inverse);
  else if (is_wrench(term.sensor.kind))
    value = wrench_through(*data_, *joints_, term.sensor, place_of(term, frames));
  else
    value[0] = inverse.applied_force[term.sensor.coordinate];
  out = term.weight * (reading_of(term, frames, value) - reading.head<3>());
  return true;
}

void ForceSensors::add_joints(const SensorFrames& frames, const MatrixX& force,
                              MatrixX& out) const {
  for (std::size_t row = 0; row < term_of_row_.size(); ++row) {
    const SensorTerm& term = (*terms_)[static_cast<std::size_t>(term_of_row_[row])];
    if (term.sensor.kind != SensorKind::kJointForce) continue;
    out.row(static_cast<Eigen::Index>(row)) +=
        term.weight * factor_of(term, frames) * force.row(term.sensor.coordinate);
  }
}

void ForceSensors::differentiate_constants(const Model& model, const SensorFrames& frames, int t,
                                           const Inverse& inverse, Eigen::Ref<MatrixX> out) const {
  Eigen::Index at = 0;
  for (const SensorTerm& term : *terms_) {
    if (!is_force(term.sensor.kind)) continue;
    const int size = error_size(term.sensor.kind);
    const auto weighted = [&](const SensorFrames& changed, Vector3& value) {
      return residual(model, changed, t, inverse, term, value);
    };
    difference_constants(term, frames, weighted, out.middleRows(at, size));
    at += size;
  }
}

}  // namespace counterpoint::estimation
