#include "live/ghost.h"

#include <algorithm>
#include <utility>

#include "live/picture.h"

namespace counterpoint::live {

Ghost::Ghost(Scene scene, const State& start) : simulator_(std::move(scene)) {
  ContactOptions& contact = simulator_.options().contact;
  ContactOptions usual = contact;
  apply_contact_preset(ContactPreset::kDefault, usual);
  if (contact.compliance > usual.compliance) contact = usual;
  simulator_.set_state(start);
  thread_ = std::thread([this] { run(); });
}

Ghost::~Ghost() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  came_.notify_one();
  thread_.join();
}

void Ghost::put(Task task) {
  {
    const std::lock_guard lock(mutex_);
    if (ended_) return;
    behind_ = behind_ + task.h;
    tasks_.push_back(std::move(task));
    if (tasks_.size() > kMostBehind) {
      ended_ = true;
      tasks_.clear();
    }
  }
  came_.notify_one();
}

void Ghost::follow(double h, const Input& input) { put({h, input, {}, {}}); }

void Ghost::compare(double time, std::vector<Pose> poses) {
  put({0.0, {}, time, std::move(poses)});
}

std::optional<Frame> Ghost::take_frame() {
  const std::lock_guard lock(mutex_);
  return std::exchange(frame_, std::nullopt);
}

void Ghost::run() {
  while (true) {
    Task task;
    {
      std::unique_lock lock(mutex_);
      came_.wait(lock, [&] { return stop_ || !tasks_.empty(); });
      if (stop_) return;
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    if (task.time) {
      make_frame(task);
    } else if (!step(task)) {
      ended_ = true;
      return;
    }
    const std::lock_guard lock(mutex_);
    behind_ = behind_ - task.h;
  }
}

bool Ghost::step(const Task& task) {
  simulator_.input() = task.input;
  simulator_.options().time_step = task.h / kFinerSteps;
  for (int i = 0; i < kFinerSteps; ++i)
    if (!simulator_.step().succeeded()) return false;
  return true;
}

void Ghost::make_frame(const Task& task) {
  Frame frame;
  frame.kind = Frame::Kind::kGhost;
  frame.time = *task.time;
  frame.poses = body_poses(simulator_.model(), simulator_.state().q);
  add_limits(simulator_.model(), simulator_.state().q, frame);
  frame.rests.assign(simulator_.model().num_trees(), 0);
  double most = 0.0;
  for (size_t b = 1; b < frame.poses.size(); ++b)
    most = std::max(most, (frame.poses[b].translation - task.poses[b].translation).norm());
  distance_ = most;
  const std::lock_guard lock(mutex_);
  frame_ = std::move(frame);
}

}  // namespace counterpoint::live
