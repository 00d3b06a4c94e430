#include "mujoco_file.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

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

}  // namespace

std::vector<Pose> play_mjcf(const std::string& path, double seconds) {
  keep_quiet();
  char error[1000] = "";
  const std::unique_ptr<mjModel, Free> m(mj_loadXML(path.c_str(), nullptr, error, sizeof error));
  if (!m) throw NotExpressible(fmt::format("{}: {}", path, error));
  const std::unique_ptr<mjData, Free> d(mj_makeData(m.get()));
  if (!d) throw NotExpressible(path + ": MuJoCo has not enough memory for it");
  if (m->nkey > 0) mj_resetDataKeyframe(m.get(), d.get(), 0);
  const std::string failure =
      guarded_steps(m.get(), d.get(), std::lround(seconds / m->opt.timestep));
  if (!failure.empty()) throw NotExpressible(fmt::format("{}: {}", path, failure));
  return poses_of(m.get(), d.get());
}

}  // namespace counterpoint::peers
