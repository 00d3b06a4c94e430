// A simulation that runs while pages watch it, and obeys one of them (docs/reference/live.md).
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/engine/sensors/sensor_table.h"
#include "counterpoint/engine/simulator.h"
#include "live/ghost.h"
#include "live/history.h"
#include "live/inputs/hand.h"
#include "live/inputs/sliders.h"
#include "live/picture.h"
#include "live/protocol.h"
#include "live/server.h"
#include "live/takes.h"
#include "live/viewer.h"

namespace counterpoint::live {

struct SessionOptions {
  ServerOptions server;
  std::string scene_file;
  std::vector<std::string> scene_words;  ///< argument and options of the scene on a command line
  std::map<std::string, std::filesystem::path> packages = {};  ///< see SceneOverrides
  std::string record;                                          ///< file of recordings; empty: none
  bool paused = false;                                         ///< wait for the page's play button
  double duration = 0.0;                                       ///< end at this time [s]; 0: never
};

/// Events that wait for the engine's thread.
class Inbox {
 public:
  /// Called on the server's thread. Messages beyond kMost are dropped.
  void put(Event event);
  /// Returns all events, after waiting for one for at most `seconds` [s].
  std::deque<Event> take(double seconds);

 private:
  static constexpr size_t kMost = 10000;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Event> events_;
};

/// Figures of the steps since the last status.
struct Pace {
  long steps = 0, newton_iterations = 0, contacts = 0, rows = 0;
  long frames = 0;
  double frame_seconds = 0.0;  ///< for making and encoding the frames
  double simulated = 0.0;      ///< [s]
  double since = 0.0;          ///< wall clock [s]
  PhaseTimes phases;
};

/// Interval of statuses [s].
inline constexpr double kStatusInterval = 0.1;

class Session {
 public:
  /// Starts the server. @throws InputError as Server does, and where the page cannot be made.
  Session(Scene scene, SessionOptions options);

  const std::string& address() const { return server_->address(); }
  /// Runs until `stop` returns true, asked every 50 ms at least, or the duration is over.
  void run(const std::function<bool()>& stop);

  const Simulator& simulator() const { return simulator_; }
  const Takes& takes() const { return takes_; }
  long steps() const { return steps_; }

 private:
  using Json = nlohmann::ordered_json;

  void handle(const Event& event);
  void obey(const Command& command);
  void say(long client, const std::string& words);
  void change_option(const Command& command);
  void begin_from(const State& state);
  void go_to(const State& state);
  void start_again();
  void begin_take();
  void begin_ghost();
  void begin_sensors();
  bool read_sensors();

  void set_playing(bool playing);
  void play();
  void step();
  void set_inputs();

  void publish();
  Json status();
  Json settings() const;
  void send_status();
  std::string command() const;

  SessionOptions options_;
  Simulator simulator_;
  const SimulationOptions first_options_;  ///< options of the scene as it was read
  Hand hand_;
  Picture picture_;
  History history_;
  Takes takes_;
  std::unique_ptr<Ghost> ghost_;  ///< if it is on
  Inbox inbox_;
  std::deque<Event> events_;  ///< taken from the inbox and not yet handled
  std::vector<State> saved_;
  std::vector<std::pair<std::string, std::string>> changes_;  ///< options set by pages, in order
  Wanted wanted_;
  std::vector<long> clients_;  ///< pages; the first one drives
  int steps_to_go_ = 0;        ///< steps that a page has asked for
  bool playing_ = false, started_ = false, after_step_ = false;
  double speed_ = 1.0;
  double anchor_wall_ = 0.0, anchor_time_ = 0.0;  ///< wall clock and time of the scene [s]
  double next_frame_ = 0.0, next_status_ = 0.0;   ///< wall clock [s]
  bool frame_wanted_ = true, status_wanted_ = true;
  Pace pace_, last_pace_;
  StepReport report_;                   ///< report of the last step
  State before_;                        ///< q, v and z before that step
  std::optional<SensorTable> sensors_;  ///< if the scene has sensors, and all of them a value
  VectorX sensor_values_;
  EffectCounts counted_;
  long steps_ = 0, softened_ = 0, unfinished_ = 0;
  std::string fault_;
  std::unique_ptr<Server> server_;  ///< last, so that it ends first
};

}  // namespace counterpoint::live
