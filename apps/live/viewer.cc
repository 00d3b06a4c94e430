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

void Viewer::show(const State& state, const Shown& shown) {
  if (due()) show_now(state, shown);
}

void Viewer::show_now(const State& state, const Shown& shown) {
  came_ = false;
  next_frame_ = wall_seconds() + kFrameInterval;
  server_->send_frame(0, encode(picture_.frame(state, shown)));
}

}  // namespace counterpoint::live
