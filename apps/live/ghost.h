// The same scene at a finer setting, run on a thread of its own behind a live session: what the
// session's setting loses.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "counterpoint/engine/simulator.h"
#include "live/protocol.h"

namespace counterpoint::live {

/// Steps of the ghost for one of the session.
inline constexpr int kFinerSteps = 4;

class Ghost {
 public:
  /// Starts at a state. Its contacts are the scene's, or those of the default preset if the scene's
  /// are softer. Its steps are kFinerSteps times shorter.
  Ghost(Scene scene, const State& start);
  ~Ghost();
  Ghost(const Ghost&) = delete;
  Ghost& operator=(const Ghost&) = delete;

  /// Follows a step of the session, of h [s] under `input`.
  void follow(double h, const Input& input);
  /// Asks for a frame at the end of the last step followed, where the session has these poses.
  void compare(double time, std::vector<Pose> poses);

  /// Returns the newest frame that was asked for, once.
  std::optional<Frame> take_frame();
  double behind() const { return behind_; }  ///< time that the session is ahead [s]
  double distance() const {
    return distance_;
  }  ///< the largest of any body, at the newest frame [m]
  /// Whether it has ended, since a step failed or it was kMostBehind steps behind.
  bool ended() const { return ended_; }

  static constexpr size_t kMostBehind = 20'000;

 private:
  /// A step to follow, or poses to compare with.
  struct Task {
    double h = 0.0;  ///< [s]
    Input input;
    std::optional<double> time;  ///< time of `poses` [s]
    std::vector<Pose> poses;
  };

  void put(Task task);
  void run();
  bool step(const Task& task);
  void make_frame(const Task& task);

  Simulator simulator_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Task> tasks_;
  std::optional<Frame> frame_;
  std::atomic<double> behind_ = 0.0, distance_ = 0.0;
  std::atomic<bool> ended_ = false;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace counterpoint::live
