#include <algorithm>
#include <cmath>
#include <tuple>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

std::vector<RememberedForce> memory_of(const Model& model, const VectorX& q,
                                       const Inverse& inverse) {
  Data data(model);
  compute_poses(model, q, data);
  std::vector<RememberedForce> memory;
  for (const ContactForce& contact : inverse.contacts) {
    RememberedForce own;
    own.a = contact.contact.geometry_a;
    own.b = contact.contact.geometry_b;
    const int body_b = model.geometries()[own.b].body;
    const Pose& X_WB = data.X_WB[body_b != 0 ? body_b : model.geometries()[own.a].body];
    own.at = X_WB.rotation.transpose() * (contact.contact.position - X_WB.translation);
    own.force = contact.force;
    memory.push_back(own);
  }
  std::stable_sort(memory.begin(), memory.end(), [](const auto& x, const auto& y) {
    return std::tie(x.a, x.b) < std::tie(y.a, y.b);
  });
  return memory;
}

Verifier::Verifier(const Model& model, const SimulationOptions& options,
                   const std::vector<char>& motors)
    : model_(&model),
      options_(options),
      workspace_(model),
      unactuated_(unactuated_weights(model, motors)),
      weight_(scene_weight(model)) {}

const Inverse& Verifier::add_step(const VectorX& q, const VectorX& v, const VectorX& q_next,
                                  const VectorX& v_next, Verification& out) {
  step_inverse(*model_, options_, q, v, v_next, workspace_, inverse_);
  ++steps_;
  check_forces(out);
  check_contacts(q, v_next, out);
  check_forward(q, v, q_next, out);
  return inverse_;
}

void Verifier::check_forces(Verification& out) {
  const double largest =
      unactuated_.size() > 0
          ? inverse_.applied_force.cwiseProduct(unactuated_).lpNorm<Eigen::Infinity>()
          : 0.0;
  out.unactuated_max = std::max(out.unactuated_max, largest);
  out.unactuated_mean += (largest - out.unactuated_mean) / steps_;
  for (int i = 1; i < model_->num_bodies(); ++i) {
    const Body& body = model_->body(i);
    const JointInfo& joint = model_->joint(i - 1);
    if (!joint.actuated || !std::isfinite(joint.effort_limit) || !(joint.effort_limit > 0.0))
      continue;
    for (int k = 0; k < joint_nv(body.joint_type); ++k)
      out.effort_max = std::max(
          out.effort_max, std::abs(inverse_.applied_force[body.v_index + k]) / joint.effort_limit);
  }
}

void Verifier::check_contacts(const VectorX& q, const VectorX& v_next, Verification& out) {
  Data data(*model_);
  compute_poses(*model_, q, data);
  std::vector<Motion> V(static_cast<std::size_t>(model_->num_bodies()));
  compute_body_velocities(*model_, v_next, data, V);
  loaded_before_.swap(loaded_);
  loaded_.clear();
  for (const ContactForce& c : inverse_.contacts) {
    const Geometry& a = model_->geometries()[c.contact.geometry_a];
    const Geometry& b = model_->geometries()[c.contact.geometry_b];
    const double normal = c.force.dot(c.contact.normal);
    const double tangential = (c.force - normal * c.contact.normal).norm();
    const double mu =
        model_->pair_material(c.contact.geometry_a, c.contact.geometry_b).most_friction();
    out.cone_violation_max =
        std::max({out.cone_violation_max, (tangential - mu * normal) / weight_, -normal / weight_});
    out.contact_force_max = std::max(out.contact_force_max, normal / weight_);
    out.overlap_max = std::max(out.overlap_max, -c.contact.gap);
    if (normal < kLoaded * weight_) continue;
    Vector3 slip = Vector3::Zero();
    if (b.body != 0) slip += V[b.body].at(c.contact.position - data.X_WB[b.body].translation);
    if (a.body != 0) slip -= V[a.body].at(c.contact.position - data.X_WB[a.body].translation);
    slip -= slip.dot(c.contact.normal) * c.contact.normal;
    const std::pair pair(c.contact.geometry_a, c.contact.geometry_b);
    loaded_.push_back(pair);
    // Contacts under load in the first step count as standing, since the step before is unknown.
    const bool stands = steps_ == 1 || std::find(loaded_before_.begin(), loaded_before_.end(),
                                                 pair) != loaded_before_.end();
    double& largest = stands ? out.stance_slip_max : out.landing_slip_max;
    largest = std::max(largest, options_.time_step * slip.norm());
  }
}

void Verifier::check_forward(const VectorX& q, const VectorX& v, const VectorX& q_next,
                             Verification& out) {
  State state{0.0, q, v, {}, memory_of(*model_, q, inverse_)}, next;
  Input input;
  input.applied_force = inverse_.applied_force;
  const StepReport report =
      step_forward(*model_, options_, contact::Settings(), state, input, workspace_, next);
  if (!report.succeeded() || report.softening.any() || report.taut_links > 0) {
    ++out.forward_failures;
    return;
  }
  VectorX off(model_->nv());
  configuration_difference(*model_, q_next, next.q, off);
  out.forward_check_max = std::max(out.forward_check_max, off.lpNorm<Eigen::Infinity>());
}

Verification verify(const Model& model, const SimulationOptions& options,
                    const std::vector<char>& motors, const std::vector<VectorX>& q,
                    const VectorX& v_0) {
  Verification out;
  Verifier verifier(model, options, motors);
  VectorX v = v_0, v_next(model.nv());
  for (std::size_t t = 0; t + 1 < q.size(); ++t) {
    configuration_difference(model, q[t], q[t + 1], v_next);
    v_next /= options.time_step;
    verifier.add_step(q[t], v, q[t + 1], v_next, out);
    v = v_next;
  }
  return out;
}

}  // namespace counterpoint::optimization
