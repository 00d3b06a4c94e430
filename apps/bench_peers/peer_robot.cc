#include "peer_robot.h"

#include <fmt/format.h>

#include <cmath>
#include <random>
#include <stdexcept>

namespace counterpoint::apps {
namespace {

struct Robot {
  const char* urdf;
  bool floating;
};
constexpr Robot kRobots[] = {{"ur5_robot.urdf", false},
                             {"panda.urdf", false},
                             {"solo12.urdf", true},
                             {"simple_humanoid_classical.urdf", true}};

}  // namespace

States random_states(const Model& model) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  States states;
  for (int k = 0; k < kStates; ++k) {
    VectorX q(model.nq()), v(model.nv()), x(model.nv());
    for (double& value : q) value = uniform(generator);
    for (double& value : v) value = uniform(generator);
    for (double& value : x) value = uniform(generator);
    for (int i = 1; i < model.num_bodies(); ++i)
      if (model.body(i).joint_type == JointType::kFloating)
        q.segment<4>(model.body(i).q_index + 3).normalize();
    states.q.push_back(q);
    states.v.push_back(v);
    states.x.push_back(x);
  }
  return states;
}

Pair::Pair(const Model& model, peers::PinocchioRobot& peer) : model_(model), peer_(peer) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const bool floating = model.body(i).joint_type == JointType::kFloating;
    peers::PinocchioJoint joint;
    if (!peer.find_joint(floating ? "" : model.joint(i - 1).name.c_str(), &joint))
      throw std::runtime_error(model.joint(i - 1).name + ": not a joint of Pinocchio's model");
    joints_.push_back(joint);
  }
  if (peer.nv() != model.nv())
    throw std::runtime_error(
        fmt::format("{} velocities here, {} in Pinocchio", model.nv(), peer.nv()));
}

/// Rotation R_WB of the body on a floating joint.
Matrix3 Pair::turn(int i, const VectorX& q) const {
  const double* p = q.data() + model_.body(i).q_index + 3;
  return Quaternion(p[0], p[1], p[2], p[3]).toRotationMatrix();
}
VectorX Pair::coordinates(const VectorX& q) const {
  VectorX out(peer_.nq());
  for (int i = 1; i < model_.num_bodies(); ++i) {
    const double* p = q.data() + model_.body(i).q_index;
    const peers::PinocchioJoint& joint = joints_[static_cast<std::size_t>(i) - 1];
    if (floating(i)) {
      out.segment<7>(joint.q_index) << p[0], p[1], p[2], p[4], p[5], p[6], p[3];
    } else if (joint.nq == 2) {
      out.segment<2>(joint.q_index) << std::cos(p[0]), std::sin(p[0]);
    } else {
      out[joint.q_index] = p[0];
    }
  }
  return out;
}

VectorX Pair::mapped(const VectorX& q, const VectorX& x) const {
  VectorX out(peer_.nv());
  for (int i = 1; i < model_.num_bodies(); ++i) {
    const int k = model_.body(i).v_index, to = joints_[static_cast<std::size_t>(i) - 1].v_index;
    if (floating(i)) {
      out.segment<3>(to) = turn(i, q).transpose() * x.segment<3>(k);
      out.segment<3>(to + 3) = x.segment<3>(k + 3);
    } else {
      out[to] = x[k];
    }
  }
  return out;
}

VectorX Pair::mapped_acceleration(const VectorX& q, const VectorX& v, const VectorX& a) const {
  VectorX out = mapped(q, a);
  const VectorX velocity = mapped(q, v);
  for (int i = 1; i < model_.num_bodies(); ++i) {
    if (!floating(i)) continue;
    const int to = joints_[static_cast<std::size_t>(i) - 1].v_index;
    const Vector3 linear = velocity.segment<3>(to), angular = velocity.segment<3>(to + 3);
    out.segment<3>(to) -= angular.cross(linear);
  }
  return out;
}

void Pair::set_states(const States& states, bool accelerations) {
  VectorX q(kStates * peer_.nq()), v(kStates * peer_.nv()), x(kStates * peer_.nv());
  for (int k = 0; k < kStates; ++k) {
    const auto i = static_cast<std::size_t>(k);
    q.segment(k * peer_.nq(), peer_.nq()) = coordinates(states.q[i]);
    v.segment(k * peer_.nv(), peer_.nv()) = mapped(states.q[i], states.v[i]);
    x.segment(k * peer_.nv(), peer_.nv()) =
        accelerations ? mapped_acceleration(states.q[i], states.v[i], states.x[i])
                      : mapped(states.q[i], states.x[i]);
  }
  peer_.set_states(kStates, q.data(), v.data(), x.data());
}

VectorX Pair::mapped_back(const VectorX& q, const VectorX& x) const {
  VectorX out(model_.nv());
  for (int i = 1; i < model_.num_bodies(); ++i) {
    const int k = model_.body(i).v_index, from = joint(i).v_index;
    if (floating(i)) {
      out.segment<3>(k) = turn(i, q) * x.segment<3>(from);
      out.segment<3>(k + 3) = x.segment<3>(from + 3);
    } else {
      out[k] = x[from];
    }
  }
  return out;
}

std::filesystem::path find_robot(const PeerOptions& options, const std::string& name) {
  std::error_code none;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(options.robots, none))
    if (entry.path().filename() == name) return entry.path();
  fmt::print("Skipped: {} is not below the folder of robots ({}).\n", name,
             options.robots.empty() ? "--robots was not given" : options.robots.string());
  return {};
}

void for_each_robot(
    const char* table, const PeerOptions& options,
    const std::function<void(const Model&, const LoadPinocchio&, const std::string&)>& compare) {
  if (peers::pinocchio_version().empty()) {
    fmt::print("Skipped: {}. Pinocchio was not found when this was built.\n", table);
    return;
  }
  for (const Robot& robot : kRobots) {
    const std::filesystem::path urdf = find_robot(options, robot.urdf);
    if (urdf.empty()) continue;
    SceneOverrides overrides;
    overrides.base = robot.floating ? Base::kFloating : Base::kFixed;
    const Scene scene = load_scene(urdf, overrides);
    const LoadPinocchio load = [&](peers::PinocchioConvention convention) {
      return peers::load_pinocchio(urdf.string(), robot.floating, scene.model.gravity().data(),
                                   convention);
    };
    compare(scene.model, load, urdf.stem().string());
  }
}

}  // namespace counterpoint::apps
