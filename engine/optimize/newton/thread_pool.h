// Worker threads that are kept waiting, since starting a thread takes longer than an inverse step.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace counterpoint::optimization {

class ThreadPool {
 public:
  /// num_threads: 0 for one per core. The calling thread is one of them.
  explicit ThreadPool(int num_threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int size() const { return static_cast<int>(threads_.size()) + 1; }
  /// Calls task(i, thread) for i = 0 ... count - 1, each once, on any thread, and returns when all
  /// are done. If tasks throw, rethrows one of the exceptions.
  void run(int count, const std::function<void(int, int)>& task);

 private:
  void work(int thread);
  void take(int thread);

  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable start_, done_;
  const std::function<void(int, int)>* task_ = nullptr;
  int count_ = 0, next_ = 0, busy_ = 0;
  long round_ = 0;
  bool quit_ = false;
  std::exception_ptr error_;
};

}  // namespace counterpoint::optimization
