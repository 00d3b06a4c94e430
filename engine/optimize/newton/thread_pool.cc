#include "counterpoint/engine/optimize/newton/thread_pool.h"

#include <algorithm>

#include "counterpoint/engine/batch.h"

namespace counterpoint::optimization {

ThreadPool::ThreadPool(int num_threads) {
  const int count = num_threads > 0 ? num_threads : available_cores();
  for (int i = 1; i < count; ++i) threads_.emplace_back([this, i] { work(i); });
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  start_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::run(int count, const std::function<void(int, int)>& task) {
  {
    const std::lock_guard lock(mutex_);
    task_ = &task;
    count_ = count;
    next_ = 0;
    busy_ = size();
    error_ = nullptr;
    ++round_;
  }
  start_.notify_all();
  take(0);
  std::unique_lock lock(mutex_);
  done_.wait(lock, [&] { return busy_ == 0; });
  if (error_) std::rethrow_exception(error_);
}

void ThreadPool::take(int thread) {
  std::unique_lock lock(mutex_);
  while (next_ < count_) {
    const int i = next_++;
    lock.unlock();
    try {
      (*task_)(i, thread);
      lock.lock();
    } catch (...) {
      lock.lock();
      if (!error_) error_ = std::current_exception();
      next_ = count_;
    }
  }
  if (--busy_ == 0) done_.notify_all();
}

void ThreadPool::work(int thread) {
  long seen = 0;
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      start_.wait(lock, [&] { return quit_ || round_ != seen; });
      if (quit_) return;
      seen = round_;
    }
    take(thread);
  }
}

}  // namespace counterpoint::optimization
