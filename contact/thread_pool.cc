#include "counterpoint/contact/thread_pool.h"

namespace counterpoint::contact {
namespace {

constexpr std::uint64_t kRound = std::uint64_t{1} << 32;
/// Number of looks at a value before a thread sleeps, about 20 us: rounds of a Newton step follow
/// each other faster than a thread wakes up.
constexpr int kLooks = 2000;

void pause_processor() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

/// Waits until the value is no longer `old`.
template <class Number>
void wait_for_change(const std::atomic<Number>& value, Number old) {
  for (int i = 0; i < kLooks; ++i) {
    if (value.load(std::memory_order_acquire) != old) return;
    pause_processor();
  }
  value.wait(old, std::memory_order_acquire);
}

}  // namespace

ThreadPool::ThreadPool(int num_threads) {
  for (int i = 1; i < num_threads; ++i) threads_.emplace_back([this, i] { work(i); });
}

ThreadPool::~ThreadPool() {
  quit_ = true;
  open_ += kRound;
  open_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::run_calls(int count, const void* task, Call call) {
  if (count == 0) return;
  task_ = task;
  call_ = call;
  error_ = nullptr;
  unfinished_.store(count, std::memory_order_relaxed);
  const std::uint64_t round = open_.load(std::memory_order_relaxed) / kRound + 1;
  open_.store(round * kRound + static_cast<std::uint64_t>(count), std::memory_order_release);
  if (!threads_.empty()) open_.notify_all();
  take(0);
  for (int left = unfinished_.load(std::memory_order_acquire); left > 0;
       left = unfinished_.load(std::memory_order_acquire))
    wait_for_change(unfinished_, left);
  if (error_) std::rethrow_exception(error_);
}

void ThreadPool::take(int thread) {
  std::uint64_t open = open_.load(std::memory_order_acquire);
  while (open % kRound > 0) {
    if (!open_.compare_exchange_weak(open, open - 1, std::memory_order_acq_rel)) continue;
    try {
      call_(task_, static_cast<int>(open % kRound) - 1, thread);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
    }
    if (unfinished_.fetch_sub(1, std::memory_order_acq_rel) == 1) unfinished_.notify_all();
    open = open_.load(std::memory_order_acquire);
  }
}

void ThreadPool::work(int thread) {
  while (!quit_) {
    const std::uint64_t open = open_.load(std::memory_order_acquire);
    if (open % kRound > 0) {
      take(thread);
    } else {
      wait_for_change(open_, open);
    }
  }
}

}  // namespace counterpoint::contact
