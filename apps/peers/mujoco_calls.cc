#include "mujoco_calls.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "not_expressible.h"

namespace counterpoint::peers {
namespace {

// MuJoCo reports errors to a function that must not return. MuJoCo is written in C, so longjmp
// skips no destructors.
thread_local std::jmp_buf* escape = nullptr;
thread_local char error_message[500];

void on_error(const char* message) {
  std::snprintf(error_message, sizeof error_message, "%s", message);
  if (escape) std::longjmp(*escape, 1);
  std::fprintf(stderr, "MuJoCo: %s\n", message);
  std::abort();
}

/// The integrator that is implicit in velocity and most accurate in this version.
#if mjVERSION_HEADER >= 235
constexpr int kMostAccurate = mjINT_IMPLICITFAST;
#else
constexpr int kMostAccurate = mjINT_IMPLICIT;
#endif

/// Does nothing; MuJoCo's default writes a file.
void on_warning(const char*) {}

}  // namespace

void keep_quiet() {
  mju_user_error = on_error;
  mju_user_warning = on_warning;
}

std::string guarded_steps(const mjModel* m, mjData* d, long count) {
  std::jmp_buf here;
  escape = &here;
  if (setjmp(here) != 0) {
    escape = nullptr;
    return error_message;
  }
  for (long i = 0; i < count; ++i) mj_step(m, d);
  escape = nullptr;
  return {};
}

void apply_settings(const MujocoSettings& settings, mjModel* m) {
  mjOption usual;
  mj_defaultOption(&usual);
  mjtNum reference[mjNREF], impedance[mjNIMP];
  mj_defaultSolRefImp(reference, impedance);
  mjOption& option = m->opt;
  constexpr int kIntegrators[] = {mjINT_EULER, mjINT_RK4, kMostAccurate};
  option.integrator = kIntegrators[static_cast<int>(settings.integrator)];
  option.cone = settings.elliptic ? mjCONE_ELLIPTIC : usual.cone;
  option.impratio = settings.impratio;
  option.noslip_iterations = settings.noslip_iterations;
  if (settings.tight) {
    option.tolerance = option.noslip_tolerance = 1e-12;
    option.iterations = 1000;
  }
  if (settings.solref_steps > 0.0) reference[0] = settings.solref_steps * option.timestep;
  // Unless told otherwise, MuJoCo takes no time constant below two steps.
  if (settings.solref_steps > 0.0 && settings.solref_steps < 2.0)
    option.disableflags |= mjDSBL_REFSAFE;
  if (settings.impedance > 0.0) impedance[0] = impedance[1] = settings.impedance;
#if mjVERSION_HEADER >= 3012000
  if (settings.exact_diagonal) option.enableflags |= mjENBL_DIAGEXACT;
#endif
  const auto soften = [&](int count, mjtNum* solref, mjtNum* solimp) {
    for (int i = 0; i < count; ++i) {
      std::copy(reference, reference + mjNREF, solref + i * mjNREF);
      std::copy(impedance, impedance + mjNIMP, solimp + i * mjNIMP);
    }
  };
  soften(m->ngeom, m->geom_solref, m->geom_solimp);
  soften(m->npair, m->pair_solref, m->pair_solimp);
  soften(m->neq, m->eq_solref, m->eq_solimp);
  soften(m->njnt, m->jnt_solref, m->jnt_solimp);
  soften(m->nv, m->dof_solref, m->dof_solimp);
}

std::vector<Pose> poses_of(const mjModel* m, mjData* d) {
  mj_kinematics(m, d);
  std::vector<Pose> X_WB;
  for (int i = 0; i < m->nbody; ++i) {
    using RowMajor = Eigen::Matrix<mjtNum, 3, 3, Eigen::RowMajor>;
    X_WB.push_back(
        {Eigen::Map<const RowMajor>(d->xmat + 9 * i), Eigen::Map<const Vector3>(d->xpos + 3 * i)});
  }
  return X_WB;
}

mjModel* compile(const std::string& document) {
  char error[1000] = "";
  auto vfs = std::make_unique<mjVFS>();
  mj_defaultVFS(vfs.get());
  const int size = static_cast<int>(document.size());
#if mjVERSION_HEADER >= 300
  mj_addBufferVFS(vfs.get(), "scene.xml", document.data(), size);
#else
  mj_makeEmptyFileVFS(vfs.get(), "scene.xml", size);
  std::memcpy(vfs->filedata[mj_findFileVFS(vfs.get(), "scene.xml")], document.data(),
              document.size());
#endif
  mjModel* model = mj_loadXML("scene.xml", vfs.get(), error, sizeof error);
  mj_deleteVFS(vfs.get());
  if (!model) {
    std::string reason = error;
    while (!reason.empty() && reason.back() == '\n') reason.pop_back();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    throw NotExpressible("MuJoCo does not compile it: " + reason);
  }
  return model;
}

}  // namespace counterpoint::peers
