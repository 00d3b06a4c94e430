#include "counterpoint/engine/constraints.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/contact_law.h"

namespace counterpoint {
namespace {

/// Radius [m] about the geometry frame's origin that holds the whole shape.
double bounding_radius(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kPlane:
      return 0.0;
    case ShapeType::kSphere:
      return shape.size.x();
    case ShapeType::kBox:
      return shape.size.norm();
    case ShapeType::kCapsule:
      return shape.size.x() + shape.size.y();
    case ShapeType::kCylinder:
      return std::hypot(shape.size.x(), shape.size.y());
    case ShapeType::kConvexMesh: {
      double radius = 0.0;
      for (const Vector3& v : shape.mesh->vertices) radius = std::max(radius, v.norm());
      return radius;
    }
  }
  return 0.0;
}

std::vector<double> body_radii(const Model& model) {
  std::vector<double> radius(model.num_bodies(), 0.0);
  for (const Geometry& g : model.geometries())
    radius[g.body] = std::max(radius[g.body], g.X_BG.translation.norm() + bounding_radius(g.shape));
  return radius;
}

/// Share of the rotational inverse inertia, times the square of the body's radius, that counts: it
/// stands in where the centre of mass cannot move, as of a wheel on its axle. Compact free bodies
/// stay at 1 / m; a slender one, which spins easily about its length, does not (docs/decisions.md).
constexpr double kRotationShare = 0.1;

std::vector<double> contact_weights(const InverseWeights& weights,
                                    const std::vector<double>& radius) {
  std::vector<double> out(radius.size(), 0.0);
  for (size_t b = 0; b < out.size(); ++b)
    out[b] =
        std::max(weights.body[b], kRotationShare * weights.rotational[b] * radius[b] * radius[b]);
  return out;
}

/// Distance [rad or m] within which a joint limit gets a row, at rest: wide, since a row is cheap
/// and a limit missed for one step is overrun.
constexpr double kLimitMargin = 0.1;

void find_limits(const Model& model, const SimulationOptions& options, const VectorRef& q,
                 const VectorRef& v, const InverseWeights& weights, ConstraintSet& out) {
  const double h = options.time_step;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (joint_nv(body.joint_type) != 1) continue;
    const JointInfo& joint = model.joint(i - 1);
    const double gaps[2] = {q[body.q_index] - joint.lower, joint.upper - q[body.q_index]};
    for (int side = 0; side < 2; ++side) {
      if (!(gaps[side] < kLimitMargin + 2.0 * h * std::abs(v[body.v_index]))) continue;
      JointConstraint row;
      row.law = make_limit_law(options.contact, h, weights.dof[body.v_index], gaps[side]);
      row.v_index[0] = body.v_index;
      row.coefficient[0] = side == 0 ? 1.0 : -1.0;
      out.joints.push_back(row);
    }
  }
}

void find_mimics(const Model& model, const SimulationOptions& options, const VectorRef& q,
                 const InverseWeights& weights, ConstraintSet& out) {
  for (const Mimic& mimic : model.mimics()) {
    const Body& follower = model.body(mimic.joint + 1);
    const Body& master = model.body(mimic.master + 1);
    const double error = q[follower.q_index] - mimic.multiplier * q[master.q_index] - mimic.offset;
    const double alpha = weights.dof[follower.v_index] +
                         mimic.multiplier * mimic.multiplier * weights.dof[master.v_index];
    JointConstraint row;
    row.law = make_equality_law(options.contact, options.time_step, alpha, error);
    row.v_index[0] = follower.v_index;
    row.v_index[1] = master.v_index;
    row.coefficient[1] = -mimic.multiplier;
    out.joints.push_back(row);
  }
}

}  // namespace

ConstraintFinder::ConstraintFinder(const Model& model, InverseWeights weights)
    : weights_(std::move(weights)),
      collider_(model),
      radius_(body_radii(model)),
      margin_(model.num_bodies(), 0.0) {
  contact_weight_ = contact_weights(weights_, radius_);
}

void ConstraintFinder::find(const Model& model, const SimulationOptions& options,
                            const VectorRef& q, const VectorRef& v, const Data& data,
                            ConstraintSet& out) {
  out.contacts.clear();
  out.joints.clear();
  out.max_penetration = 0.0;
  find_contacts(model, options, data, out);
  find_limits(model, options, q, v, weights_, out);
  find_mimics(model, options, q, weights_, out);
}

void ConstraintFinder::find_contacts(const Model& model, const SimulationOptions& options,
                                     const Data& data, ConstraintSet& out) {
  const double h = options.time_step;
  // What a body can travel within the step, on top of half the margin each.
  const double fall = h * h * model.gravity().norm();
  for (int b = 0; b < model.num_bodies(); ++b) {
    const double speed =
        b == 0 ? 0.0 : data.V[b].linear.norm() + data.V[b].angular.norm() * radius_[b];
    margin_[b] = 0.5 * options.contact.margin + h * speed + (b == 0 ? 0.0 : fall);
  }
  collider_.compute_candidates(data.X_WB, margin_, candidates_);
  for (const collision::Candidate& candidate : candidates_) {
    const Geometry& a = model.geometries()[candidate.geometry_a];
    const Geometry& b = model.geometries()[candidate.geometry_b];
    const double alpha = contact_weight_[a.body] + contact_weight_[b.body];
    if (!(alpha > 0.0)) continue;  // neither side can move, in any way
    ContactConstraint contact;
    contact.candidate = candidate;
    contact.body_a = a.body;
    contact.body_b = b.body;
    const Matrix3 t1_t2_n = frame_from_normal(candidate.normal);
    contact.frame << t1_t2_n.col(2), t1_t2_n.col(0), t1_t2_n.col(1);
    contact.law.rows = 3;
    const Vector3 v = contact_velocity(contact, data, data.V);
    contact.law = make_contact_law(options.contact, h, combine_materials(a.material, b.material),
                                   alpha, candidate.gap, v);
    out.max_penetration = std::max(out.max_penetration, -candidate.gap);
    out.contacts.push_back(contact);
  }
}

contact::Rows contact_velocity(const ContactConstraint& contact, const Data& data,
                               const std::vector<Motion>& V) {
  Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();
  const Vector3& p = contact.candidate.position;
  const bool turning = contact.law.rows > 3;
  if (contact.body_a != 0) {
    linear -= V[contact.body_a].at(p - data.X_WB[contact.body_a].translation);
    if (turning) angular -= V[contact.body_a].angular;
  }
  if (contact.body_b != 0) {
    linear += V[contact.body_b].at(p - data.X_WB[contact.body_b].translation);
    if (turning) angular += V[contact.body_b].angular;
  }
  const Vector3 v = contact.frame.transpose() * linear;
  const Vector3 w = contact.frame.transpose() * angular;
  contact::Rows rows(contact.law.rows);
  for (int i = 0; i < contact.law.rows; ++i) rows[i] = i < 3 ? v[i] : w[i - 3];
  return rows;
}

}  // namespace counterpoint
