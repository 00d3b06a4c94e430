#include "mujoco_planner.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <vector>

#include "mjpc/planners/cross_entropy/planner.h"
#include "mjpc/planners/gradient/planner.h"
#include "mjpc/planners/ilqg/planner.h"
#include "mjpc/planners/sampling/planner.h"
#include "peers/mjcf.h"
#include "peers/mujoco_calls.h"

namespace counterpoint::peers {
namespace {

constexpr double kFall = 0.2;  ///< time of the capture point [s], as in MuJoCo MPC's humanoid

/// Norms of MuJoCo MPC's quadruped: 0 half of the square, 2 distance, 6 smooth absolute value;
/// their scales.
constexpr std::array<int, kPlannerResiduals> kNorm{6, 6, 2, 0, 0, 0, 2, 6};
constexpr std::array<double, kPlannerResiduals> kScale{0.04, 0.05, 0.1, 1, 1, 1, 0.1, 0.03};

struct ModelDeleter {
  void operator()(mjModel* m) const { mj_deleteModel(m); }
};

/// Terms of the problem that have points of the feet.
std::vector<optimization::Term> feet_of(const optimization::Problem& problem) {
  std::vector<optimization::Term> feet;
  for (const optimization::Term& term : problem.terms)
    if (term.quantity == optimization::Quantity::kSliding) feet.push_back(term);
  return feet;
}

Vector3 place(const mjData* d, const optimization::Term& foot) {
  Vector3 p;
  mju_mulMatVec3(p.data(), d->xmat + 9 * foot.body, foot.point.data());
  mju_addTo3(p.data(), d->xpos + 3 * foot.body);
  return p;
}

/// The task in MuJoCo MPC's form.
class Task final : public mjpc::Task {
 public:
  explicit Task(const MujocoPlannerTask& given)
      : task(given), feet(feet_of(given.control->file.problem)), weights_(this) {
    if (task.weights.back() > 0.0 && feet.size() != 4)
      throw NotExpressible("a trot needs four feet");
    const Model& robot = task.control->file.scene->model;
    for (int i = 1; i < robot.num_joints(); ++i) limit.push_back(robot.joint(i).effort_limit);
  }
  std::string Name() const override { return "control"; }
  std::string XmlPath() const override { return ""; }
  void residual(const mjModel* m, mjData* d, double* out) const;
  std::string sensors() const;

  const MujocoPlannerTask& task;
  std::vector<optimization::Term> feet;
  std::vector<double> limit;  ///< effort limits of the motors [N m]

 private:
  /// The weights only; MuJoCo's callback sense() writes the residuals.
  struct Weights final : mjpc::BaseResidualFn {
    explicit Weights(const mjpc::Task* owner) : BaseResidualFn(owner) {}
    void Residual(const mjModel*, const mjData*, double*) const override {}
  };
  mjpc::BaseResidualFn* InternalResidual() override { return &weights_; }
  std::unique_ptr<mjpc::ResidualFn> ResidualLocked() const override {
    return std::make_unique<Weights>(this);
  }

  Weights weights_;
};

std::string Task::sensors() const {
  const std::size_t joints = limit.size();
  const std::array<std::size_t, kPlannerResiduals> size{1,      3,      6, joints,
                                                        joints, joints, 2, feet.size()};
  std::string text = "<sensor>";
  for (std::size_t i = 0; i < size.size(); ++i)
    text += fmt::format("<user dim='{}' user='{} {} 0 1 {}'/>", size[i], task.robust ? kNorm[i] : 0,
                        task.weights[i], kScale[i]);
  return text + "</sensor>";
}

void Task::residual(const mjModel* m, mjData* d, double* out) const {
  const std::size_t joints = limit.size();
  *out++ = d->qpos[2] - task.posture[2];
  mju_subQuat(out, d->qpos + 3, task.posture.data() + 3);
  out = std::copy_n(d->qvel, 6, out + 3);
  out[-6] -= task.target_speed;
  mju_sub(out, d->qpos + 7, task.posture.data() + 7, static_cast<int>(joints));
  out += joints;
  for (std::size_t i = 0; i < joints; ++i) *out++ = d->qfrc_actuator[6 + i] / limit[i];
  out = std::copy_n(d->qvel + 6, joints, out);
  Vector3 mean = Vector3::Zero();
  for (const optimization::Term& foot : feet)
    mean += place(d, foot) / static_cast<double>(feet.size());
  mj_subtreeVel(m, d);
  for (int i = 0; i < 2; ++i) {
    const double target = i == 0 ? task.target_speed : 0.0;
    *out++ = d->subtree_com[3 + i] + kFall * (d->subtree_linvel[3 + i] - target) - mean[i];
  }
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const double phase = task.cadence * d->time + (i == 1 || i == 2 ? 0.5 : 0.0);
    const double lift = task.lift * std::max(0.0, std::sin(2.0 * std::numbers::pi * phase));
    *out++ = place(d, feet[i]).z() - feet[i].radius - lift;
  }
}

const Task* sensing = nullptr;        ///< MuJoCo's callback has no argument for it
const mjModel* sensing_in = nullptr;  ///< the planner's model

void sense(const mjModel* m, mjData* d, int stage) {
  if (stage == mjSTAGE_ACC && m == sensing_in) sensing->residual(m, d, d->sensordata);
}

std::unique_ptr<mjpc::Planner> make_planner(const std::string& name) {
  if (name == "sampling") return std::make_unique<mjpc::SamplingPlanner>();
  if (name == "cross_entropy") return std::make_unique<mjpc::CrossEntropyPlanner>();
  if (name == "ilqg") return std::make_unique<mjpc::iLQGPlanner>();
  if (name == "gradient") return std::make_unique<mjpc::GradientPlanner>();
  throw NotExpressible("MuJoCo MPC has no planner '" + name + "' here");
}

/// Processor time of the process [s]: the planner works in a thread of its own.
double process_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

struct MujocoPlanner::Impl {
  explicit Impl(const MujocoPlannerTask& given);
  std::string document() const;

  MujocoPlannerTask task;
  Task residuals;
  std::unique_ptr<mjModel, ModelDeleter> model;
  std::unique_ptr<mjpc::Planner> planner;
  mjpc::ThreadPool pool;
  mjpc::State state;
};

/// The scene with the planner's settings, the residuals and the motors.
std::string MujocoPlanner::Impl::document() const {
  const Scene& scene = *task.control->file.scene;
  const optimization::FeedbackGains& gains = task.control->gains;
  std::string text = "<size nuser_sensor='5'/><custom>";
  for (const char* name : {"sampling_trajectories", "ilqg_num_rollouts"})
    text += fmt::format("<numeric name='{}' data='{}'/>", name, task.candidates);
  for (const char* name : {"sampling_spline_points", "gradient_spline_points"})
    text += fmt::format("<numeric name='{}' data='{}'/>", name, task.spline_points);
  text +=
      fmt::format("<numeric name='sampling_exploration' data='{}'/></custom>", task.exploration);
  text += residuals.sensors() + "<actuator>";
  for (int i = 1; i < scene.model.num_joints(); ++i) {
    const JointInfo& joint = scene.model.joint(i);
    const int v = scene.model.body(i + 1).v_index;
    text += fmt::format("<general joint='{}' ctrllimited='true' ", joint.name);
    if (task.servo > 0.0)
      text += fmt::format(
          "ctrlrange='{0} {1}' gainprm='{2}' biastype='affine' biasprm='0 -{2} -{3}' "
          "forcelimited='true' forcerange='-{4} {4}'/>",
          joint.lower, joint.upper, task.servo * gains.stiffness[v],
          std::sqrt(task.servo) * gains.damping[v], joint.effort_limit);
    else
      text += fmt::format("ctrlrange='-1 1' gainprm='{}'/>", joint.effort_limit);
  }
  std::string whole = mjcf(scene);
  return whole.replace(whole.rfind("</mujoco>"), 9, text + "</actuator></mujoco>");
}

MujocoPlanner::Impl::Impl(const MujocoPlannerTask& given) : task(given), residuals(task), pool(1) {
  keep_quiet();
  model.reset(compile(document()));
  apply_settings(MujocoSettings::kElliptic, model.get());
  model->opt.integrator = mjINT_IMPLICITFAST;
  model->opt.timestep = task.step;
  if (task.planner == "ilqg" || task.planner == "gradient") mjpc::MakeDifferentiable(model.get());
  residuals.Reset(model.get());
  sensing = &residuals;
  sensing_in = model.get();
  mjcb_sensor = sense;
  planner = make_planner(task.planner);
  planner->Initialize(model.get(), residuals);
  planner->Allocate();
  std::vector<double> first(residuals.limit.size(), 0.0);
  if (task.servo > 0.0) std::copy_n(task.posture.data() + 7, first.size(), first.begin());
  planner->Reset(mjpc::kMaxTrajectoryHorizon, first.data());
  state.Allocate(model.get());
}

MujocoPlanner::MujocoPlanner(const MujocoPlannerTask& task) : impl_(std::make_unique<Impl>(task)) {}

MujocoPlanner::~MujocoPlanner() { mjcb_sensor = nullptr; }

double MujocoPlanner::replan(const mjData& world) {
  const double begin = process_seconds();
  impl_->state.Set(impl_->model.get(), world.qpos, world.qvel, nullptr, nullptr, nullptr, nullptr,
                   world.time);
  impl_->planner->SetState(impl_->state);
  const int steps = static_cast<int>(impl_->task.horizon / impl_->task.step + 1.0);
  impl_->planner->OptimizePolicy(steps, impl_->pool);
  return process_seconds() - begin;
}

void MujocoPlanner::force(const mjData& world, VectorX& out) const {
  const mjModel& m = *impl_->model;
  std::vector<double> state(world.qpos, world.qpos + m.nq), action(static_cast<std::size_t>(m.nu));
  state.insert(state.end(), world.qvel, world.qvel + m.nv);
  impl_->planner->ActionFromPolicy(action.data(), state.data(), world.time);
  out.setZero(m.nv);
  for (int i = 0; i < m.nu; ++i) {
    const double *gain = m.actuator_gainprm + i * mjNGAIN, *bias = m.actuator_biasprm + i * mjNBIAS;
    out[6 + i] = gain[0] * action[static_cast<std::size_t>(i)] + bias[1] * world.qpos[7 + i] +
                 bias[2] * world.qvel[6 + i];  // the world holds it within the limits
  }
}

}  // namespace counterpoint::peers
