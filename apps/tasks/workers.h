// Threads of one process, and the queue of their tasks.
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
  /// The threads call `deliver` for every task; an exception of it counts as the task's.
  Workers(int threads, const TaskList& list, std::function<void(std::int64_t, Outcome&&)> deliver);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  void add(const Chunk& chunk);
  /// No more tasks will be added: threads end when the queue is empty. `now`: clears the queue.
  void close(bool now = false);
  /// Returns when more tasks are wanted, all threads have ended, a task failed, or after `most`.
  void wait(std::chrono::microseconds most);

  /// Number of tasks to request now, about a second of work; 0 while enough are waiting.
  std::int64_t wanted() const;
  bool ended() const { return running_ == 0; }
  std::int64_t done() const { return done_; }
  int threads() const { return static_cast<int>(threads_.size()); }
  /// Exception of the failed task with the lowest number; null: none failed.
  std::exception_ptr error() const;

 private:
  void work();
  bool take(std::int64_t& number);
  bool hungry() const;  // call with the lock held
  double mean_seconds() const {
    return 1e-9 * static_cast<double>(busy_ns_) / static_cast<double>(done_);
  }

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
