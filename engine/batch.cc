#include "counterpoint/engine/batch.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <string>
#include <thread>

namespace counterpoint {
namespace {

/// So many steps at a time: a step of a few microseconds is little beside taking the next one.
constexpr int kStepsAtOnce = 16;

/// The exception of the task of lowest number.
struct FirstError {
  int task = -1;
  std::exception_ptr error;
  void keep(int i, std::exception_ptr e) {
    if (task >= 0 && task <= i) return;
    task = i;
    error = std::move(e);
  }
};

}  // namespace

Batch::Batch(const Scene& scene, int num_threads) {
  if (num_threads < 0)
    throw InputError("number of threads: expected 0 (one for every core) or more, found " +
                     std::to_string(num_threads));
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const int count = num_threads == 0 ? cores : num_threads;
  simulators_.reserve(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) simulators_.emplace_back(scene);
}

void Batch::set_options(const SimulationOptions& options) {
  for (Simulator& simulator : simulators_) simulator.options() = options;
}

void Batch::set_settings(const contact::Settings& settings) {
  for (Simulator& simulator : simulators_) simulator.settings() = settings;
}

void Batch::run(int count, const std::function<void(int, Simulator&)>& task) {
  std::atomic<int> next{0};
  std::atomic<bool> stop{false};
  std::vector<FirstError> errors(simulators_.size());
  const auto work = [&](size_t thread) {
    for (int i; !stop && (i = next++) < count;) {
      try {
        task(i, simulators_[thread]);
      } catch (...) {
        errors[thread].keep(i, std::current_exception());
        stop = true;
      }
    }
  };
  std::vector<std::thread> threads;
  const size_t helpers = std::min(simulators_.size(), static_cast<size_t>(std::max(count, 1))) - 1;
  for (size_t t = 0; t < helpers; ++t) threads.emplace_back(work, t + 1);
  work(0);
  for (std::thread& thread : threads) thread.join();
  FirstError first;
  for (const FirstError& error : errors)
    if (error.task >= 0) first.keep(error.task, error.error);
  if (first.error) std::rethrow_exception(first.error);
}

void Batch::step(std::span<State> states, std::span<const Input> inputs,
                 std::span<StepReport> reports) {
  if (inputs.size() != states.size() || reports.size() != states.size())
    throw InputError("a batch of " + std::to_string(states.size()) + " states has " +
                     std::to_string(inputs.size()) + " inputs and " +
                     std::to_string(reports.size()) + " reports: expected as many of each");
  const int count = static_cast<int>(states.size());
  run((count + kStepsAtOnce - 1) / kStepsAtOnce, [&](int chunk, Simulator& simulator) {
    const int end = std::min(count, (chunk + 1) * kStepsAtOnce);
    for (int i = chunk * kStepsAtOnce; i < end; ++i) {
      simulator.set_state(states[static_cast<size_t>(i)]);
      simulator.input() = inputs[static_cast<size_t>(i)];
      reports[static_cast<size_t>(i)] = simulator.step();
      states[static_cast<size_t>(i)] = simulator.state();
    }
  });
}

}  // namespace counterpoint
