#include "mujoco.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/collision/collider.h"
#include "mjcf.h"
#include "mujoco_calls.h"

namespace counterpoint::peers {
namespace {

Vector3 vector(const mjtNum* p) { return {p[0], p[1], p[2]}; }

void copy(const Vector3& v, mjtNum* out) { std::copy(v.data(), v.data() + 3, out); }

}  // namespace

std::string mujoco_version() { return mj_versionString(); }

struct Mujoco::Impl {
  Impl(const Scene& scene, MujocoSettings settings) : model(scene.model), on(effects_of(scene)) {
    keep_quiet();
    document = mjcf(scene, settings, implicit_integrator());
    body_of_line = document.find('\n') + 1;
    max_contacts = 100 + static_cast<int>(model.geometries().size());
    time_step = scene.options.time_step;
    build();
    set_state({0.0, scene.q, scene.v});
  }
  ~Impl() { clear(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void clear() {
    mj_deleteData(d);
    mj_deleteModel(m);
    d = nullptr;
    m = nullptr;
  }

  /// Compiles with room for max_contacts.
  void build() {
    clear();
    m = compile_with_room();
    number_alike();
    set_closures();
    set_drag();
    m->opt.timestep = time_step;
    d = mj_makeData(m);
    if (!d) throw NotExpressible("MuJoCo has not enough memory for it");
  }

  /// MuJoCo tries a step when it compiles, and that may take more stack than was guessed.
  mjModel* compile_with_room() {
    for (;;) {
      std::string sized = document;
      sized.insert(body_of_line, size_element());
      try {
        return compile(sized);
      } catch (const NotExpressible& reason) {
        if (!lacks_stack(reason.what())) throw;
        stack_factor *= 2.0;
      }
    }
  }

  static bool lacks_stack(const std::string& message) {
    return message.find("tack overflow") != std::string::npos;
  }

  /// Room for what a step needs, as MuJoCo's own guess of the stack does not fit large scenes.
  std::string size_element() const {
    double rows = 100.0 + 4.0 * max_contacts + 6.0 * static_cast<double>(model.mimics().size());
    for (const Closure& c : model.closures()) rows += c.type == ClosureType::kBall ? 3 : 6;
    for (int i = 0; i < model.num_joints(); ++i) {
      const JointInfo& joint = model.joint(i);
      rows += std::isfinite(joint.lower) + std::isfinite(joint.upper);
    }
    rows += static_cast<double>((model.dry_friction().array() > 0.0).count());
    const double nv = model.nv();
    // A few dense matrices of the solver, and the Jacobian twice.
    const double stack =
        stack_factor * (1e6 + 6.0 * nv * nv + 2.0 * rows * nv + 200.0 * (rows + nv));
#if mjVERSION_HEADER >= 300
    return fmt::format("<size memory='{:.0f}M'/>\n", 1.0 + 2.0 * stack * sizeof(mjtNum) / 1e6);
#else
    if (stack > std::numeric_limits<int>::max())
      throw NotExpressible("MuJoCo cannot count the memory that it needs for this");
    return fmt::format("<size nconmax='{}' njmax='{:.0f}' nstack='{:.0f}'/>\n", max_contacts, rows,
                       stack);
#endif
  }

  void number_alike() {
    for (int i = 1; i < model.num_bodies(); ++i) {
      if (mj_name2id(m, mjOBJ_BODY, fmt::format("b{}", i).c_str()) != i)
        throw NotExpressible("MuJoCo numbers its bodies otherwise");
    }
    if (m->nq != model.nq() || m->nv != model.nv())
      throw NotExpressible("MuJoCo counts its coordinates otherwise");
    geometry_of.assign(static_cast<std::size_t>(m->ngeom), -1);
    for (std::size_t i = 0; i < model.geometries().size(); ++i) {
      const int id = mj_name2id(m, mjOBJ_GEOM, fmt::format("g{}", i).c_str());
      if (id >= 0) geometry_of[static_cast<std::size_t>(id)] = static_cast<int>(i);
    }
  }

  /// What MJCF would take from the start: the second anchors, and the lengths of rods.
  void set_closures() {
    closure_of.assign(static_cast<std::size_t>(m->neq), -1);
    for (std::size_t i = 0; on.has(Effect::kClosures) && i < model.closures().size(); ++i) {
      const Closure& c = model.closures()[i];
      const int id = mj_name2id(m, mjOBJ_EQUALITY, fmt::format("c{}", i).c_str());
      closure_of[static_cast<std::size_t>(id)] = static_cast<int>(i);
      mjtNum* data = m->eq_data + id * mjNEQDATA;
      if (c.type == ClosureType::kBall) {
        const bool swapped = c.body_a == 0;
        copy(swapped ? c.X_BC.translation : c.X_AC.translation, data);
        copy(swapped ? c.X_AC.translation : c.X_BC.translation, data + 3);
      }
      if (c.type == ClosureType::kDistance) {
        const int tendon = mj_name2id(m, mjOBJ_TENDON, fmt::format("t{}", i).c_str());
        data[0] = c.length - m->tendon_length0[tendon];
      }
    }
  }

  /// Linear drag of a free body about its origin is damping of its joint.
  void set_drag() {
    if (!on.has(Effect::kDrag)) return;
    for (const BodyDrag& drag : model.drags()) {
      mjtNum* damping = m->dof_damping + model.body(drag.body).v_index;
      for (int i = 0; i < 3; ++i) {
        damping[i] += drag.drag.linear;
        damping[3 + i] += drag.drag.angular;
      }
    }
  }

  void set_state(const State& to) {
    mj_resetData(m, d);
    state = to;
    d->time = to.time;
    std::copy(to.q.begin(), to.q.end(), d->qpos);
    std::copy(to.v.begin(), to.v.end(), d->qvel);
    for (int i = 1; i < model.num_bodies(); ++i) {
      const Body& body = model.body(i);
      if (!is_free(body)) continue;
      // In the world's axes; ours are those of the joint's frame.
      const Pose X_WB = joint_pose(body.X_PJ, body.joint_type, to.q.data() + body.q_index);
      const Quaternion turn(X_WB.rotation);
      mjtNum* q = d->qpos + body.q_index;
      copy(X_WB.translation, q);
      q[3] = turn.w(), q[4] = turn.x(), q[5] = turn.y(), q[6] = turn.z();
      copy(body.X_PJ.rotation * to.v.segment<3>(body.v_index), d->qvel + body.v_index);
    }
  }

  void read_state() {
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

  void apply(const Input& input) {
    mju_zero(d->qfrc_applied, m->nv);
    mju_zero(d->xfrc_applied, 6 * m->nbody);
    for (int i = 1; i < model.num_bodies() && input.applied_force.size() > 0; ++i) {
      const Body& body = model.body(i);
      const double limit = model.joint(i - 1).effort_limit;
      // With a servo the limit is that of both together: see the controls below.
      const bool cut = on.has(Effect::kEffortLimits) && model.find_servo(i - 1) < 0;
      for (int k = 0; k < joint_nv(body.joint_type); ++k) {
        const double u = input.applied_force[body.v_index + k];
        d->qfrc_applied[body.v_index + k] = cut ? std::clamp(u, -limit, limit) : u;
      }
      if (is_free(body)) {
        copy(body.X_PJ.rotation * vector(d->qfrc_applied + body.v_index),
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
      // MuJoCo takes them at the centre of mass.
      const Vector3 arm =
          anchor(w.body, {Matrix3::Identity(), w.point}) - vector(d->xipos + 3 * w.body);
      const Vector3 torque = w.wrench.torque + arm.cross(w.wrench.force);
      mju_addTo3(d->xfrc_applied + 6 * w.body, w.wrench.force.data());
      mju_addTo3(d->xfrc_applied + 6 * w.body + 3, torque.data());
    }
  }

  /// How often MuJoCo warned of this since the last reset.
  bool warned(std::initializer_list<mjtWarning> kinds) const {
    return std::any_of(kinds.begin(), kinds.end(),
                       [&](mjtWarning kind) { return d->warning[kind].number > 0; });
  }

  std::string try_step(const Input& input) {
    apply(input);
    const std::string error = guarded_step(m, d);
    if (!error.empty()) return "MuJoCo: " + error;
    if (warned({mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC}))
      return "MuJoCo: not finite or beyond 1e10, it starts anew";
    return {};
  }

  /// Did the step lack room that more memory gives? Asks for twice as much then.
  bool needs_room(const std::string& failure) {
    if (lacks_stack(failure)) {
      stack_factor *= 2.0;
      return true;
    }
    if (!failure.empty() || !warned({mjWARN_CONTACTFULL, mjWARN_CNSTRFULL})) return false;
    max_contacts *= 2;
    return true;
  }

  MujocoStep step(const Input& input) {
    constexpr int kMostTries = 12;
    const std::vector<mjtNum> warm(d->qacc_warmstart, d->qacc_warmstart + m->nv);
    MujocoStep report;
    report.failure = try_step(input);
    for (int tries = 0; tries < kMostTries && needs_room(report.failure); ++tries) {
      build();
      set_state(State(state));
      std::copy(warm.begin(), warm.end(), d->qacc_warmstart);
      report.failure = try_step(input);
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

  std::string run(long count) {
    apply({});
    const std::string error = guarded_steps(m, d, count);
    if (!error.empty()) return "MuJoCo: " + error;
    if (warned({mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC}))
      return "MuJoCo: not finite or beyond 1e10, it starts anew";
    if (warned({mjWARN_CONTACTFULL, mjWARN_CNSTRFULL})) return "MuJoCo: too many contacts";
    return {};
  }

  int iterations() const {
#if mjVERSION_HEADER >= 300
    const int islands = std::clamp(d->nisland, 1, static_cast<int>(mjNISLAND));
    return *std::max_element(d->solver_niter, d->solver_niter + islands);
#else
    return d->solver_iter;
#endif
  }

  void read_forces() {
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

  void read_closure_forces() {
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
        // On MuJoCo's first body, which is ours but for closures with the world.
        closures[k].force.force[at] = (c.body_a == 0 ? 1.0 : -1.0) * d->efc_force[row];
      }
      if (at == 0)
        closures[k].position = 0.5 * (anchor(c.body_a, c.X_AC) + anchor(c.body_b, c.X_BC));
    }
  }

  /// In W, at the start of the step.
  Vector3 anchor(int body, const Pose& X_BC) const {
    const Eigen::Map<const Eigen::Matrix<mjtNum, 3, 3, Eigen::RowMajor>> R(d->xmat + 9 * body);
    return vector(d->xpos + 3 * body) + R * X_BC.translation;
  }

  /// Everything of the state as it is now that does not touch contacts and their forces.
  void look() {
    mj_kinematics(m, d);
    mj_comPos(m, d);
    mj_comVel(m, d);
#if mjVERSION_HEADER >= 330
    mj_makeM(m, d);
#else
    mj_crb(m, d);
#endif
  }

  Model model;
  EffectSet on;
  std::string document;
  std::size_t body_of_line = 0;
  int max_contacts = 0;
  double stack_factor = 1.0;
  double time_step = 0.0;
  mjModel* m = nullptr;
  mjData* d = nullptr;
  State state;
  bool forces_read = true;
  std::vector<ContactForce> contacts;
  std::vector<ClosureForce> closures;
  std::vector<int> geometry_of, closure_of;  ///< by MuJoCo's index: ours
};

Mujoco::Mujoco(const Scene& scene, MujocoSettings settings)
    : impl_(std::make_unique<Impl>(scene, settings)) {}
Mujoco::~Mujoco() = default;

void Mujoco::set_time_step(double h) { impl_->m->opt.timestep = impl_->time_step = h; }
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
  impl_->read_forces();  // they need the poses at the start of the step
  mj_kinematics(impl_->m, impl_->d);
  std::vector<Pose> X_WB;
  for (int i = 0; i < impl_->m->nbody; ++i) {
    const Eigen::Map<const Eigen::Matrix<mjtNum, 3, 3, Eigen::RowMajor>> R(impl_->d->xmat + 9 * i);
    X_WB.push_back({R, vector(impl_->d->xpos + 3 * i)});
  }
  return X_WB;
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
  // Column by column: how MuJoCo stores it depends on the version.
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
