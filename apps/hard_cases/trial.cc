#include "trial.h"

#include <fmt/format.h>

#include <algorithm>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/trajectory.h"
#include "view/view_option.h"

namespace counterpoint::apps {

Runner& Trial::load(const std::string& name) {
  constexpr int kMostFrames = 1000;
  const std::filesystem::path file = scenes_ / (name + ".yaml");
  runners_.push_back(make_runner(load_scene(file), peer_));
  if (!replay_file_.empty() && runners_.size() == 1) {
    replay_scene_ = file.string();
    recorder_ = std::make_unique<view::ClipRecorder>(runners_[0]->scene(), view::kDefaultRate, true,
                                                     kMostFrames);
  }
  return *runners_.back();
}

bool Trial::write_replay() {
  if (!recorder_ || recorded_.q.size() == 0) return false;
  view::write_replay(replay_file_, runners_[0]->scene(), {replay_scene_, {}},
                     recorder_->finish(recorded_));
  recorder_.reset();
  return true;
}

void Trial::step(Runner& sim) {
  if (stop_wanted_ && stop_wanted_()) throw Stopped("stopped");
  const bool first = recorder_ && &sim == runners_[0].get() &&
                     (recorded_.q.size() == 0 || sim.state().time >= recorded_.time);
  const State before = first ? sim.state() : State();
  const StepMetrics metrics = sim.step();
  if (first && metrics.failure.empty()) {
    recorder_->add_step(before, sim.input(), sim.options().time_step, sim.state());
    recorded_ = sim.state();
  }
  ++steps;
  iterations += metrics.iterations;
  iterations_max = std::max(iterations_max, metrics.iterations);
  max_penetration = std::max(max_penetration, metrics.max_penetration);
  if (!metrics.failure.empty()) {
    if (!state_file_.empty()) write_state(state_file_, sim.model(), sim.options(), sim.state());
    throw StepFailure(fmt::format("{}: step at {:.6g} s: {}", sim.scene().name, sim.state().time,
                                  metrics.failure));
  }
  if (wall_seconds() - start_ > allowed_) {
    throw StepFailure(fmt::format("{}: stopped at {:.6g} s after {:g} s of wall time",
                                  sim.scene().name, sim.state().time, allowed_));
  }
}

Forces Trial::step_and_recover(Runner& sim) {
  step(sim);
  return sim.forces();
}

double Trial::left_alone(Runner& sim, double seconds, const std::string& what) {
  const VectorX start = sim.state().q;
  double most = 0.0;
  plot("drift of a " + what + " [m]");
  chart.log_y = true;
  run(sim, seconds, [&](const Runner& s) {
    const double now = drift(s.model(), s.state().q, start);
    most = std::max(most, now);
    draw(s, now);
  });
  return most;
}

void Trial::plot(const std::string& y_label, std::vector<Level> levels,
                 const std::vector<std::string>& curves) {
  chart.y_label = y_label;
  chart.levels = std::move(levels);
  chart.curves.clear();
  for (const std::string& name : curves) chart.curves.push_back({name, {}, {}});
}

void Trial::equal(const std::string& quantity, const std::string& unit, double measured,
                  double known, double tolerance, const std::string& source) {
  checks.push_back({quantity, unit, measured, known - tolerance, known + tolerance,
                    fmt::format("{:.6g} +- {:.2g}", known, tolerance), source});
}

void Trial::at_most(const std::string& quantity, const std::string& unit, double measured,
                    double bound, const std::string& source) {
  checks.push_back({.quantity = quantity,
                    .unit = unit,
                    .measured = measured,
                    .upper = bound,
                    .known = fmt::format("<= {:.4g}", bound),
                    .source = source});
}

void Trial::at_least(const std::string& quantity, const std::string& unit, double measured,
                     double bound, const std::string& source) {
  checks.push_back({.quantity = quantity,
                    .unit = unit,
                    .measured = measured,
                    .lower = bound,
                    .known = fmt::format(">= {:.4g}", bound),
                    .source = source});
}

bool Run::passed() const {
  return reached_end() && std::all_of(figures.checks.begin(), figures.checks.end(),
                                      [](const Check& check) { return check.passed(); });
}

double Figures::iterations_mean() const {
  return static_cast<double>(iterations) / static_cast<double>(std::max(steps, 1L));
}

View::View(const Runner& sim)
    : sim_(sim),
      dynamics_(sim.model()),
      surfaces_(sim.model()),
      frame_of_(static_cast<std::size_t>(sim.model().num_bodies())) {
  const std::vector<Frame>& frames = sim.model().frames();
  for (std::size_t i = 0; i < frames.size(); ++i)
    frame_of_[static_cast<std::size_t>(frames[i].body)] = static_cast<int>(i);
  look();
}

void View::look() { dynamics_.set_state(sim_.state().q, sim_.state().v); }

int View::body(const std::string& link) const {
  return sim_.model().frames()[static_cast<std::size_t>(frame_index(sim_.model(), link))].body;
}

Pose View::pose(const std::string& link) const {
  return dynamics_.frame_pose(frame_index(sim_.model(), link));
}

Vector3 View::center_arm(int body) const {
  const Frame& frame =
      sim_.model().frames()[static_cast<std::size_t>(frame_of_[static_cast<std::size_t>(body)])];
  const Vector3 center = frame.X_BF.inverse() * sim_.model().body(body).inertia.center;
  return motion(body).X_WF.rotation * center;
}

Vector3 View::center(int body) const { return motion(body).X_WF.translation + center_arm(body); }

Vector3 View::velocity(int body) const {
  const FrameMotion frame = motion(body);
  return frame.velocity + frame.angular_velocity.cross(center_arm(body));
}

double View::kinetic() const { return dynamics_.kinetic_energy(); }

double View::potential() const { return dynamics_.potential_energy(); }

double View::energy_with_springs() {
  return energy() + spring_energy(sim_.model(), sim_.state().q, sim_.state().z) +
         surfaces_.energy(sim_.state().q);
}

double View::energy_scale() const {
  const double gravity = sim_.model().gravity().norm();
  return kinetic() + dynamics_.total_mass() * std::max(gravity, 1.0) * 1.0;
}

Force View::momentum() const { return dynamics_.momentum(); }

EnergyChange watch_energy(Trial& trial, Runner& sim, View& view, double scale,
                          const std::function<void()>& after, std::size_t curve) {
  const double start = view.energy();
  EnergyChange change;
  trial.run(sim, sim.options().duration, [&](const Runner& s) {
    view.look();
    const double now = (view.energy() - start) / scale;
    change.gain = std::max(change.gain, now);
    change.off = std::max(change.off, std::abs(now));
    trial.draw(s, now, curve);
    if (after) after();
  });
  return change;
}

double closures_open(const Model& model, const VectorX& q) {
  const std::vector<Pose> X_WB = body_poses(model, q);
  double most = 0.0;
  for (const Closure& closure : model.closures())
    most = std::max(most, closure_gap(closure, X_WB).largest());
  return most;
}

Vector3 force_between(const Model& model, const Forces& forces, int a, int b) {
  Vector3 sum = Vector3::Zero();
  for (const ContactForce& c : forces.contacts) {
    const int body_a = model.geometries()[static_cast<std::size_t>(c.contact.geometry_a)].body;
    const int body_b = model.geometries()[static_cast<std::size_t>(c.contact.geometry_b)].body;
    if (body_a == a && body_b == b) sum += c.force;
    if (body_a == b && body_b == a) sum -= c.force;
  }
  return sum;
}

namespace {

const Body& free_body(const Model& model, const std::string& link) {
  const int joint = model.find_joint(link);
  if (joint < 0) throw InputError(fmt::format("scene has no free body '{}'", link));
  return model.body(joint + 1);
}

}  // namespace

int q_of(const Model& model, const std::string& link) { return free_body(model, link).q_index; }

int v_of(const Model& model, const std::string& link) { return free_body(model, link).v_index; }

double drift(const Model& model, const VectorX& q, const VectorX& q_start) {
  double most = 0.0;
  for (int i = 1; i < model.num_bodies(); ++i) {
    if (model.body(i).joint_type != JointType::kFloating) continue;
    const int at = model.body(i).q_index;
    most = std::max(most, (q.segment<3>(at) - q_start.segment<3>(at)).norm());
  }
  return most;
}

}  // namespace counterpoint::apps
