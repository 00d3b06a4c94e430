#include <fmt/format.h>

#include <cmath>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/files/mirror_names.h"
#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {
namespace {

/// Tolerance for mirrored joint axes; larger differences mean that the model is not symmetric.
constexpr double kAxisTolerance = 1e-3;

/// Mirrors a motion vector in y = 0: the angular part is a pseudovector, the linear part a vector.
Motion mirrored(const Motion& m) {
  return {{-m.angular.x(), m.angular.y(), -m.angular.z()},
          {m.linear.x(), -m.linear.y(), m.linear.z()}};
}

double sign_between(const Model& model, const Motion& axis, const Motion& partner, int joint) {
  const Motion image = mirrored(axis);
  const bool turns = axis.angular.squaredNorm() > 0.25;
  const double sign = turns ? image.angular.dot(partner.angular) : image.linear.dot(partner.linear);
  if (std::abs(std::abs(sign) - 1.0) > kAxisTolerance)
    throw InputError(fmt::format(
        "mirror: the axis of joint '{}' is not the mirror image of its partner's in the plane "
        "y = 0 at the scene's pose; let the robot stand along x there",
        model.joint(joint).name));
  return sign > 0.0 ? 1.0 : -1.0;
}

}  // namespace

Mirror make_mirror(const Model& model, const std::string& left, const std::string& right) {
  Data data(model);
  compute_poses(model, model.default_q(), data);
  Mirror mirror;
  mirror.q_index.resize(static_cast<std::size_t>(model.nq()));
  mirror.v_index.resize(static_cast<std::size_t>(model.nv()));
  mirror.q_sign.setOnes(model.nq());
  mirror.v_sign.setOnes(model.nv());
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const std::string name = partner_name(model.joint(i - 1).name, left, right);
    const int other = model.find_joint(name);
    if (other < 0 || model.body(other + 1).joint_type != body.joint_type)
      throw InputError(fmt::format("mirror: joint '{}' has no partner '{}' of its type",
                                   model.joint(i - 1).name, name));
    const Body& partner = model.body(other + 1);
    const int nv = joint_nv(body.joint_type), nq = joint_nq(body.joint_type);
    for (int k = 0; k < nv; ++k) {
      mirror.v_index[static_cast<std::size_t>(body.v_index + k)] = partner.v_index + k;
      mirror.v_sign[body.v_index + k] =
          sign_between(model, data.axis[static_cast<std::size_t>(partner.v_index + k)],
                       data.axis[static_cast<std::size_t>(body.v_index + k)], i - 1);
    }
    for (int k = 0; k < nq; ++k)
      mirror.q_index[static_cast<std::size_t>(body.q_index + k)] = partner.q_index + k;
    // Signs of q are those of v; the real part of a quaternion keeps its sign.
    const int linear = body.joint_type == JointType::kFloating ? 3 : 0;
    const bool quaternion = nq != nv;
    for (int k = 0; k < nq; ++k) {
      const int in_v = quaternion && k >= linear ? k - 1 : k;
      mirror.q_sign[body.q_index + k] =
          quaternion && k == linear ? 1.0 : mirror.v_sign[body.v_index + in_v];
    }
  }
  return mirror;
}

}  // namespace counterpoint::optimization
