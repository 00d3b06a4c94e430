// Shows states in a browser while a program computes them: `simulate --live`, cp.live() of Python.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "live/picture.h"
#include "live/server.h"

namespace counterpoint::live {

class Viewer {
 public:
  /// Starts the server. scene_file: for the visuals of its robots; may be empty. @throws InputError
  /// as Server does, and if this build has no pages.
  explicit Viewer(Scene scene, const std::string& scene_file = "",
                  const ServerOptions& server = {});
  ~Viewer();

  const std::string& address() const { return server_->address(); }
  int pages() const { return pages_; }  ///< that look at present

  /// Whether a frame is due: a page looks, and the last frame is kFrameInterval old.
  bool due() const;
  /// Sends a frame if one is due or `always` is true, and returns whether it did, at once. A state
  /// that is not later than the last one undoes what pages have from its time on.
  bool show(const State& state, bool always = false);
  /// Does the same with the state of a simulator, its input, and the forces of its closures.
  bool show(Simulator& simulator, bool always = false);

 private:
  void send(const State& state, const Shown& shown);

  const Scene scene_;
  Picture picture_;
  double next_frame_ = 0.0;  ///< wall clock [s]
  std::atomic<int> pages_ = 0;
  std::atomic<bool> came_ = false;  ///< a page has come since the last frame
  std::unique_ptr<Server> server_;  ///< last, so that it ends first
};

}  // namespace counterpoint::live
