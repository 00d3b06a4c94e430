#include "counterpoint/engine/optimize/terms/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"

namespace counterpoint::optimization {

Frames::Frames(const Problem& problem, const std::vector<VectorX>& frames) : problem_(&problem) {
  check_problem(problem);
  const auto n = static_cast<std::size_t>(problem.steps);
  if (frames.size() != n + 1 && !(problem.periodic && frames.size() == n))
    throw InputError(fmt::format("optimization: {} frames to start from, {} are expected",
                                 frames.size(), n + 1));
  for (const VectorX& q : frames)
    if (q.size() != problem.model->nq())
      throw InputError(fmt::format("optimization: a frame of {} coordinates, the model has {}",
                                   q.size(), problem.model->nq()));
  std::vector<VectorX>& slots = variables_.q;
  set_time_step(problem.h());
  if (problem.periodic) {
    slots.assign(frames.begin(), frames.begin() + problem.steps);
    return;
  }
  const int fixed = problem.goal_q ? 2 : 0;
  slots.assign(frames.begin() + (problem.free_start ? 0 : 1), frames.end() - fixed);
  first_ = problem.free_start ? -1 : 1;
  if (problem.free_start) {  // frame -1 at the speed of the first step
    VectorX back(problem.model->nv()), before = frames[0];
    configuration_difference(*problem.model, frames[0], frames[1], back);
    integrate_configuration(*problem.model, frames[0], back, -1.0, before);
    slots.insert(slots.begin(), before);
  }
  set_start(problem.start_q);
  if (problem.goal_q) set_goal(*problem.goal_q);
}

void Frames::set_start(const VectorX& q, const VectorX& v) {
  start_ = before_start_ = q;
  start_v_ = v;
  set_time_step(time_step());
}

void Frames::set_goal(const VectorX& q) {
  goal_ = before_goal_ = q;
  set_time_step(time_step());
}

/// Sets h, within the bounds of the duration, and the fixed frames that depend on it.
void Frames::set_time_step(double h) {
  const Problem& problem = *problem_;
  if (problem.duration)
    h = std::clamp(h, problem.duration->least / problem.steps,
                   problem.duration->most / problem.steps);
  variables_.time_step = h;
  if (start_.size() > 0)
    integrate_configuration(*problem.model, start_, start_v_, -h, before_start_);
  if (goal_.size() > 0)
    integrate_configuration(*problem.model, goal_, problem.goal_v, -h, before_goal_);
}

void Frames::set_variables(const Variables& variables) {
  variables_ = variables;
  set_time_step(variables.time_step);
}

bool Frames::moves_with_time(int frame, VectorX& out) const {
  if (problem_->periodic || source(frame).slot >= 0) return false;
  if (frame != -1 && frame != problem_->steps - 1) return false;
  out = -time_step() * (frame < 0 ? start_v_ : problem_->goal_v);
  return true;
}

FrameSource Frames::source(int frame) const {
  const int n = problem_->steps;
  if (!problem_->periodic) {
    const int slot = frame - first_;
    return {slot >= 0 && slot < num_slots() ? slot : -1, false};
  }
  if (frame >= 0 && frame < n) return {frame, false};
  return {frame < 0 ? frame + n : frame - n, problem_->mirror.has_value()};
}

void Frames::write_image(const VectorX& q, double sign, VectorX& out) const {
  out = q;
  if (problem_->mirror) {
    const Mirror& mirror = *problem_->mirror;
    for (Eigen::Index i = 0; i < q.size(); ++i)
      out[i] = mirror.q_sign[i] * q[mirror.q_index[static_cast<std::size_t>(i)]];
  }
  for (int i = 1; i < problem_->model->num_bodies(); ++i) {
    const Body& body = problem_->model->body(i);
    if (body.joint_type == JointType::kFloating)
      out.segment<3>(body.q_index) += sign * problem_->displacement;
  }
}

void Frames::read(int frame, VectorX& q) const {
  const FrameSource from = source(frame);
  const int n = problem_->steps;
  if (from.slot >= 0) {
    const VectorX& own = variables_.q[static_cast<std::size_t>(from.slot)];
    if (!problem_->periodic || (frame >= 0 && frame < n)) {
      q = own;
    } else {
      write_image(own, frame < 0 ? -1.0 : 1.0, q);
    }
    return;
  }
  if (frame <= 0) {
    q = frame < 0 ? before_start_ : start_;
  } else {
    q = frame >= n ? goal_ : before_goal_;
  }
}

std::vector<VectorX> Frames::all() const {
  std::vector<VectorX> frames;
  for (int t = 0; t <= problem_->steps; ++t) frames.push_back(at(t));
  return frames;
}

void Frames::move(const MatrixX& step, double log_time) {
  for (int i = 0; i < num_slots(); ++i) {
    VectorX& q = variables_.q[static_cast<std::size_t>(i)];
    integrate_configuration(*problem_->model, q, step.col(i), 1.0, q);
  }
  if (log_time != 0.0) set_time_step(time_step() * std::exp(log_time));
}

std::vector<VectorX> straight_line(const Model& model, const VectorX& from, const VectorX& to,
                                   int steps) {
  VectorX difference(model.nv());
  configuration_difference(model, from, to, difference);
  std::vector<VectorX> frames(static_cast<std::size_t>(steps) + 1, from);
  for (int t = 1; t <= steps; ++t)
    integrate_configuration(model, from, difference, static_cast<double>(t) / steps,
                            frames[static_cast<std::size_t>(t)]);
  return frames;
}

}  // namespace counterpoint::optimization
