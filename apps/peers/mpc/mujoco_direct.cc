#include "mujoco_direct.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

#include "mjpc/direct/direct.h"
#include "peers/mjcf.h"
#include "peers/mujoco_calls.h"

namespace counterpoint::peers {

namespace {

/// Weight that fixes the first two frames [1/m, 1/rad]: far above any weight of a pose.
constexpr double kHeld = 1e3;

struct ModelDeleter {
  void operator()(mjModel* m) const { mj_deleteModel(m); }
};

/// Adds sensors of all coordinates, twice: one group weighs the poses, the other fixes the first
/// frames.
std::string with_sensors(std::string document, const Model& model) {
  std::string sensors = "<sensor>";
  for (int group = 0; group < 2; ++group) {
    for (const char* what : {"framepos", "framequat"})
      sensors += fmt::format("<{} objtype='xbody' objname='{}'/>", what, model.joint(0).link);
    for (int i = 1; i < model.num_joints(); ++i)
      sensors += fmt::format("<jointpos joint='{}'/>", model.joint(i).name);
  }
  return document.replace(document.rfind("</mujoco>"), 9, sensors + "</sensor></mujoco>");
}

}  // namespace

struct MujocoDirect::Impl {
  std::unique_ptr<mjModel, ModelDeleter> model;
  std::unique_ptr<mjpc::Direct> direct;
  int frames = 0;  ///< frames of Direct: one more, before q_0

  void set_targets(const DirectTask& task);
  void set_weights(const DirectTask& task);
};

/// Sets the targets. Frame t of Direct is target t - 1; the first frame repeats target 0, so that
/// the robot is at rest.
void MujocoDirect::Impl::set_targets(const DirectTask& task) {
  Mujoco coordinates(*task.scene, MujocoSettings::kDefault);
  mjData* data = mj_makeData(model.get());
  State state;
  state.v = VectorX::Zero(task.scene->model.nv());
  for (int t = 0; t < frames; ++t) {
    state.q = task.targets[static_cast<std::size_t>(std::max(t - 1, 0))];
    coordinates.set_state(state);
    const double* q = coordinates.own_data()->qpos;
    direct->configuration.Set(q, t);
    std::copy(q, q + model->nq, data->qpos);
    mj_forward(model.get(), data);
    direct->sensor_measurement.Set(data->sensordata, t);
    const double time = t * model->opt.timestep;
    direct->times.Set(&time, t);
  }
  mj_deleteData(data);
}

/// Sets the weights. Direct divides them by the number of summed terms, which is undone here.
void MujocoDirect::Impl::set_weights(const DirectTask& task) {
  direct->settings.time_scaling_force = direct->settings.time_scaling_sensor = false;
  direct->settings.last_step_position_sensors = true;
  direct->settings.last_step_velocity_sensors = false;
  const int nv = model->nv;
  for (int i = 0; i < nv; ++i)
    direct->noise_process[static_cast<std::size_t>(i)] =
        1.0 / (std::pow(task.force_weight[i], 2) * nv * (frames - 2));
  const int group = model->nsensor / 2;
  for (int i = 0; i < model->nsensor; ++i) {
    const int k = i % group;  // k = 0: position, 1: quaternion (half an angle), then joints
    const double pose = k == 0   ? task.pose_weight[0]
                        : k == 1 ? 2.0 * task.pose_weight[3]
                                 : task.pose_weight[k + 4];
    const double weight = i < group ? pose : k == 1 ? 2.0 * kHeld : kHeld;
    direct->noise_sensor[static_cast<std::size_t>(i)] =
        1.0 / (std::max(weight * weight, 1e-12) * model->sensor_dim[i] * frames);
    for (int t = 0; t < frames; ++t) direct->sensor_mask.Get(t)[i] = i < group ? t > 1 : t < 2;
  }
}

MujocoDirect::MujocoDirect(const DirectTask& task) : impl_(std::make_unique<Impl>()) {
  impl_->model.reset(compile(with_sensors(mjcf(*task.scene), task.scene->model)));
  apply_settings(MujocoSettings::kDefault, impl_->model.get());
  impl_->frames = static_cast<int>(task.targets.size()) + 1;
  impl_->direct = std::make_unique<mjpc::Direct>(impl_->model.get(), impl_->frames);
  impl_->set_targets(task);
  impl_->set_weights(task);
}

MujocoDirect::~MujocoDirect() = default;

int MujocoDirect::iterate(int most) {
  impl_->direct->settings.max_smoother_iterations = most;
  impl_->direct->Optimize();
  return impl_->direct->IterationsSmoother();
}

double MujocoDirect::cost() const { return impl_->direct->GetCost(); }

double MujocoDirect::base_force() const {
  double most = 0.0;
  for (int t = 1; t + 1 < impl_->frames; ++t)
    most = std::max(most, mju_norm3(impl_->direct->force_prediction.Get(t)));
  return most;
}

double MujocoDirect::base_torque() const {
  double most = 0.0;
  for (int t = 1; t + 1 < impl_->frames; ++t)
    most = std::max(most, mju_norm3(impl_->direct->force_prediction.Get(t) + 3));
  return most;
}

double MujocoDirect::forward_check() {
  const mjModel* m = impl_->direct->model;
  mjData* d = mj_makeData(m);
  std::vector<double> apart(static_cast<std::size_t>(m->nv));
  double most = 0.0;
  for (int t = 1; t + 1 < impl_->frames; ++t) {
    mj_resetData(m, d);
    std::copy_n(impl_->direct->configuration.Get(t), m->nq, d->qpos);
    std::copy_n(impl_->direct->velocity.Get(t), m->nv, d->qvel);
    std::copy_n(impl_->direct->force_prediction.Get(t), m->nv, d->qfrc_applied);
    mj_step(m, d);
    mj_differentiatePos(m, apart.data(), 1.0, d->qpos, impl_->direct->configuration.Get(t + 1));
    for (const double a : apart) most = std::max(most, std::abs(a));
  }
  mj_deleteData(d);
  return most;
}

}  // namespace counterpoint::peers
