#include "counterpoint/engine/batch.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <string>
#include <thread>

namespace counterpoint {
namespace {

/// Steps per task: one step of a few microseconds is too short for the overhead of a task.
constexpr int kStepsAtOnce = 16;

/// Derivatives per task; they take longer.
constexpr int kDerivativesAtOnce = 4;

void put(const Eigen::Ref<const MatrixX>& from, double* blocks, size_t i) {
  if (blocks != nullptr)
    std::copy(from.data(), from.data() + from.size(),
              blocks + i * static_cast<size_t>(from.size()));
}

/// The exception of the task with the lowest number.
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

struct Batch::Derivation {
  explicit Derivation(const Model& model) : workspace(model) {}
  Workspace workspace;
  Inverse inverse;
  InverseDerivatives by_motion;
  ForwardDerivatives forward;
};

Batch::Batch(const Scene& scene, int num_threads) {
  if (num_threads < 0)
    throw InputError("number of threads: expected 0 (one for every core) or more, found " +
                     std::to_string(num_threads));
  const int count = num_threads_of(num_threads);
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
  run_threads(count, [&](int i, size_t thread) { task(i, simulators_[thread]); });
}

void Batch::run_threads(int count, const std::function<void(int, size_t)>& task) {
  std::atomic<int> next{0};
  std::atomic<bool> stop{false};
  std::vector<FirstError> errors(simulators_.size());
  const auto work = [&](size_t thread) {
    for (int i = 0; !stop && (i = next++) < count;) {
      try {
        task(i, thread);
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

void Batch::inverse_derivatives(std::span<const State> starts, std::span<const State> ends,
                                std::span<const Input> known, const InverseDerivativeBlocks& out,
                                DerivativeMethod method) {
  derive(starts, ends, known, out, nullptr, method);
}

void Batch::forward_derivatives(std::span<const State> starts, std::span<const State> ends,
                                std::span<const Input> known,
                                const InverseDerivativeBlocks& inverse,
                                const ForwardDerivativeBlocks& out, DerivativeMethod method) {
  derive(starts, ends, known, inverse, &out, method);
}

void Batch::derive(std::span<const State> starts, std::span<const State> ends,
                   std::span<const Input> known, const InverseDerivativeBlocks& inverse,
                   const ForwardDerivativeBlocks* forward, DerivativeMethod method) {
  if (ends.size() != starts.size() || (!known.empty() && known.size() != starts.size()))
    throw InputError("a batch of " + std::to_string(starts.size()) + " steps has " +
                     std::to_string(ends.size()) + " ends and " + std::to_string(known.size()) +
                     " inputs: expected as many of each, or no inputs");
  const Model& model = simulators_.front().model();
  while (derivations_.size() < simulators_.size())
    derivations_.push_back(std::make_shared<Derivation>(model));
  const Input nothing;
  const auto one = [&](size_t i, Derivation& d, const SimulationOptions& options) {
    const Input& input = known.empty() ? nothing : known[i];
    const auto &q = starts[i].q, &v = starts[i].v, &q_next = ends[i].q, &v_next = ends[i].v;
    if (forward != nullptr) {
      step_forward_derivatives(model, options, q, v, q_next, v_next, input, d.workspace, d.inverse,
                               d.by_motion, d.forward, method);
    } else {
      step_inverse_derivatives(model, options, q, v, q_next, v_next, input, d.workspace, d.inverse,
                               d.by_motion, method);
    }
    put(d.inverse.applied_force, inverse.applied_force, i);
    put(d.by_motion.dq, inverse.dq, i);
    put(d.by_motion.dv, inverse.dv, i);
    put(d.by_motion.dv_next, inverse.dv_next, i);
    if (inverse.by_differences != nullptr) inverse.by_differences[i] = d.by_motion.by_differences;
    if (forward == nullptr) return;
    put(d.forward.dv_dq, forward->dv_dq, i);
    put(d.forward.dv_dv, forward->dv_dv, i);
    put(d.forward.dv_du, forward->dv_du, i);
    put(d.forward.dq_dq, forward->dq_dq, i);
    put(d.forward.dq_dv, forward->dq_dv, i);
    put(d.forward.dq_du, forward->dq_du, i);
  };
  const int count = static_cast<int>(starts.size());
  run_threads((count + kDerivativesAtOnce - 1) / kDerivativesAtOnce, [&](int chunk, size_t thread) {
    const int end = std::min(count, (chunk + 1) * kDerivativesAtOnce);
    for (int i = chunk * kDerivativesAtOnce; i < end; ++i)
      one(static_cast<size_t>(i), *derivations_[thread], simulators_[thread].options());
  });
}

}  // namespace counterpoint
