#include "workers.h"

#include <algorithm>

namespace counterpoint::apps::tasks {
namespace {

using Clock = std::chrono::steady_clock;

/// More tasks are requested if the waiting ones last less than this [s]; several times the 4 ms of
/// an answer.
constexpr double kAheadSeconds = 0.02;
/// Work requested at once [s].
constexpr double kChunkSeconds = 1.0;

}  // namespace

Workers::Workers(int threads, const TaskList& list,
                 std::function<void(std::int64_t, Outcome&&)> deliver)
    : list_(list), deliver_(std::move(deliver)), running_(threads) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

Workers::~Workers() {
  close(true);
  for (std::thread& thread : threads_) thread.join();
}

void Workers::add(const Chunk& chunk) {
  const std::lock_guard lock(mutex_);
  if (closed_) return;
  chunks_.push_back(chunk);
  waiting_tasks_ += chunk.count;
  if (chunk.count > 1)
    for_threads_.notify_all();
  else
    for_threads_.notify_one();
}

void Workers::close(bool now) {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  if (now) {
    chunks_.clear();
    waiting_tasks_ = 0;
  }
  for_threads_.notify_all();
}

bool Workers::hungry() const {
  if (closed_) return false;
  if (idle_ > waiting_tasks_) return true;
  // Long tasks are not kept waiting, because another rank may be idle.
  const double mean = done_ > 0 ? mean_seconds() : 1.0;
  return static_cast<double>(waiting_tasks_) * mean < kAheadSeconds * threads() &&
         mean < kAheadSeconds;
}

std::int64_t Workers::wanted() const {
  const std::lock_guard lock(mutex_);
  if (!hungry()) return 0;
  const auto at_least = std::max<std::int64_t>(idle_ - waiting_tasks_, 1);
  if (done_ == 0) return at_least;
  return std::max(at_least, static_cast<std::int64_t>(kChunkSeconds * threads() /
                                                      std::max(mean_seconds(), 1e-7)));
}

void Workers::wait(std::chrono::microseconds most) {
  std::unique_lock lock(mutex_);
  for_owner_.wait_for(lock, most, [this] { return hungry() || running_ == 0 || error_; });
}

std::exception_ptr Workers::error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

bool Workers::take(std::int64_t& number) {
  std::unique_lock lock(mutex_);
  if (chunks_.empty() && !closed_) {
    ++idle_;
    for_owner_.notify_one();
    for_threads_.wait(lock, [this] { return closed_ || !chunks_.empty(); });
    --idle_;
  }
  if (chunks_.empty()) return false;
  Chunk& chunk = chunks_.front();
  number = chunk.first;
  chunk.first += chunk.stride;
  --waiting_tasks_;
  if (--chunk.count == 0) chunks_.pop_front();
  if (hungry()) for_owner_.notify_one();
  return true;
}

void Workers::work() {
  std::int64_t number = 0;
  try {
    const Task task = list_.make_task();
    while (take(number)) {
      const auto start = Clock::now();
      deliver_(number, task(number));
      busy_ns_ +=
          std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - start).count();
      ++done_;
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!error_ || number < error_task_) {
      error_ = std::current_exception();
      error_task_ = number;
    }
    closed_ = true;
    chunks_.clear();
    waiting_tasks_ = 0;
    for_threads_.notify_all();
    for_owner_.notify_one();
  }
  const std::lock_guard lock(mutex_);
  --running_;
  for_owner_.notify_one();
}

}  // namespace counterpoint::apps::tasks
