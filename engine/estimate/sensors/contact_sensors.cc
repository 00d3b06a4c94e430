#include "counterpoint/engine/estimate/sensors/contact_sensors.h"

#include <algorithm>

namespace counterpoint::estimation {
namespace {

/// Sum of the contact forces on some bodies [N].
Vector3 force_on(const Model& model, const std::vector<int>& bodies, const Inverse& inverse) {
  const auto has = [&](int geometry) {
    const int body = model.geometries()[static_cast<std::size_t>(geometry)].body;
    return std::find(bodies.begin(), bodies.end(), body) != bodies.end();
  };
  Vector3 sum = Vector3::Zero();
  for (const ContactForce& one : inverse.contacts)
    sum += ((has(one.contact.geometry_b) ? 1.0 : 0.0) - (has(one.contact.geometry_a) ? 1.0 : 0.0)) *
           one.force;
  return sum;
}

}  // namespace

ContactSensors::ContactSensors(const std::vector<SensorTerm>& terms) : terms_(&terms) {
  for (const SensorTerm& term : terms)
    if (term.sensor.kind == SensorKind::kContactForce) rows_ += 3;
}

void ContactSensors::evaluate(const Model& model, const SensorFrames& frames, int t,
                              const Inverse& inverse, VectorX& out) const {
  out.setZero(rows_);
  Eigen::Index at = 0;
  for (const SensorTerm& term : *terms_) {
    if (term.sensor.kind != SensorKind::kContactForce) continue;
    const double delay =
        term.delay + (term.delay_constant >= 0 ? frames.constants[term.delay_constant] : 0.0);
    Reading reading;
    if (term.signal.read_frame(frames.start + t * frames.h + delay, frames.h, reading)) {
      Vector3 error = force_on(model, term.sensor.bodies, inverse) - reading.head<3>();
      if (term.offset_constant >= 0) error += frames.constants.segment<3>(term.offset_constant);
      out.segment<3>(at) = term.weight * error;
    }
    at += 3;
  }
}

void ContactSensors::differentiate(MatrixX& by_constants) const {
  Eigen::Index at = 0;
  for (const SensorTerm& term : *terms_) {
    if (term.sensor.kind != SensorKind::kContactForce) continue;
    if (term.offset_constant >= 0)
      by_constants.block<3, 3>(at, term.offset_constant).diagonal().setConstant(term.weight);
    at += 3;
  }
}

}  // namespace counterpoint::estimation
