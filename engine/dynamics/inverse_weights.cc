#include "counterpoint/engine/dynamics/inverse_weights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

/// Accelerations of the trees of a model, at rest in the default pose, due to joint forces and
/// wrenches.
class Response {
 public:
  Response(const Model& model, Data& data)
      : tau(VectorX::Zero(model.nv())),
        acceleration(tau),
        model_(model),
        data_(data),
        diagonal_(model.armature()) {
    for (int i = 1; i < model.num_bodies(); ++i) {
      const Body& body = model.body(i);
      if (model.joint(i - 1).prescribed)
        diagonal_.segment(body.v_index, joint_nv(body.joint_type)).setConstant(kLockedInertia);
    }
    compute_poses(model, model.default_q(), data);
    compute_velocities(model, tau, data);
    compute_inertias(model, data);
    data.begin();
    // The world does not accelerate; trees are solved one at a time.
    for (Motion& a : data.A) a = Motion();
  }
  ~Response() { data_.has_external = false; }

  VectorX tau;           ///< nv, joint forces
  VectorX acceleration;  ///< nv, valid for the trees solved last

  void push(int body, const Force& f) { data_.external[body] += f; }
  void release(int body) { data_.external[body] = Force(); }

  void move(int tree) {
    if (tree < 0) return;
    const Tree& t = model_.trees()[tree];
    int singular = 0;
    if (aba(model_, tau, diagonal_, Vector3::Zero(), {t.body_begin, t.body_end}, data_,
            acceleration, &singular))
      return;
    throw InputError(
        fmt::format("joint '{}': the inertia it moves is not positive in the default pose; give "
                    "its link '{}' an inertial element "
                    "(or the joint an armature), or go on with more of it: fill_inertia "
                    "(--fill-inertia 1e-3kg), repair_inertias "
                    "(--repair-inertias)",
                    model_.joint(singular - 1).name, model_.joint(singular - 1).link));
  }

 private:
  const Model& model_;
  Data& data_;
  VectorX diagonal_;  ///< nv, added to M: armature, and what locks prescribed joints
};

/// Returns outermost points on the surface of a shape, in the geometry frame.
std::vector<Vector3> outer_points(const Shape& shape) {
  std::vector<Vector3> points;
  const Vector3& size = shape.size;
  switch (shape.type) {
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      break;
    case ShapeType::kSphere:
      for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0})
          points.push_back(side * size.x() * Vector3::Unit(axis));
      break;
    case ShapeType::kBox:
      for (int corner = 0; corner < 8; ++corner) {
        const Vector3 sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
        points.push_back(size.cwiseProduct(sign));
      }
      break;
    case ShapeType::kCapsule:
    case ShapeType::kCylinder:
      for (const double end : {-1.0, 1.0}) {
        constexpr int kRim = 8;
        for (int i = 0; i < kRim; ++i) {
          const double angle = 2.0 * M_PI / kRim * i;
          points.emplace_back(size.x() * std::cos(angle), size.x() * std::sin(angle),
                              end * size.y());
        }
        if (shape.type == ShapeType::kCapsule)
          points.emplace_back(0, 0, end * (size.x() + size.y()));
      }
      break;
    case ShapeType::kConvexMesh:
      points = shape.mesh->vertices;
      break;
  }
  return points;
}

/// Weight of the rotational part: it matters where the centre of mass cannot move, as for a wheel
/// on its axle. Free solids of uniform density, compact, slender or flat, keep 1 / m.
constexpr double kRotationShare = 0.1;

/// Inverse mass [1/kg] of each body at its possible contacts. The translational part is the mean
/// over directions of inv(M) at the centre of mass. A point at x from there adds tr(W (x'x - x x'))
/// / 3, W the rotational response. The result is the larger of the translational part and the
/// weighted rotational part at the point of the body's geometry where it is largest.
std::vector<double> contact_weights(const Model& model, Response& response, const Data& data) {
  std::vector<double> translation(model.num_bodies(), 0.0);
  std::vector<Matrix3> lever(model.num_bodies(), Matrix3::Zero());  // tr(W) 1 - W, in W
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Vector3& center = data.inertia[b].center;
    Matrix3 rotation;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 unit = Vector3::Unit(axis);
      response.push(b, {center.cross(unit), unit});
      response.move(model.body(b).tree);
      translation[b] += data.A[b].at(center)[axis] / 3.0;
      response.release(b);
      response.push(b, {unit, Vector3::Zero()});
      response.move(model.body(b).tree);
      rotation.col(axis) = data.A[b].angular;
      response.release(b);
    }
    lever[b] = rotation.trace() * Matrix3::Identity() - rotation;
  }
  std::vector<double> weight = translation;
  for (const Geometry& g : model.geometries()) {
    if (g.body == 0) continue;
    for (const Vector3& point : outer_points(g.shape)) {
      const Vector3 x = data.X_WB[g.body].rotation * (g.X_BG * point) - data.inertia[g.body].center;
      // Half the trace: this is tr(W) |x|^2 / 3, the mean over directions, if W is isotropic.
      weight[g.body] = std::max(weight[g.body], 0.5 * kRotationShare * x.dot(lever[g.body] * x));
    }
  }
  for (int b = 1; b < model.num_bodies(); ++b)
    if (is_driven(model, b)) weight[b] = 0.0;
  return weight;
}

/// Relative motion below this fraction of the bodies' individual motions is round-off.
constexpr double kImmovable = 1e-10;

/// Acceleration of the anchors of a closure due to wrenches there, averaged over directions and
/// axes.
class ClosurePull {
 public:
  ClosurePull(const Model& model, const Closure& closure, Response& response, const Data& data)
      : response_(response),
        data_(data),
        body_{closure.body_a, closure.body_b},
        tree_{model.body(closure.body_a).tree, model.body(closure.body_b).tree},
        arm_{data.X_WB[closure.body_a].rotation * closure.X_AC.translation,
             data.X_WB[closure.body_b].rotation * closure.X_BC.translation} {}

  /// Applies unit wrenches times a and b at the anchors of A and B; returns the motion of A's
  /// anchor times a plus that of B's times b.
  ClosureWeight mean(double a, double b) {
    const double pull[2] = {a, b};
    ClosureWeight sum;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 unit = Vector3::Unit(axis);
      for (int side = 0; side < 2; ++side)
        response_.push(body_[side], Force{arm_[side].cross(unit), unit} * pull[side]);
      move();
      for (int side = 0; side < 2; ++side)
        sum.linear += pull[side] * data_.A[body_[side]].at(arm_[side])[axis] / 3.0;
      for (int side = 0; side < 2; ++side)
        response_.push(body_[side], Force{unit, Vector3::Zero()} * pull[side]);
      move();
      for (int side = 0; side < 2; ++side)
        sum.angular += pull[side] * data_.A[body_[side]].angular[axis] / 3.0;
    }
    return sum;
  }

 private:
  void move() {
    response_.move(tree_[0]);
    if (tree_[1] != tree_[0]) response_.move(tree_[1]);
    for (const int body : body_) response_.release(body);
  }

  Response& response_;
  const Data& data_;
  int body_[2], tree_[2];
  Vector3 arm_[2];
};

ClosureWeight closure_weight(const Model& model, const Closure& closure, Response& response,
                             const Data& data) {
  ClosurePull pull(model, closure, response, data);
  ClosureWeight weight = pull.mean(-1.0, 1.0);
  const ClosureWeight a = pull.mean(1.0, 0.0), b = pull.mean(0.0, 1.0);
  if (!(weight.linear > kImmovable * (a.linear + b.linear))) weight.linear = 0.0;
  if (!(weight.angular > kImmovable * (a.angular + b.angular))) weight.angular = 0.0;
  if (weight.linear > 0.0 || (holds_angles(closure.type) && weight.angular > 0.0)) return weight;
  throw InputError(fmt::format(
      "closure '{}': at the start its anchors cannot move relative to each other, there is nothing "
      "to hold; remove it, or move its anchors",
      closure.name));
}

}  // namespace

bool is_driven(const Model& model, int body) {
  for (int i = body; i != 0; i = model.body(i).parent)
    if (!model.joint(i - 1).prescribed) return false;
  return true;
}

double tendon_weight(const Tendon& tendon, const Model& model, const std::vector<double>& contact,
                     const VectorX& dof) {
  double sum = 0.0;
  for (const TendonJoint& term : tendon.joints)
    sum += term.coefficient * term.coefficient * dof[model.body(term.joint + 1).v_index];
  for (const int body : path_bodies(tendon)) sum += contact[static_cast<size_t>(body)];
  return sum;
}

InverseWeights compute_inverse_weights(const Model& model, Data& data) {
  InverseWeights weights;
  Response response(model, data);
  weights.contact = contact_weights(model, response, data);
  for (const Closure& closure : model.closures())
    weights.closure.push_back(closure_weight(model, closure, response, data));
  weights.dof = VectorX::Zero(model.nv());
  for (int t = 0; t < model.num_trees(); ++t) {
    for (int j = model.trees()[t].v_begin; j < model.trees()[t].v_end; ++j) {
      response.tau[j] = 1.0;
      response.move(t);
      weights.dof[j] = response.acceleration[j];
      response.tau[j] = 0.0;
    }
  }
  for (const Tendon& tendon : model.tendons())
    weights.tendon.push_back(tendon_weight(tendon, model, weights.contact, weights.dof));
  return weights;
}

}  // namespace counterpoint
