#include "counterpoint/engine/dynamics.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

Quaternion read_quaternion(const double* q) { return {q[0], q[1], q[2], q[3]}; }

void rotate(const double* q, const double* w, double h, double* out) {
  Quaternion r = read_quaternion(q) * quaternion_exp(h * Vector3(w[0], w[1], w[2]));
  r.normalize();
  out[0] = r.w();
  out[1] = r.x();
  out[2] = r.y();
  out[3] = r.z();
}

void rotation_difference(const double* from, const double* to, double* w) {
  const Vector3 r = quaternion_log(read_quaternion(from).conjugate() * read_quaternion(to));
  for (int i = 0; i < 3; ++i) w[i] = r[i];
}

}  // namespace

void integrate_configuration(const Model& model, const VectorRef& q, const VectorRef& v, double h,
                             BodyRange bodies, VectorOut q_next) {
  for (int b = bodies.begin; b < bodies.end; ++b) {
    const Body& body = model.body(b);
    const double* q_b = q.data() + body.q_index;
    const double* v_b = v.data() + body.v_index;
    double* out = q_next.data() + body.q_index;
    switch (body.joint_type) {
      case JointType::kRevolute:
      case JointType::kPrismatic:
        out[0] = q_b[0] + h * v_b[0];
        break;
      case JointType::kPlanar:
        for (int i = 0; i < 3; ++i) out[i] = q_b[i] + h * v_b[i];
        break;
      case JointType::kSpherical:
        rotate(q_b, v_b, h, out);
        break;
      case JointType::kFloating:
        for (int i = 0; i < 3; ++i) out[i] = q_b[i] + h * v_b[i];
        rotate(q_b + 3, v_b + 3, h, out + 3);
        break;
    }
  }
}

void configuration_difference(const Model& model, const VectorRef& q_from, const VectorRef& q_to,
                              VectorOut v) {
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    const double* from = q_from.data() + body.q_index;
    const double* to = q_to.data() + body.q_index;
    double* out = v.data() + body.v_index;
    switch (body.joint_type) {
      case JointType::kRevolute:
      case JointType::kPrismatic:
        out[0] = to[0] - from[0];
        break;
      case JointType::kPlanar:
        for (int i = 0; i < 3; ++i) out[i] = to[i] - from[i];
        break;
      case JointType::kSpherical:
        rotation_difference(from, to, out);
        break;
      case JointType::kFloating:
        for (int i = 0; i < 3; ++i) out[i] = to[i] - from[i];
        rotation_difference(from + 3, to + 3, out + 3);
        break;
    }
  }
}

}  // namespace counterpoint
