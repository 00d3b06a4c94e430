#include "mjcf_compare.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "mjcf_forces.h"

namespace counterpoint::apps {
namespace {

struct Free {
  void operator()(mjModel* m) const { mj_deleteModel(m); }
  void operator()(mjData* d) const { mj_deleteData(d); }
};
using PeerModel = std::unique_ptr<mjModel, Free>;
using PeerData = std::unique_ptr<mjData, Free>;

/// Both models at the same random states; MuJoCo's coordinates are a permutation of ours.
class Pair {
 public:
  Pair(const MjcfModel& read, const Model& model, const mjModel& m)
      : forces(read, model, m, v_),
        read_(read),
        model_(model),
        m_(m),
        d_(mj_makeData(&m)),
        dynamics_(model),
        followers_(model) {
    int q = 0, v = 0;
    for (const MjcfModel::Coordinate& c : read.coordinates) {
      const Body& body = model.body(model.find_joint(c.joint) + 1);
      for (int i = 0; i < joint_nq(c.type); ++i) q_.push_back({body.q_index + i, q++});
      for (int i = 0; i < joint_nv(c.type); ++i) v_.push_back({body.v_index + i, v++});
    }
  }
  bool same_coordinates() const {
    return static_cast<int>(q_.size()) == m_.nq && static_cast<int>(v_.size()) == m_.nv &&
           model_.nq() == m_.nq && model_.nv() == m_.nv;
  }

  void draw(std::mt19937_64& random) {
    std::uniform_real_distribution<double> share(0.0, 1.0), angle(-3.0, 3.0), place(-1.0, 1.0);
    std::normal_distribution<double> normal;
    VectorX q(model_.nq()), v(model_.nv());
    for (const MjcfModel::Coordinate& c : read_.coordinates) {
      const int joint = model_.find_joint(c.joint);
      const JointInfo& info = model_.joint(joint);
      double* at = q.data() + model_.body(joint + 1).q_index;
      const int nq = joint_nq(c.type);
      if (nq == 1) {
        const bool bounded = std::isfinite(info.lower) && std::isfinite(info.upper);
        *at = bounded ? info.lower + share(random) * (info.upper - info.lower) : angle(random);
        continue;
      }
      for (int i = 0; i < nq - 4; ++i) at[i] = place(random);
      Eigen::Map<Eigen::Vector4d> quaternion(at + nq - 4);
      for (double& x : quaternion) x = normal(random);
      quaternion.normalize();
    }
    for (double& x : v) x = normal(random);
    followers_.place(q, v);
    for (const auto& [ours, theirs] : q_) d_->qpos[theirs] = q[ours];
    for (const auto& [ours, theirs] : v_) d_->qvel[theirs] = v[ours];
    forces.draw(q, v, random, *d_);
    dynamics_.set_state(q, v);
    mj_forward(&m_, d_.get());
  }

  double pose_error() const {
    double worst = 0.0;
    for (std::size_t i = 0; i < model_.frames().size(); ++i) {
      const int id = mj_name2id(&m_, mjOBJ_BODY, model_.frames()[i].name.c_str());
      if (id < 0) continue;
      const Pose X_WF = dynamics_.frame_pose(static_cast<int>(i));
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(d_->xmat + 9 * id);
      const Eigen::Map<const Vector3> p(d_->xpos + 3 * id);
      worst = std::max({worst, (X_WF.rotation - R).cwiseAbs().maxCoeff(),
                        (X_WF.translation - p).cwiseAbs().maxCoeff()});
    }
    return worst;
  }

  double mass_error() {
    const int nv = model_.nv();
    MatrixX ours = MatrixX::Zero(nv, nv), theirs(nv, nv);
    dynamics_.mass_matrix(ours);
    ours.diagonal() += model_.armature();
    // Multiplies by unit vectors one by one; the arguments of mj_fullM differ between versions.
    std::vector<mjtNum> unit(static_cast<std::size_t>(nv)), column(static_cast<std::size_t>(nv));
    for (int k = 0; k < nv; ++k) {
      std::fill(unit.begin(), unit.end(), 0.0);
      unit[static_cast<std::size_t>(k)] = 1.0;
      mj_mulM(&m_, d_.get(), column.data(), unit.data());
      for (int i = 0; i < nv; ++i) theirs(i, k) = column[static_cast<std::size_t>(i)];
    }
    double worst = 0.0;
    for (const auto& [i, ti] : v_)
      for (const auto& [j, tj] : v_)
        worst = std::max(
            worst, std::abs(ours(i, j) - theirs(ti, tj)) / std::sqrt(ours(i, i) * ours(j, j)));
    return worst;
  }

  double bias_error() {
    VectorX tau(model_.nv());
    dynamics_.inverse_dynamics(VectorX::Zero(model_.nv()), tau);
    double worst = 0.0, scale = 0.0;
    for (const auto& [ours, theirs] : v_) {
      const double peer = d_->qfrc_bias[theirs] - d_->qfrc_gravcomp[theirs];
      worst = std::max(worst, std::abs(tau[ours] - peer));
      scale = std::max({scale, std::abs(d_->qfrc_bias[theirs]), std::abs(tau[ours])});
    }
    return scale > 0.0 ? worst / scale : 0.0;
  }

  /// MuJoCo's Jacobian of a tendon, by its coordinate.
  VectorX peer_arms(int id) const {
    VectorX out = VectorX::Zero(m_.nv);
    for (int n = 0; n < m_.ten_J_rownnz[id]; ++n) {
      const int at = m_.ten_J_rowadr[id] + n;
      out[m_.ten_J_colind[at]] = d_->ten_J[at];
    }
    return out;
  }

  void compare_tendons() {
    VectorX ours(model_.nv());
    for (std::size_t i = 0; i < model_.tendons().size(); ++i) {
      const int id = mj_name2id(&m_, mjOBJ_TENDON, model_.tendons()[i].name.c_str());
      if (id < 0) continue;
      lengths.add(i, dynamics_.tendon_length(static_cast<int>(i)), d_->ten_length[id]);
      dynamics_.tendon_arms(static_cast<int>(i), ours);
      const VectorX theirs = peer_arms(id);
      for (const auto& [at, peer] : v_) arms.add(i, ours[at], theirs[peer]);
    }
  }
  void compare_forces() { forces.compare(dynamics_, *d_); }

  ForceComparison forces;
  Differences lengths, arms;  ///< lengths and moment arms of tendons

 private:
  const MjcfModel& read_;
  const Model& model_;
  const mjModel& m_;
  PeerData d_;
  Dynamics dynamics_;
  Followers followers_;
  std::vector<Place> q_, v_;
};

/// MuJoCo's inertia of a body, in the body-fixed frame.
SpatialInertia inertia_of(const mjModel& m, int id) {
  const mjtNum* q = m.body_iquat + 4 * id;
  const Matrix3 R = Quaternion(q[0], q[1], q[2], q[3]).toRotationMatrix();
  const Eigen::Map<const Vector3> moments(m.body_inertia + 3 * id), center(m.body_ipos + 3 * id);
  return {m.body_mass[id], center, R * moments.asDiagonal() * R.transpose()};
}

/// Replaces the inertias of the links by MuJoCo's; returns the largest relative difference.
double take_inertias(const mjModel& m, RobotSpec& robot) {
  double worst = 0.0;
  for (LinkSpec& link : robot.links) {
    const int id = mj_name2id(&m, mjOBJ_BODY, link.name.c_str());
    if (id <= 0 || !(link.inertia.mass > 0.0)) continue;
    const SpatialInertia theirs = inertia_of(m, id);
    const double size = theirs.rotational.norm();
    if (size > 0.0)
      worst = std::max(worst, (link.inertia.rotational - theirs.rotational).norm() / size);
    link.inertia.rotational = theirs.rotational;
  }
  return worst;
}

void count_actuators(const MjcfModel& read, MjcfComparison& out) {
  for (const MjcfModel::Actuator& a : read.actuators) {
    const bool drives = !a.joint.empty() || !a.tendon.empty();
    ++(a.commanded >= 0 ? out.commanded : drives ? out.servos : out.without_counterpart);
  }
}

/// Suppresses MuJoCo's printed warnings, which are irrelevant here.
void stay_quiet() {
  mju_user_warning = [](const char*) {};
}

}  // namespace

void load_plugins(const std::filesystem::path& file) { mj_loadPluginLibrary(file.c_str()); }

std::string mujoco_used() { return mj_versionString(); }

MjcfComparison compare_with_mujoco(const std::filesystem::path& file, int states,
                                   const MjcfOptions& options) {
  MjcfComparison out;
  stay_quiet();
  char error[1000] = "";
  const PeerModel m(mj_loadXML(file.c_str(), nullptr, error, sizeof error));
  if (!m) {
    out.unreadable = error;
  } else {
    m->opt.timestep = kInstant;
    m->opt.disableflags |= mjDSBL_CONTACT;  // adhesion has no contacts to pull at
  }
  try {
    const MjcfModel read = load_mjcf(file, options);
    ModelBuilder builder(read.gravity);
    add_mjcf(read, "none", Pose(), "", builder);
    const Model model = builder.build();
    out.bodies = model.num_bodies() - 1;
    out.nv = model.nv();
    out.notes = static_cast<int>(model.notes().size());
    out.tendons = static_cast<int>(model.tendons().size());
    count_actuators(read, out);
    if (!m) return out;
    Pair pair(read, model, *m);
    if (!pair.same_coordinates() || !pair.forces.same_actuators()) {
      out.unreadable = "MuJoCo has other coordinates or actuators";
      return out;
    }
    std::mt19937_64 random(1);
    for (int i = 0; i < states; ++i) {
      pair.draw(random);
      out.pose = std::max(out.pose, pair.pose_error());
      if (model.nv() == 0) continue;
      out.mass = std::max(out.mass, pair.mass_error());
      out.bias = std::max(out.bias, pair.bias_error());
      pair.compare_tendons();
      pair.compare_forces();
    }
    out.tendon_length = pair.lengths.worst();
    out.tendon_arms = pair.arms.worst();
    out.joint_force = pair.forces.joints.worst();
    out.actuator_force = pair.forces.actuators.worst();
    MjcfModel theirs = read;
    out.inertia = take_inertias(*m, theirs.robot);
    ModelBuilder second(model.gravity());
    add_mjcf(theirs, "none", Pose(), "", second);
    const Model same = second.build();
    Pair again(read, same, *m);
    for (int i = 0; i < states && model.nv() > 0; ++i) {
      again.draw(random);
      out.mass_with_theirs = std::max(out.mass_with_theirs, again.mass_error());
      out.bias_with_theirs = std::max(out.bias_with_theirs, again.bias_error());
    }
  } catch (const InputError& e) {
    out.refused = e.what();
  }
  return out;
}

}  // namespace counterpoint::apps
