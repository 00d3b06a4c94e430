// The recursive algorithms against Pinocchio's, each from coordinates to result: kinematics and
// whatever else it needs included on both sides.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "counterpoint/engine/aba.h"
#include "counterpoint/engine/crba.h"
#include "counterpoint/engine/kinematics.h"
#include "counterpoint/engine/rnea.h"
#include "counterpoint/model/scene.h"
#include "peers/pinocchio.h"
#include "tables.h"
#include "timing.h"

namespace counterpoint::apps {
namespace {

using peers::PinocchioAlgorithm;
using peers::PinocchioConvention;
using peers::PinocchioJoint;
using peers::PinocchioRobot;

constexpr int kStates =
    64;  ///< gone through in turn: branches and sines differ from one to the next

struct Robot {
  const char* urdf;
  bool floating;
};
constexpr Robot kRobots[] = {{"ur5_robot.urdf", false},
                             {"panda.urdf", false},
                             {"solo12.urdf", true},
                             {"simple_humanoid_classical.urdf", true}};

/// Random coordinates, velocities and accelerations (or forces) in our order.
struct States {
  std::vector<VectorX> q, v, x;
};

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

/// The same robot in both engines, and how their coordinates go together.
class Pair {
 public:
  Pair(const Model& model, PinocchioRobot& peer) : model_(model), peer_(peer) {
    for (int i = 1; i < model.num_bodies(); ++i) {
      const bool floating = model.body(i).joint_type == JointType::kFloating;
      PinocchioJoint joint;
      if (!peer.find_joint(floating ? "" : model.joint(i - 1).name.c_str(), &joint))
        throw std::runtime_error(model.joint(i - 1).name + ": not a joint of Pinocchio's model");
      joints_.push_back(joint);
    }
    if (peer.nv() != model.nv())
      throw std::runtime_error(
          fmt::format("{} velocities here, {} in Pinocchio", model.nv(), peer.nv()));
  }

  /// R of the body that a floating joint carries, else the identity.
  Matrix3 turn(int i, const VectorX& q) const {
    const double* p = q.data() + model_.body(i).q_index + 3;
    return Quaternion(p[0], p[1], p[2], p[3]).toRotationMatrix();
  }
  bool floating(int i) const { return model_.body(i).joint_type == JointType::kFloating; }

  VectorX coordinates(const VectorX& q) const {
    VectorX out(peer_.nq());
    for (int i = 1; i < model_.num_bodies(); ++i) {
      const double* p = q.data() + model_.body(i).q_index;
      const PinocchioJoint& joint = joints_[static_cast<std::size_t>(i) - 1];
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

  /// Velocities or forces: linear ones of a free base from axes of the world to those of the body.
  VectorX mapped(const VectorX& q, const VectorX& x) const {
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

  /// Accelerations: the body's axes turn, theirs is the rate of change seen from them.
  VectorX mapped_acceleration(const VectorX& q, const VectorX& v, const VectorX& a) const {
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

  /// Gives the peer all states, x as accelerations or as forces.
  void set_states(const States& states, bool accelerations) {
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

  const PinocchioJoint& joint(int i) const { return joints_[static_cast<std::size_t>(i) - 1]; }

 private:
  const Model& model_;
  PinocchioRobot& peer_;
  std::vector<PinocchioJoint> joints_;
};

/// Our side: from coordinates to the result of one algorithm.
class Ours {
 public:
  explicit Ours(const Model& model)
      : model_(model),
        data_(model),
        out_(VectorX::Zero(model.nv())),
        zero_(VectorX::Zero(model.nv())),
        M_(model.nv(), model.nv()) {}

  void run(PinocchioAlgorithm algorithm, const States& states, int evaluations) {
    std::size_t i = 0;
    for (int k = 0; k < evaluations; ++k) {
      evaluate(algorithm, states, i);
      if (++i == states.q.size()) i = 0;
    }
  }

  void evaluate(PinocchioAlgorithm algorithm, const States& states, std::size_t i) {
    compute_poses(model_, states.q[i], data_);
    switch (algorithm) {
      case PinocchioAlgorithm::kKinematics:
        return;
      case PinocchioAlgorithm::kRnea:
        compute_velocities(model_, states.v[i], data_);
        return rnea(model_, states.x[i], model_.gravity(), data_, out_);
      case PinocchioAlgorithm::kAba:
        compute_velocities(model_, states.v[i], data_);
        compute_inertias(model_, data_);
        if (!aba(model_, states.x[i], zero_, model_.gravity(), moving_bodies(model_), data_, out_))
          throw std::runtime_error("aba: singular");
        return;
      case PinocchioAlgorithm::kCrba:
        compute_inertias(model_, data_);
        return crba(model_, data_, M_);
    }
  }

  const Data& data() const { return data_; }
  const VectorX& out() const { return out_; }
  MatrixX M() const { return M_; }

 private:
  const Model& model_;
  Data data_;
  VectorX out_, zero_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> M_;
};

/// Largest difference of the two results over all states, as a share of the largest entry.
double difference(const Model& model, PinocchioAlgorithm algorithm, const States& states,
                  const Pair& pair, Ours& ours, PinocchioRobot& peer) {
  const int nv = model.nv();
  double worst = 0.0, scale = 0.0;
  VectorX theirs(std::max(nv * nv, 3 * model.num_bodies()));
  for (int k = 0; k < kStates; ++k) {
    const auto i = static_cast<std::size_t>(k);
    ours.evaluate(algorithm, states, i);
    peer.evaluate(algorithm, k, theirs.data());
    const VectorX& q = states.q[i];
    VectorX mine, other;
    if (algorithm == PinocchioAlgorithm::kKinematics) {
      mine.resize(3 * model.num_joints());
      for (int b = 1; b < model.num_bodies(); ++b)
        mine.segment<3>(3 * pair.joint(b).index) =
            ours.data().X_WB[static_cast<std::size_t>(b)].translation;
      other = theirs.head(mine.size());
    } else if (algorithm == PinocchioAlgorithm::kCrba) {
      // T' M_theirs T = M_ours, column by column of T.
      MatrixX T(nv, nv);
      for (int j = 0; j < nv; ++j) T.col(j) = pair.mapped(q, VectorX::Unit(nv, j));
      const MatrixX M = T.transpose() * Eigen::Map<MatrixX>(theirs.data(), nv, nv) * T;
      const MatrixX own = ours.M();
      mine = own.reshaped();
      other = M.reshaped();
    } else {
      mine = algorithm == PinocchioAlgorithm::kAba
                 ? pair.mapped_acceleration(q, states.v[i], ours.out())
                 : pair.mapped(q, ours.out());
      other = theirs.head(nv);
    }
    worst = std::max(worst, (mine - other).lpNorm<Eigen::Infinity>());
    scale = std::max(scale, mine.lpNorm<Eigen::Infinity>());
  }
  return worst / scale;
}

void compare_robot(const std::filesystem::path& urdf, const Robot& robot,
                   const PeerOptions& options, PeerTable& table) {
  SceneOverrides overrides;
  overrides.base = robot.floating ? Base::kFloating : Base::kFixed;
  const Scene scene = load_scene(urdf, overrides);
  const Model& model = scene.model;
  const States states = random_states(model);
  Ours ours(model);
  const auto load = [&](PinocchioConvention convention) {
    return peers::load_pinocchio(urdf.string(), robot.floating, model.gravity().data(), convention);
  };
  const auto world = load(PinocchioConvention::kWorld), local = load(PinocchioConvention::kLocal);
  Pair pair(model, *world), local_pair(model, *local);
  constexpr std::pair<PinocchioAlgorithm, const char*> kAlgorithms[] = {
      {PinocchioAlgorithm::kKinematics, "kinematics"},
      {PinocchioAlgorithm::kRnea, "rnea"},
      {PinocchioAlgorithm::kAba, "aba"},
      {PinocchioAlgorithm::kCrba, "crba"}};
  for (const auto& [algorithm, name] : kAlgorithms) {
    pair.set_states(states, algorithm == PinocchioAlgorithm::kRnea);
    local_pair.set_states(states, algorithm == PinocchioAlgorithm::kRnea);
    const auto what = algorithm;
    std::vector<Contender> contenders{
        {"counterpoint", [&](int count) { ours.run(what, states, count); }},
        {"pinocchio", [&](int count) { world->run(what, count); }}};
    const bool two_ways =
        algorithm == PinocchioAlgorithm::kAba || algorithm == PinocchioAlgorithm::kCrba;
    if (two_ways) contenders.push_back({"pinocchio", [&](int count) { local->run(what, count); }});
    const Timing timing = take_turns(contenders, options.rounds, options.slice);
    const std::size_t best = two_ways && timing.seconds[2] < timing.seconds[1] ? 2 : 1;
    const double error = difference(model, algorithm, states, best == 2 ? local_pair : pair, ours,
                                    best == 2 ? *local : *world);
    const std::string label = urdf.stem().string();
    table.add({"algorithms", label, name, "counterpoint", timing.seconds[0], 1.0, "difference",
               error, model.nv(), ""});
    table.add({"algorithms", label, name, "pinocchio", timing.seconds[best],
               1.0 / timing.ratio[best], "difference", error, model.nv(),
               two_ways ? (best == 2 ? "local" : "world") : ""});
  }
}

}  // namespace

std::filesystem::path find_below(const std::filesystem::path& folder, const std::string& name) {
  std::error_code none;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, none))
    if (entry.path().filename() == name) return entry.path();
  return {};
}

void compare_algorithms(const PeerOptions& options, PeerTable& table) {
  if (peers::pinocchio_version().empty()) {
    fmt::print("Skipped: algorithms. Pinocchio was not found when this was built.\n");
    return;
  }
  for (const Robot& robot : kRobots) {
    const std::filesystem::path urdf = find_below(options.robots, robot.urdf);
    if (urdf.empty()) {
      fmt::print("Skipped: {} is not below the folder of robots ({}).\n", robot.urdf,
                 options.robots.empty() ? "--robots was not given" : options.robots.string());
      continue;
    }
    compare_robot(urdf, robot, options, table);
  }
}

}  // namespace counterpoint::apps
