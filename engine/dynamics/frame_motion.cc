#include "counterpoint/engine/dynamics/frame_motion.h"

#include <fmt/format.h>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/files/edit_distance.h"

namespace counterpoint {
namespace {

[[noreturn]] void throw_unknown(const Model& model, const std::string& name) {
  const Frame* best = nullptr;
  int least = 0;
  for (const Frame& frame : model.frames()) {
    const int distance = edit_distance(name, frame.name);
    if (best && distance >= least) continue;
    best = &frame;
    least = distance;
  }
  std::string hint = "; the model has none";
  if (best) hint = fmt::format("; did you mean \"{}\"?", best->name);
  throw InputError(fmt::format("no link or frame is called \"{}\"{}", name, hint));
}

Data motion_data(const Model& model, const State& state) {
  if (state.q.size() != model.nq() || state.v.size() != model.nv())
    throw InputError(
        fmt::format("state of {} coordinates and {} velocities for a model of {} and {}",
                    state.q.size(), state.v.size(), model.nq(), model.nv()));
  Data data(model);
  compute_poses(model, state.q, data);
  compute_velocities(model, state.v, data);
  return data;
}

FrameMotion motion_of(const Frame& frame, const Data& data) {
  const Pose& X_WB = data.X_WB[frame.body];
  const Motion& V = data.V[frame.body];
  return {X_WB * frame.X_BF, V.at(X_WB.rotation * frame.X_BF.translation), V.angular};
}

}  // namespace

FrameMotion frame_motion(const Model& model, const State& state, const std::string& name) {
  const int index = model.find_frame(name);
  if (index < 0) throw_unknown(model, name);
  return motion_of(model.frames()[index], motion_data(model, state));
}

std::vector<FrameMotion> frame_motions(const Model& model, const State& state) {
  const Data data = motion_data(model, state);
  std::vector<FrameMotion> out;
  out.reserve(model.frames().size());
  for (const Frame& frame : model.frames()) out.push_back(motion_of(frame, data));
  return out;
}

}  // namespace counterpoint
