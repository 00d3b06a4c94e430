#include "world.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "archive.h"
#include "counterpoint/engine/batch.h"

namespace counterpoint::apps::tasks {
namespace {

class LoneWorld : public World {
 public:
  int rank() const override { return 0; }
  int size() const override { return 1; }
  int cores() const override { return available_cores(); }
  std::string name() const override { return "this process"; }
  void send(int, Channel, std::string) override {}
  std::optional<Message> receive(Channel) override { return {}; }
};

/// Message of a rank in agree().
struct Standing {
  std::string error;
  bool bad_input = false;
  template <class Archive>
  void serialize(Archive& a) {
    a(error, bad_input);
  }
};

}  // namespace

std::unique_ptr<World> lone_world() { return std::make_unique<LoneWorld>(); }

Message World::wait(Channel channel) {
  constexpr auto kShortest = std::chrono::microseconds(20),
                 kLongest = std::chrono::microseconds(1000);
  for (auto pause = kShortest;; pause = std::min(2 * pause, kLongest)) {
    if (auto message = receive(channel)) return std::move(*message);
    std::this_thread::sleep_for(pause);
  }
}

void agree(World& world, const std::string& error, bool bad_input) {
  Standing mine{error, bad_input};
  if (!world.is_root()) {
    if (!error.empty()) mine.error = fmt::format("{}: {}", world.name(), error);
    world.send(0, Channel::kTogether, to_bytes(mine));
    mine = from_bytes<Standing>(world.wait(Channel::kTogether).bytes);
  } else {
    std::vector<Standing> all(static_cast<std::size_t>(world.size()));
    all[0] = mine;
    for (int i = 1; i < world.size(); ++i) {
      const Message message = world.wait(Channel::kTogether);
      all[static_cast<std::size_t>(message.from)] = from_bytes<Standing>(message.bytes);
    }
    const auto first =
        std::find_if(all.begin(), all.end(), [](const Standing& s) { return !s.error.empty(); });
    if (first != all.end()) mine = *first;
    for (int i = 1; i < world.size(); ++i) world.send(i, Channel::kTogether, to_bytes(mine));
  }
  if (!mine.error.empty()) throw WorldFailed(mine.error, mine.bad_input);
}

std::string broadcast(World& world, std::string bytes) {
  if (!world.is_root()) return world.wait(Channel::kTogether).bytes;
  for (int i = 1; i < world.size(); ++i) world.send(i, Channel::kTogether, bytes);
  return bytes;
}

}  // namespace counterpoint::apps::tasks
