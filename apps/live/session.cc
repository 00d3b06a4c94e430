#include "live/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "counterpoint/engine/clocks.h"
#include "counterpoint/engine/fault.h"
#include "live/page.h"
#include "report/failure.h"

namespace counterpoint::live {
namespace {

/// Longest time for which steps run before messages are read again [s].
constexpr double kTurn = 0.008;
/// A simulation that is this far behind the clock [s] no longer tries to make up for it.
constexpr double kFarBehind = 0.1;
constexpr double kLeastSpeed = 1e-3, kMostSpeed = 1e3;
constexpr int kMostSteps = 1000;   ///< in one message
constexpr size_t kMostSaved = 16;  ///< states

/// Columns of recordings: all inputs of the model, and wrenches on the link of every body.
InputColumns recorded_columns(const Model& model) {
  InputColumns out = InputColumns::of(model);
  out.links = link_frames(model);
  out.links.erase(out.links.begin());  // the world
  std::sort(out.links.begin(), out.links.end());
  return out;
}

SimulationOptions without_step_control(SimulationOptions options) {
  options.step_control.reset();
  return options;
}

/// Whether pages may set an option. Others would end the run, or do nothing in it.
bool may_set(const std::string& key) {
  const std::string first = key.substr(0, key.find('.'));
  return first != "duration" && first != "step_control";
}

}  // namespace

void Inbox::put(Event event) {
  {
    const std::lock_guard lock(mutex_);
    if (event.kind == Event::Kind::kMessage && events_.size() >= kMost) return;
    events_.push_back(std::move(event));
  }
  came_.notify_one();
}

std::deque<Event> Inbox::take(double seconds) {
  std::unique_lock lock(mutex_);
  if (seconds > 0.0)
    came_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return !events_.empty(); });
  return std::exchange(events_, {});
}

Session::Session(Scene scene, SessionOptions options)
    : options_(std::move(options)),
      simulator_(std::move(scene)),
      first_options_(simulator_.options()),
      hand_(simulator_.model()),
      picture_(simulator_.model()),
      takes_(options_.record, simulator_.model(), recorded_columns(simulator_.model())),
      wanted_(simulator_.model(), sliders_of(simulator_.model(), simulator_.state().z)) {
  simulator_.options() = without_step_control(first_options_);
  wanted_.apply(simulator_.input());
  simulator_.measure_phases(&pace_.phases);
  history_.add(simulator_.state());
  begin_sensors();
  if (takes_.possible()) begin_take();
  server_ = std::make_unique<Server>(
      options_.server,
      [&](const std::string& sources) {
        return live_page(
            {simulator_.scene(), simulator_.state(), options_.scene_file, options_.packages},
            picture_.curves(simulator_.state()), controls_of(wanted_.sliders()), sources);
      },
      [&](Event event) { inbox_.put(std::move(event)); });
}

// ---- Messages.

void Session::say(long client, const std::string& words) {
  server_->send(client, Json{{"type", "say"}, {"words", words}}.dump(
                            -1, ' ', false, Json::error_handler_t::replace));
}

void Session::handle(const Event& event) {
  const auto known = std::find(clients_.begin(), clients_.end(), event.client);
  status_wanted_ = frame_wanted_ = true;
  switch (event.kind) {
    case Event::Kind::kOpened:
      clients_.push_back(event.client);
      if (!started_ && !options_.paused) set_playing(true);
      started_ = true;
      return;
    case Event::Kind::kClosed:
      if (known == clients_.begin()) hand_.release();
      if (known != clients_.end()) clients_.erase(known);
      return;
    case Event::Kind::kMessage:
      break;
  }
  if (known == clients_.end()) return;
  try {
    const Command command = parse_command(event.text);
    if (command.kind == Command::Kind::kDrive) {
      hand_.release();
      std::rotate(clients_.begin(), known, known + 1);
    } else if (known != clients_.begin()) {
      say(event.client, "another page drives; take over first");
    } else {
      obey(command);
    }
  } catch (const InputError& error) {
    say(event.client, error.what());
  }
}

void Session::obey(const Command& command) {
  using Kind = Command::Kind;
  switch (command.kind) {
    case Kind::kPlay:
      return set_playing(true);
    case Kind::kPause:
      return set_playing(false);
    case Kind::kReset:
      simulator_.reset();
      return begin_from(State(simulator_.state()));
    case Kind::kStep:
      if (command.index > kMostSteps)
        throw InputError(fmt::format("message: 'count': expected at most {}", kMostSteps));
      set_playing(false);
      steps_to_go_ = command.index;
      return;
    case Kind::kSpeed:
      if (!(command.value >= kLeastSpeed && command.value <= kMostSpeed))
        throw InputError("message: 'value': expected 0.001 ... 1000");
      speed_ = command.value;
      return set_playing(playing_);
    case Kind::kSave:
      if (saved_.size() == kMostSaved) saved_.erase(saved_.begin());
      saved_.push_back(simulator_.state());
      return;
    case Kind::kRestore:
      if (static_cast<size_t>(command.index) >= saved_.size())
        throw InputError("message: 'slot': there is no such saved state");
      return begin_from(saved_[static_cast<size_t>(command.index)]);
    case Kind::kRewind: {
      set_playing(false);
      const State there = *history_.rewind(command.value);
      return go_to(there);
    }
    case Kind::kDrag:
      return hand_.drag(command.index, command.point, command.target);
    case Kind::kTurn:
      return hand_.turn(command.index, command.target);
    case Kind::kRelease:
      return hand_.release();
    case Kind::kInput:
    case Kind::kForce:
      return wanted_.set(command.kind == Kind::kForce, command.index, command.value);
    case Kind::kSet:
      return change_option(command);
    case Kind::kRecord:
      if (!takes_.possible()) throw InputError("recordings need --record FILE on the command line");
      return command.on ? begin_take() : takes_.end();
    case Kind::kGhost:
      ghost_.reset();
      return command.on ? begin_ghost() : void();
    case Kind::kDrive:
    case Kind::kStop:
      return;
  }
}

/// Goes on from a state that begins a new history.
void Session::begin_from(const State& state) {
  history_.clear();
  history_.add(state);
  go_to(state);
}

/// Goes on from a state; a recording that runs ends, and the next one begins.
void Session::go_to(const State& state) {
  simulator_.set_state(state);
  hand_.release();
  start_again();
}

/// Begins the next recording and ghost, if there are any: state or options have changed, and the
/// forces of the last step can no longer be recovered.
void Session::start_again() {
  after_step_ = false;
  fault_.clear();
  set_playing(playing_);
  if (takes_.running()) begin_take();
  if (ghost_) begin_ghost();
  begin_sensors();
}

void Session::begin_sensors() {
  sensors_.reset();
  if (simulator_.model().sensors().empty()) return;
  try {
    sensors_.emplace(simulator_.model(), simulator_.options());
    sensor_values_.setZero(sensors_->size());
  } catch (const InputError&) {
    // This integrator does not give them.
  }
}

/// Computes the values of the sensors in the last step. Returns whether there are any.
bool Session::read_sensors() {
  if (!sensors_ || !after_step_) return false;
  Input known = simulator_.input();
  known.softening = report_.softening;
  known.z = before_.z;
  find_taut_links(simulator_.state(), known.taut_links);
  const State& after = simulator_.state();
  sensors_->evaluate(
      {before_.q, before_.v, after.q, after.v, known, simulator_.options().time_step},
      sensor_values_);
  return true;
}

void Session::begin_ghost() {
  Scene scene = simulator_.scene();
  ghost_.reset();
  ghost_ = std::make_unique<Ghost>(std::move(scene), simulator_.state());
}

void Session::begin_take() { takes_.begin(simulator_.state(), simulator_.options(), command()); }

void Session::change_option(const Command& command) {
  if (!may_set(command.key))
    throw InputError("option " + command.key +
                     ": not in a live run, which makes steps of time_step");
  SimulationOptions changed = simulator_.options();
  set_option(command.key, command.text, changed);
  if (changed == simulator_.options()) return;
  simulator_.options() = changed;
  std::erase_if(changes_, [&](const auto& change) { return change.first == command.key; });
  changes_.emplace_back(command.key, command.text);
  start_again();
}

// ---- Steps.

void Session::set_playing(bool playing) {
  playing_ = playing;
  anchor_wall_ = wall_seconds();
  anchor_time_ = simulator_.state().time;
}

/// Sets the inputs of the next step.
void Session::set_inputs() {
  const SimulationOptions& options = simulator_.options();
  Input& input = simulator_.input();
  wanted_.apply(input);
  if (options.effects.has(Effect::kEffortLimits))
    limit_applied_forces(simulator_.model(), options.effects, input.applied_force);
  hand_.update(simulator_.state(), options.time_step);
  if (hand_.body() == 0) return;
  ExternalWrench& pull = input.wrenches.emplace_back();
  pull.body = hand_.body();
  pull.wrench = hand_.wrench();
  pull.frame = hand_.frame();
  pull.point = simulator_.model().frames()[pull.frame].X_BF.translation;
}

/// Makes one step. If it fails, the run pauses.
void Session::step() {
  set_inputs();
  const double h = simulator_.options().time_step;
  before_.q = simulator_.state().q;
  before_.v = simulator_.state().v;
  before_.z = simulator_.state().z;
  State before;
  if (takes_.running()) before = simulator_.state();
  report_ = simulator_.step();
  if (!report_.succeeded()) {
    fault_ = apps::failure_message(simulator_.model(),
                                   FailedStep{steps_, simulator_.state().time, report_});
    set_playing(false);
    steps_to_go_ = 0;
    return;
  }
  takes_.add(before, simulator_.input(), h, simulator_.state(), report_);
  if (ghost_) ghost_->follow(h, simulator_.input());
  after_step_ = true;
  ++steps_;
  softened_ += report_.softening.softens() ? 1 : 0;
  unfinished_ += report_.softening.unfinished() ? 1 : 0;
  ++pace_.steps;
  pace_.newton_iterations += report_.newton_iterations;
  pace_.contacts += report_.contacts;
  pace_.rows += report_.constraint_rows;
  pace_.simulated += h;
}

/// Makes the steps that were asked for, or are due by the clock, for kTurn at most.
void Session::play() {
  const double begin = wall_seconds();
  const double h = simulator_.options().time_step;
  while (steps_to_go_ > 0 && wall_seconds() - begin < kTurn) {
    --steps_to_go_;
    step();
  }
  while (playing_) {
    const double now = wall_seconds();
    const double due = anchor_time_ + speed_ * (now - anchor_wall_);
    if (simulator_.state().time + h > due) return;
    if (now - begin > kTurn) {
      if (due - simulator_.state().time > kFarBehind * speed_) set_playing(true);
      return;
    }
    step();
  }
}

void Session::run(const std::function<bool()>& stop) {
  constexpr double kLongestWait = 0.05;
  while (!stop()) {
    double wait = 0.0;
    if (!playing_ && steps_to_go_ == 0 && events_.empty()) {
      wait = kLongestWait;
    } else if (playing_) {
      const double next_step =
          anchor_wall_ +
          (simulator_.state().time + simulator_.options().time_step - anchor_time_) / speed_;
      wait = std::min({next_step - wall_seconds(), next_frame_ - wall_seconds(), kLongestWait});
    }
    if (status_wanted_ || frame_wanted_) wait = std::min(wait, next_frame_ - wall_seconds());
    // Later messages wait until the steps that one asks for are done.
    if (steps_to_go_ == 0 && events_.empty()) events_ = inbox_.take(wait);
    for (; steps_to_go_ == 0 && !events_.empty(); events_.pop_front()) handle(events_.front());
    play();
    if (wall_seconds() >= next_frame_) publish();
    if (options_.duration > 0.0 &&
        simulator_.state().time >= options_.duration - 1e-6 * simulator_.options().time_step)
      break;
  }
  takes_.end();
}

// ---- What pages get.

/// Sends what has changed since the last call: frames and a status. Keeps the state for rewinds.
void Session::publish() {
  const double now = wall_seconds();
  next_frame_ = std::max(next_frame_ + kFrameInterval, now);
  const bool moved = history_.end() != simulator_.state().time;
  if (simulator_.state().time > history_.end()) history_.add(simulator_.state());
  if (clients_.empty()) return;
  if (moved || frame_wanted_) {
    frame_wanted_ = false;
    const double begin = thread_seconds();
    hand_.update(simulator_.state(), simulator_.options().time_step);
    Shown shown{&simulator_.input(), nullptr, nullptr, report_.newton_iterations, &hand_};
    if (after_step_) shown.before = &before_;
    if (after_step_ && has_closure_forces(simulator_.model(), simulator_.options()))
      shown.forces = &simulator_.last_forces();
    if (read_sensors()) shown.sensors = &sensor_values_;
    const Frame& frame = picture_.frame(simulator_.state(), shown);
    server_->send_frame(0, encode(frame));
    ++pace_.frames;
    pace_.frame_seconds += thread_seconds() - begin;
    if (ghost_) ghost_->compare(frame.time, frame.poses);
  }
  if (ghost_)
    if (const auto frame = ghost_->take_frame()) server_->send_frame(1, encode(*frame));
  if (now < next_status_ && !status_wanted_) return;
  next_status_ = now + kStatusInterval;
  status_wanted_ = false;
  send_status();
}

}  // namespace counterpoint::live
