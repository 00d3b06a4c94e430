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

/// Does nothing; MuJoCo's default writes a file.
void on_warning(const char*) {}

}  // namespace

void keep_quiet() {
  mju_user_error = on_error;
  mju_user_warning = on_warning;
}

std::string guarded_step(const mjModel* m, mjData* d) { return guarded_steps(m, d, 1); }

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

const char* implicit_integrator() {
#if mjVERSION_HEADER >= 235
  return "implicitfast";
#else
  return "implicit";
#endif
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
