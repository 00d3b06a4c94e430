// The threads of one process, and the tasks that wait for them.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "chunks.h"

namespace counterpoint::apps::tasks {

class Workers {
 public:
  /// `deliver` is called by the threads, for every task; what it throws counts as the task's.
  Workers(int threads, const TaskList& list, std::function<void(std::int64_t, Outcome&&)> deliver);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  void add(const Chunk& chunk);
  /// No more will be added: threads end when nothing waits. `now`: what waits is dropped.
  void close(bool now = false);
  /// Returns when more is wanted, all threads have ended or something was thrown, or after `most`.
  void wait(std::chrono::microseconds most);

  /// Tasks to ask for now: 0 while enough wait. As many as take about a second.
  std::int64_t wanted() const;
  bool ended() const { return running_ == 0; }
  std::int64_t done() const { return done_; }
  int threads() const { return static_cast<int>(threads_.size()); }
  /// What the task of lowest number threw; null: none did.
  std::exception_ptr error() const;

 private:
  void work();
  bool take(std::int64_t& number);
  bool hungry() const;  // with the lock held

  const TaskList& list_;
  std::function<void(std::int64_t, Outcome&&)> deliver_;
  mutable std::mutex mutex_;
  std::condition_variable for_threads_, for_owner_;
  std::deque<Chunk> chunks_;
  std::int64_t waiting_tasks_ = 0;
  int idle_ = 0;
  bool closed_ = false;
  std::exception_ptr error_;
  std::int64_t error_task_ = 0;
  std::atomic<int> running_{0};
  std::atomic<std::int64_t> done_{0};
  std::atomic<std::int64_t> busy_ns_{0};
  std::vector<std::thread> threads_;
};

}  // namespace counterpoint::apps::tasks
