// Shows states in a browser while a program computes them (docs/reference/live.md).
//
//   live::Viewer viewer(simulator.scene());
//   std::cout << viewer.address() << std::endl;
//   while (...) {
//     simulator.step();
//     viewer.show(simulator);
//   }
#pragma once

#include <memory>
#include <string>

#include "counterpoint/engine/simulator.h"

namespace counterpoint::live {

struct ServerOptions {
  std::string host = "127.0.0.1";  ///< address to listen at
  int port = 0;                    ///< 0: any free one
  bool any_port = false;           ///< any free one if `port` is taken
};

class [[gnu::visibility("default")]] Viewer {
 public:
  /// Starts the server, on a thread of its own. scene_file: for the visuals of its robots; may be
  /// empty. @throws InputError if the address cannot be listened at, and if this build has no
  /// pages.
  explicit Viewer(Scene scene, const std::string& scene_file = "",
                  const ServerOptions& server = {});
  ~Viewer();
  Viewer(Viewer &&) noexcept;
  Viewer& operator=(Viewer&&) noexcept;

  const std::string& address() const;  ///< address of the page
  int pages() const;                   ///< number of pages that look at present

  /// Whether a frame is due: a page looks, and the last frame is a 60th of a second old.
  bool due() const;
  /// Sends a frame if one is due or `always` is true, and returns whether it did, at once. A state
  /// that is not later than the last one undoes what pages have from its time on.
  bool show(const State& state, bool always = false);
  /// Does the same with the state of a simulator, its input, and the forces of its closures.
  bool show(Simulator & simulator, bool always = false);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::live
