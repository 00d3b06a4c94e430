#include "mujoco_file.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "mujoco_calls.h"
#include "not_expressible.h"

namespace counterpoint::peers {
namespace {

struct Free {
  void operator()(mjModel* m) const { mj_deleteModel(m); }
  void operator()(mjData* d) const { mj_deleteData(d); }
};

/// A loaded file with its data.
struct Loaded {
  std::unique_ptr<mjModel, Free> m;
  std::unique_ptr<mjData, Free> d;
};

Loaded load(const std::string& path) {
  keep_quiet();
  char error[1000] = "";
  Loaded out;
  out.m.reset(mj_loadXML(path.c_str(), nullptr, error, sizeof error));
  if (!out.m) throw NotExpressible(fmt::format("{}: {}", path, error));
  out.d.reset(mj_makeData(out.m.get()));
  if (!out.d) throw NotExpressible(path + ": MuJoCo has not enough memory for it");
  return out;
}

}  // namespace

std::vector<Pose> play_mjcf(const std::string& path, double seconds) {
  const auto [m, d] = load(path);
  if (m->nkey > 0) mj_resetDataKeyframe(m.get(), d.get(), 0);
  const std::string failure =
      guarded_steps(m.get(), d.get(), std::lround(seconds / m->opt.timestep));
  if (!failure.empty()) throw NotExpressible(fmt::format("{}: {}", path, failure));
  return poses_of(m.get(), d.get());
}

MjcfReadings read_mjcf_sensors(const std::string& path, const VectorX& q, const VectorX& v,
                               double control) {
  const auto [m, d] = load(path);
  if (q.size() != m->nq || v.size() != m->nv)
    throw NotExpressible(fmt::format("{}: a state of {} and {} numbers; MuJoCo has {} and {}", path,
                                     q.size(), v.size(), m->nq, m->nv));
  std::copy_n(q.data(), q.size(), d->qpos);
  std::copy_n(v.data(), v.size(), d->qvel);
  std::fill_n(d->ctrl, m->nu, control);
  mj_forward(m.get(), d.get());
  MjcfReadings out;
  out.acceleration = Eigen::Map<const VectorX>(d->qacc, m->nv);
  for (int i = 0; i < m->nsensor; ++i)
    out.sensors[mj_id2name(m.get(), mjOBJ_SENSOR, i)] =
        Eigen::Map<const VectorX>(d->sensordata + m->sensor_adr[i], m->sensor_dim[i]);
  return out;
}

}  // namespace counterpoint::peers
