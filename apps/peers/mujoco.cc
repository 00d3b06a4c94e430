#include "mujoco.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/collision/collider.h"
#include "mjcf.h"
#include "mujoco_calls.h"
#include "mujoco_impl.h"

namespace counterpoint::peers {
namespace {

Vector3 vector(const mjtNum* p) { return {p[0], p[1], p[2]}; }

}  // namespace

std::string mujoco_version() { return mj_versionString(); }

void Mujoco::Impl::set_state(const State& to) {
  mj_resetData(m, d);
  state = to;
  d->time = to.time;
  std::copy(to.q.begin(), to.q.end(), d->qpos);
  std::copy(to.v.begin(), to.v.end(), d->qvel);
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (!is_free(body)) continue;
    // MuJoCo uses the world's axes, ours are those of the joint's frame.
    const Pose X_WB = joint_pose(body.X_PJ, body.joint_type, to.q.data() + body.q_index);
    const Quaternion turn(X_WB.rotation);
    mjtNum* q = d->qpos + body.q_index;
    set_numbers(X_WB.translation, q);
    q[3] = turn.w(), q[4] = turn.x(), q[5] = turn.y(), q[6] = turn.z();
    set_numbers(body.X_PJ.rotation * to.v.segment<3>(body.v_index), d->qvel + body.v_index);
  }
}

void Mujoco::Impl::read_state() {
  state.time = d->time;
  std::copy(d->qpos, d->qpos + m->nq, state.q.begin());
  std::copy(d->qvel, d->qvel + m->nv, state.v.begin());
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (!is_free(body)) continue;
    const mjtNum* q = d->qpos + body.q_index;
    const Quaternion turn =
        Quaternion(body.X_PJ.rotation).conjugate() * Quaternion(q[3], q[4], q[5], q[6]);
    state.q.segment<3>(body.q_index) = body.X_PJ.inverse() * vector(q);
    state.q.segment<4>(body.q_index + 3) << turn.w(), turn.x(), turn.y(), turn.z();
    state.v.segment<3>(body.v_index) =
        body.X_PJ.rotation.transpose() * vector(d->qvel + body.v_index);
  }
}

void Mujoco::Impl::apply(const Input& input) {
  mju_zero(d->qfrc_applied, m->nv);
  mju_zero(d->xfrc_applied, 6 * m->nbody);
  for (int i = 1; i < model.num_bodies() && input.applied_force.size() > 0; ++i) {
    const Body& body = model.body(i);
    const double limit = model.joint(i - 1).effort_limit;
    // With a servo the limit applies to the sum with its force: see the controls below.
    const bool cut = on.has(Effect::kEffortLimits) && model.find_servo(i - 1) < 0;
    for (int k = 0; k < joint_nv(body.joint_type); ++k) {
      const double u = input.applied_force[body.v_index + k];
      d->qfrc_applied[body.v_index + k] = cut ? std::clamp(u, -limit, limit) : u;
    }
    if (is_free(body)) {
      set_numbers(body.X_PJ.rotation * vector(d->qfrc_applied + body.v_index),
                  d->qfrc_applied + body.v_index);
    }
  }
  for (int i = 0; i < m->nu; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const JointServo& servo = model.servos()[k];
    const int v = model.body(servo.joint + 1).v_index;
    const double q = input.servo_position.size() ? input.servo_position[i] : servo.position;
    const double w = input.servo_velocity.size() ? input.servo_velocity[i] : servo.velocity;
    d->ctrl[i] = servo.stiffness * q + servo.damping * w + d->qfrc_applied[v];
    d->qfrc_applied[v] = 0.0;
  }
  if (input.wrenches.empty()) return;
  mj_kinematics(m, d);
  mj_comPos(m, d);
  for (const ExternalWrench& w : input.wrenches) {
    // MuJoCo applies wrenches at the centre of mass.
    const Vector3 arm =
        anchor(w.body, {Matrix3::Identity(), w.point}) - vector(d->xipos + 3 * w.body);
    const Vector3 torque = w.wrench.torque + arm.cross(w.wrench.force);
    mju_addTo3(d->xfrc_applied + 6 * w.body, w.wrench.force.data());
    mju_addTo3(d->xfrc_applied + 6 * w.body + 3, torque.data());
  }
}

/// True if MuJoCo gave one of these warnings since the last reset.
bool Mujoco::Impl::warned(std::initializer_list<int> kinds) const {
  return std::any_of(kinds.begin(), kinds.end(),
                     [&](int kind) { return d->warning[kind].number > 0; });
}

std::string Mujoco::Impl::try_steps(const Input& input, long count) {
  apply(input);
  const std::string error = guarded_steps(m, d, count);
  if (!error.empty()) return "MuJoCo: " + error;
  if (warned({mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC}))
    return "MuJoCo: not finite or beyond 1e10, it starts anew";
  return {};
}

/// True if the step failed for lack of memory; then the size for the next build is doubled.
bool Mujoco::Impl::needs_room(const std::string& failure) {
  if (lacks_stack(failure)) {
    stack_factor *= 2.0;
    return true;
  }
  if (!failure.empty() || !warned({mjWARN_CONTACTFULL, mjWARN_CNSTRFULL})) return false;
  max_contacts *= 2;
  return true;
}

MujocoStep Mujoco::Impl::step(const Input& input) {
  constexpr int kMostTries = 12;
  const std::vector<mjtNum> warm(d->qacc_warmstart, d->qacc_warmstart + m->nv);
  MujocoStep report;
  report.failure = try_steps(input, chosen.substeps);
  for (int tries = 0; tries < kMostTries && needs_room(report.failure); ++tries) {
    build();
    set_state(State(state));
    std::copy(warm.begin(), warm.end(), d->qacc_warmstart);
    report.failure = try_steps(input, chosen.substeps);
  }
  if (report.failure.empty() && warned({mjWARN_CONTACTFULL, mjWARN_CNSTRFULL}))
    report.failure = "MuJoCo: too many contacts";
  if (!report.failure.empty()) {
    set_state(State(state));
    return report;
  }
  read_state();
  report.iterations = iterations();
  for (int i = 0; i < d->ncon; ++i)
    report.max_penetration = std::max(report.max_penetration, -d->contact[i].dist);
  forces_read = false;
  return report;
}

std::string Mujoco::Impl::run(long count) {
  std::string failure = try_steps({}, count * chosen.substeps);
  if (!failure.empty()) return failure;
  if (warned({mjWARN_CONTACTFULL, mjWARN_CNSTRFULL})) return "MuJoCo: too many contacts";
  return {};
}

int Mujoco::Impl::iterations() const {
#if mjVERSION_HEADER >= 300
  const int islands = std::clamp(d->nisland, 1, static_cast<int>(mjNISLAND));
  return *std::max_element(d->solver_niter, d->solver_niter + islands);
#else
  return d->solver_iter;
#endif
}

void Mujoco::Impl::read_forces() {
  if (forces_read) return;
  forces_read = true;
  contacts.clear();
  for (int i = 0; i < d->ncon; ++i) {
    const mjContact& c = d->contact[i];
    const int a = geometry_of[static_cast<std::size_t>(c.geom1)];
    const int b = geometry_of[static_cast<std::size_t>(c.geom2)];
    mjtNum in_frame[6];
    mj_contactForce(m, d, i, in_frame);
    const Eigen::Map<const Eigen::Matrix<mjtNum, 3, 3, Eigen::RowMajor>> frame(c.frame);
    const double sign = a < b ? 1.0 : -1.0;  // MuJoCo: from the first geometry to the second
    ContactForce out;
    out.contact = {std::min(a, b), std::max(a, b), vector(c.pos), sign * vector(c.frame), c.dist};
    out.force = sign * (frame.transpose() * vector(in_frame));
    contacts.push_back(out);
  }
  read_closure_forces();
}

void Mujoco::Impl::read_closure_forces() {
  closures.assign(model.closures().size(), ClosureForce());
  for (std::size_t i = 0; i < closures.size(); ++i) {
    if (model.closures()[i].type == ClosureType::kWeld)
      closures[i].force.torque.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  std::vector<int> rows(static_cast<std::size_t>(m->neq), 0);
  for (int row = 0; row < d->nefc; ++row) {
    if (d->efc_type[row] != mjCNSTR_EQUALITY) continue;
    const auto id = static_cast<std::size_t>(d->efc_id[row]);
    if (closure_of[id] < 0) continue;
    const auto k = static_cast<std::size_t>(closure_of[id]);
    const Closure& c = model.closures()[k];
    const int at = rows[id]++;
    if (c.type == ClosureType::kDistance) {
      const Vector3 a = anchor(c.body_a, c.X_AC), b = anchor(c.body_b, c.X_BC);
      closures[k].force.force = d->efc_force[row] * (b - a).normalized();
    } else if (at < 3) {
      // The force acts on MuJoCo's first body, which is A except for closures with the world.
      closures[k].force.force[at] = (c.body_a == 0 ? 1.0 : -1.0) * d->efc_force[row];
    }
    if (at == 0) closures[k].position = 0.5 * (anchor(c.body_a, c.X_AC) + anchor(c.body_b, c.X_BC));
  }
}

/// Anchor of a closure in W, at the start of the step.
Vector3 Mujoco::Impl::anchor(int body, const Pose& X_BC) const {
  const Eigen::Map<const Eigen::Matrix<mjtNum, 3, 3, Eigen::RowMajor>> R(d->xmat + 9 * body);
  return vector(d->xpos + 3 * body) + R * X_BC.translation;
}

/// Computes kinematics, velocities and inertias of the current state, without contacts and their
/// forces.
void Mujoco::Impl::look() {
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_comVel(m, d);
#if mjVERSION_HEADER >= 333
  mj_makeM(m, d);
#else
  mj_crb(m, d);
#endif
}

Mujoco::Mujoco(const Scene& scene, MujocoSettings settings)
    : impl_(std::make_unique<Impl>(scene, settings)) {}
Mujoco::~Mujoco() = default;

void Mujoco::set_time_step(double h) { impl_->set_time_step(h); }
void Mujoco::set_state(const State& state) { impl_->set_state(State(state)); }
const State& Mujoco::state() const { return impl_->state; }
MujocoStep Mujoco::step(const Input& input) { return impl_->step(input); }
std::string Mujoco::run(long count) { return impl_->run(count); }
void Mujoco::finish_run() {
  impl_->read_state();
  impl_->forces_read = true;
}

std::string Mujoco::step_from(MujocoMoment& moment) {
  const mjModel* m = impl_->m;
  const mjData* d = impl_->d;
  moment.qpos.assign(d->qpos, d->qpos + m->nq);
  moment.qvel.assign(d->qvel, d->qvel + m->nv);
  std::string failure = impl_->run(1);
  moment.qacc.assign(d->qacc, d->qacc + m->nv);
  return failure;
}

void Mujoco::run_inverse(const MujocoMoment* moments, std::size_t count) {
  mjData* d = impl_->d;
  for (std::size_t i = 0; i < count; ++i) {
    std::copy(moments[i].qpos.begin(), moments[i].qpos.end(), d->qpos);
    std::copy(moments[i].qvel.begin(), moments[i].qvel.end(), d->qvel);
    std::copy(moments[i].qacc.begin(), moments[i].qacc.end(), d->qacc);
    mj_inverse(impl_->m, d);
  }
}

Mujoco::InverseForces Mujoco::inverse_forces() const {
  const mjData* d = impl_->d;
  InverseForces forces;
  for (int i = 0; i < impl_->m->nv; ++i) {
    forces.applied = std::max(forces.applied, std::abs(d->qfrc_inverse[i]));
    forces.scale =
        std::max({forces.scale, std::abs(d->qfrc_constraint[i]), std::abs(d->qfrc_bias[i])});
  }
  return forces;
}

mjModel* Mujoco::own_model() const { return impl_->m; }
mjData* Mujoco::own_data() const { return impl_->d; }

std::size_t Mujoco::memory() const {
#if mjVERSION_HEADER >= 300
  return static_cast<std::size_t>(impl_->m->nbuffer + impl_->d->nbuffer) +
         static_cast<std::size_t>(impl_->d->maxuse_arena);
#else
  return static_cast<std::size_t>(impl_->m->nbuffer + impl_->d->nbuffer) +
         static_cast<std::size_t>(impl_->d->maxuse_stack) * sizeof(mjtNum);
#endif
}

const std::vector<ContactForce>& Mujoco::contacts() const {
  impl_->read_forces();
  return impl_->contacts;
}

const std::vector<ClosureForce>& Mujoco::closures() const {
  impl_->read_forces();
  return impl_->closures;
}

std::vector<Pose> Mujoco::poses() const {
  impl_->read_forces();  // needs the poses at the start of the step
  return poses_of(impl_->m, impl_->d);
}

std::vector<Motion> Mujoco::velocities() const {
  impl_->read_forces();
  impl_->look();
  std::vector<Motion> V;
  for (int i = 0; i < impl_->m->nbody; ++i) {
    mjtNum v[6];
    mj_objectVelocity(impl_->m, impl_->d, mjOBJ_XBODY, i, v, 0);
    V.push_back({vector(v), vector(v + 3)});
  }
  return V;
}

double Mujoco::energy() const {
  impl_->read_forces();
  impl_->look();
  const int flags = impl_->m->opt.enableflags;
  impl_->m->opt.enableflags |= mjENBL_ENERGY;
  mj_energyPos(impl_->m, impl_->d);
  mj_energyVel(impl_->m, impl_->d);
  impl_->m->opt.enableflags = flags;
  return impl_->d->energy[0] + impl_->d->energy[1];
}

MatrixX Mujoco::mass_matrix() const {
  impl_->read_forces();
  impl_->look();
  // Column by column, because the storage of M depends on the version of MuJoCo.
  const int n = impl_->m->nv;
  MatrixX M(n, n);
  VectorX unit = VectorX::Zero(n);
  for (int i = 0; i < n; ++i) {
    unit[i] = 1.0;
    mj_mulM(impl_->m, impl_->d, M.col(i).data(), unit.data());
    unit[i] = 0.0;
  }
  return M;
}

}  // namespace counterpoint::peers
