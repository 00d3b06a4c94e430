// Worker threads that are kept waiting, since starting a thread takes longer than an inverse step.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace counterpoint::contact {

class ThreadPool {
 public:
  /// num_threads: at least 1. The calling thread is one of them.
  explicit ThreadPool(int num_threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int size() const { return static_cast<int>(threads_.size()) + 1; }
  /// Calls task(i, thread) for i = 0 ... count - 1, each once, on any thread, and returns when all
  /// are done. Does not wait for threads that have no task yet. If tasks throw, rethrows one of the
  /// exceptions. Does not allocate.
  template <class Task>
  void run(int count, const Task& task) {
    run_calls(count, &task, [](const void* called, int i, int thread) {
      (*static_cast<const Task*>(called))(i, thread);
    });
  }

 private:
  using Call = void (*)(const void*, int, int);
  void run_calls(int count, const void* task, Call call);
  void work(int thread);
  void take(int thread);

  std::vector<std::thread> threads_;
  const void* task_ = nullptr;
  Call call_ = nullptr;
  /// Number of the round in the upper half, and of the tasks not yet taken in the lower half: a
  /// thread can only take a task of the round it has seen.
  std::atomic<std::uint64_t> open_{0};
  std::atomic<int> unfinished_{0};
  std::atomic<bool> quit_{false};
  std::mutex mutex_;
  std::exception_ptr error_;
};

/// Calls task(i, thread) for i = 0 ... count - 1: in order where the pool is null, else on its
/// threads, which take runs of numbers, since taking one costs as much as a small task.
template <class Task>
void share(ThreadPool* pool, int count, const Task& task) {
  constexpr int kPartsOfAThread = 16;
  const int parts = pool == nullptr ? 1 : std::min(count, kPartsOfAThread * pool->size());
  const auto part_of = [&](int part, int thread) {
    const auto begin = [&](int p) { return static_cast<int>(std::int64_t{count} * p / parts); };
    for (int i = begin(part); i < begin(part + 1); ++i) task(i, thread);
  };
  if (pool == nullptr) {
    part_of(0, 0);
  } else {
    pool->run(parts, part_of);
  }
}

}  // namespace counterpoint::contact
