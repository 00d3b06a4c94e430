#include "live/viewer.h"

#include <atomic>

#include "counterpoint/engine/clocks.h"
#include "live/page.h"
#include "live/picture.h"
#include "live/server.h"

namespace counterpoint::live {

struct Viewer::Impl {
  Impl(Scene scene_, const std::string& scene_file, const ServerOptions& options)
      : scene(std::move(scene_)), picture(scene.model) {
    const State start{0.0, scene.q, scene.v};
    server = std::make_unique<Server>(
        options,
        [&](const std::string& sources) {
          return live_page({scene, start, scene_file}, picture.curves(start), watching_controls(),
                           sources);
        },
        [this](const Event& event) {
          if (event.kind == Event::Kind::kMessage) return;
          pages += event.kind == Event::Kind::kOpened ? 1 : -1;
          if (event.kind == Event::Kind::kOpened) came = true;
        });
  }

  void send(const State& state, const Shown& shown) {
    came = false;
    next_frame = wall_seconds() + kFrameInterval;
    server->send_frame(0, encode(picture.frame(state, shown)));
  }

  const Scene scene;
  Picture picture;
  double next_frame = 0.0;  ///< wall clock [s]
  std::atomic<int> pages = 0;
  std::atomic<bool> came = false;  ///< a page has come since the last frame
  std::unique_ptr<Server> server;  ///< last, so that it ends first
};

Viewer::Viewer(Scene scene, const std::string& scene_file, const ServerOptions& server)
    : impl_(std::make_unique<Impl>(std::move(scene), scene_file, server)) {}
Viewer::~Viewer() = default;
Viewer::Viewer(Viewer&&) noexcept = default;
Viewer& Viewer::operator=(Viewer&&) noexcept = default;

const std::string& Viewer::address() const { return impl_->server->address(); }

int Viewer::pages() const { return impl_->pages; }

bool Viewer::due() const {
  return impl_->pages > 0 && (impl_->came || wall_seconds() >= impl_->next_frame);
}

bool Viewer::show(const State& state, bool always) {
  if (!always && !due()) return false;
  impl_->send(state, {});
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
  impl_->send(simulator.state(), shown);
  return true;
}

}  // namespace counterpoint::live
