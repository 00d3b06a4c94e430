#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "mjcf.h"
#include "mujoco_calls.h"
#include "mujoco_impl.h"

namespace counterpoint::peers {
Mujoco::Impl::Impl(const Scene& scene, MujocoSettings settings)
    : model(scene.model), on(effects_of(scene)), chosen(settings) {
  keep_quiet();
  document = mjcf(scene);
  body_of_line = document.find('\n') + 1;
  // Enabled here, because the flag's bit depends on the version; options may be given twice.
  if (settings.several_points)
    document.insert(body_of_line, "<option><flag multiccd='enable'/></option>\n");
  max_contacts = 100 + static_cast<int>(model.geometries().size());
  time_step = scene.options.time_step;
  build();
  set_state({0.0, scene.q, scene.v});
}

void Mujoco::Impl::clear() {
  mj_deleteData(d);
  mj_deleteModel(m);
  d = nullptr;
  m = nullptr;
}

/// Compiles the model with room for max_contacts contacts.
void Mujoco::Impl::build() {
  clear();
  m = compile_with_room();
  set_time_step(time_step);
  number_alike();
  set_closures();
  set_servos();
  set_drag();
  d = mj_makeData(m);
  if (!d) throw NotExpressible("MuJoCo has not enough memory for it");
}

void Mujoco::Impl::set_time_step(double h) {
  time_step = h;
  m->opt.timestep = h / chosen.substeps;
  apply_settings(chosen, m);
}

/// Compiles the model. MuJoCo takes a step during compilation, which may need more stack than
/// estimated; then the estimate is doubled.
mjModel* Mujoco::Impl::compile_with_room() {
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

bool Mujoco::Impl::lacks_stack(const std::string& message) {
  return message.find("tack overflow") != std::string::npos;
}

/// Size of arena or stack for a step, because MuJoCo's own estimate is too small for large scenes.
std::string Mujoco::Impl::size_element() const {
  double rows = 100.0 + 4.0 * max_contacts + 6.0 * static_cast<double>(model.mimics().size());
  for (const Closure& c : model.closures()) rows += num_rows(c);
  for (int i = 0; i < model.num_joints(); ++i) {
    const JointInfo& joint = model.joint(i);
    rows += std::isfinite(joint.lower) + std::isfinite(joint.upper);
  }
  rows += static_cast<double>((model.dry_friction().array() > 0.0).count());
  const double nv = model.nv();
  // A few dense matrices of the solver, and the Jacobian twice.
  const double stack = stack_factor * (1e6 + 6.0 * nv * nv + 2.0 * rows * nv + 200.0 * (rows + nv));
#if mjVERSION_HEADER >= 300
  return fmt::format("<size memory='{:.0f}M'/>\n", 1.0 + 2.0 * stack * sizeof(mjtNum) / 1e6);
#else
  if (stack > std::numeric_limits<int>::max())
    throw NotExpressible("MuJoCo cannot count the memory that it needs for this");
  return fmt::format("<size nconmax='{}' njmax='{:.0f}' nstack='{:.0f}'/>\n", max_contacts, rows,
                     stack);
#endif
}

void Mujoco::Impl::number_alike() {
  for (int i = 1; i < model.num_bodies(); ++i) {
    if (mj_name2id(m, mjOBJ_BODY, model.joint(i - 1).link.c_str()) != i)
      throw NotExpressible("MuJoCo numbers its bodies otherwise");
  }
  if (m->nq != model.nq() || m->nv != model.nv())
    throw NotExpressible("MuJoCo counts its coordinates otherwise");
  geometry_of.assign(static_cast<std::size_t>(m->ngeom), -1);
  for (std::size_t i = 0; i < model.geometries().size(); ++i) {
    const int id = mj_name2id(m, mjOBJ_GEOM, model.geometries()[i].name.c_str());
    if (id >= 0) geometry_of[static_cast<std::size_t>(id)] = static_cast<int>(i);
  }
}

/// Sets the second anchors and the lengths of rods, which MJCF would derive from the start pose.
void Mujoco::Impl::set_closures() {
  closure_of.assign(static_cast<std::size_t>(m->neq), -1);
  for (std::size_t i = 0; on.has(Effect::kClosures) && i < model.closures().size(); ++i) {
    const Closure& c = model.closures()[i];
    const int id = mj_name2id(m, mjOBJ_EQUALITY, c.name.c_str());
    closure_of[static_cast<std::size_t>(id)] = static_cast<int>(i);
    mjtNum* data = m->eq_data + id * mjNEQDATA;
    if (c.type == ClosureType::kBall) {
      const bool swapped = c.body_a == 0;
      set_numbers(swapped ? c.X_BC.translation : c.X_AC.translation, data);
      set_numbers(swapped ? c.X_AC.translation : c.X_BC.translation, data + 3);
    }
    if (c.type == ClosureType::kDistance) {
      const int tendon = mj_name2id(m, mjOBJ_TENDON, c.name.c_str());
      data[0] = c.length - m->tendon_length0[tendon];
    }
  }
}

/// Sets the servos: force = control - kp q - kd w, within the effort limit.
void Mujoco::Impl::set_servos() {
  for (int i = 0; i < m->nu; ++i) {
    const double limit =
        model.joint(model.servos()[static_cast<std::size_t>(i)].joint).effort_limit;
    m->actuator_gainprm[i * mjNGAIN] = 1.0;
    m->actuator_biasprm[i * mjNBIAS] = 0.0;
    if (!on.has(Effect::kEffortLimits) || !std::isfinite(limit)) continue;
    m->actuator_forcelimited[i] = 1;
    m->actuator_forcerange[2 * i] = -limit;
    m->actuator_forcerange[2 * i + 1] = limit;
  }
}

/// Sets the linear drag of free bodies about their origin, as damping of their joint.
void Mujoco::Impl::set_drag() {
  if (!on.has(Effect::kDrag)) return;
  for (const BodyDrag& drag : model.drags()) {
    mjtNum* damping = m->dof_damping + model.body(drag.body).v_index;
    for (int i = 0; i < 3; ++i) {
      damping[i] += drag.drag.linear;
      damping[3 + i] += drag.drag.angular;
    }
  }
}

}  // namespace counterpoint::peers
