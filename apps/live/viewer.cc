#include "live/viewer.h"

#include "counterpoint/engine/clocks.h"
#include "live/page.h"

namespace counterpoint::live {

Viewer::Viewer(Scene scene, const std::string& scene_file, const ServerOptions& server)
    : scene_(std::move(scene)), picture_(scene_.model) {
  const State start{0.0, scene_.q, scene_.v};
  server_ = std::make_unique<Server>(
      server,
      [&](const std::string& sources) {
        return live_page({scene_, start, scene_file}, picture_, watching_controls(), sources);
      },
      [this](const Event& event) {
        if (event.kind == Event::Kind::kMessage) return;
        pages_ += event.kind == Event::Kind::kOpened ? 1 : -1;
        if (event.kind == Event::Kind::kOpened) came_ = true;
      });
}

Viewer::~Viewer() = default;

bool Viewer::due() const { return pages_ > 0 && (came_ || wall_seconds() >= next_frame_); }

bool Viewer::show(const State& state, bool always) {
  if (!always && !due()) return false;
  send(state, {});
  return true;
}

bool Viewer::show(Simulator& simulator, bool always) {
  if (!always && !due()) return false;
  Shown shown{&simulator.input()};
  try {
    if (has_closure_forces(simulator.model(), simulator.options()))
      shown.forces = &simulator.last_forces();
  } catch (const InputError&) {
    // There was no step yet.
  }
  send(simulator.state(), shown);
  return true;
}

void Viewer::send(const State& state, const Shown& shown) {
  came_ = false;
  next_frame_ = wall_seconds() + kFrameInterval;
  server_->send_frame(0, encode(picture_.frame(state, shown)));
}

}  // namespace counterpoint::live
