#include "counterpoint/engine/simulator.h"

#include <utility>

namespace counterpoint {

Simulator::Simulator(Scene scene)
    : scene_(std::move(scene)), workspace_(scene_.model), watch_(scene_.model) {
  input_.applied_force = VectorX::Zero(model().nv());
  reset();
}

void Simulator::set_state(const State& state) {
  if (state.q.size() != model().nq() || state.v.size() != model().nv())
    throw InputError("set_state: q and v do not have the model's sizes");
  if (state.z.size() != 0 && state.z.size() != model().nz())
    throw InputError("set_state: z does not have the model's size");
  state_ = state;
  if (state.z.size() == 0) state_.z = model().default_z();
  last_length_ = 0.0;
  next_step_.reset();
  watch_.restart();
}

void Simulator::reset() { set_state({0.0, scene_.q, scene_.v}); }

/// Detects failures that only a run of steps shows.
void Simulator::watch(StepReport& report) {
  if (!report.succeeded()) return;
  report.fault = watch_.look(model(), options(), next_);
  if (!report.fault.any()) return;
  if (settings_.soften_after == 0) {
    report.status = status_of(report.fault);
  } else {
    watch_.restart();
  }
}

StepReport Simulator::step() {
  StepReport report =
      step_forward(model(), options(), settings_, state_, input_, workspace_, next_);
  watch(report);
  if (!report.succeeded()) return report;
  middle_.time = state_.time;
  middle_.q = state_.q;
  middle_.v = state_.v;
  middle_.z = state_.z;
  keep_last(options().time_step, report);
  std::swap(state_, next_);
  return report;
}

ControlledReport Simulator::step_controlled(double until) {
  double proposal = next_step();
  ControlledReport report = counterpoint::step_controlled(
      model(), options(), settings_, state_, input_, until, workspace_, proposal, middle_, next_);
  watch(report.second);
  if (!report.succeeded()) return report;
  keep_last(0.5 * report.step, report.second);
  std::swap(state_, next_);
  next_step_ = proposal;
  return report;
}

void Simulator::keep_last(double length, const StepReport& report) {
  last_length_ = length;
  VectorX z;
  z.swap(last_input_.z);  // keeps its memory, which an empty one of the input would free
  last_input_ = input_;
  z = middle_.z;
  last_input_.z.swap(z);
  last_input_.softening = report.softening;
  find_taut_links(next_, last_input_.taut_links);
}

const Inverse& Simulator::last_forces() {
  if (!(last_length_ > 0.0)) throw InputError("last_forces: no step has been done");
  SimulationOptions options = scene_.options;
  options.time_step = last_length_;
  step_inverse(model(), options, middle_.q, middle_.v, state_.q, state_.v, last_input_, workspace_,
               inverse_);
  return inverse_;
}

const Inverse& Simulator::inverse(VectorRef q, VectorRef v, VectorRef v_next) {
  return inverse(q, v, VectorX(), v_next);
}

const Inverse& Simulator::inverse(VectorRef q, VectorRef v, VectorRef q_next, VectorRef v_next) {
  step_inverse(model(), options(), q, v, q_next, v_next, input_, workspace_, inverse_);
  return inverse_;
}

}  // namespace counterpoint
