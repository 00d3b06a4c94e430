#include <algorithm>
#include <cmath>
#include <future>

#include "counterpoint/engine/clocks.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/control.h"
#include "counterpoint/engine/optimize/control/normal.h"
#include "counterpoint/engine/optimize/settle.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint::optimization {
namespace {

/// Seconds of a planner: processor time of one thread, or wall time of several.
class Stopwatch {
 public:
  explicit Stopwatch(int threads) : wall_(threads != 1), start_(now()) {}
  double seconds() const { return now() - start_; }

 private:
  double now() const { return wall_ ? wall_seconds() : thread_seconds(); }
  bool wall_;
  double start_;
};

/// Judges the success tests of a run while it goes on.
class Judge {
 public:
  explicit Judge(const ControlFile& control)
      : control_(control), half_step_(0.5 * control.plant_step), seen_(control.success.size()) {}

  void see(const State& state) {
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const SuccessTest& test = control_.success[i];
      const double value = state.q[test.q_index];
      if (test.always && state.time >= test.from)
        seen_[i].error = std::max(seen_[i].error, test.error(value));
      if (test.rate && !seen_[i].from && state.time >= test.from - half_step_)
        seen_[i].from = {state.time, value};
    }
  }

  void conclude(const State& end, ControlRun& run) const {
    const bool finished = end.time > control_.duration - half_step_;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const SuccessTest& test = control_.success[i];
      const double value = end.q[test.q_index];
      run.error.push_back(test.rate     ? rate_error(test, seen_[i], end.time, value)
                          : test.always ? seen_[i].error
                                        : test.error(value));
      run.passed.push_back(finished && run.error.back() <= test.allowed());
    }
  }

 private:
  struct Seen {
    double error = 0.0;                             ///< largest so far [m, rad]
    std::optional<std::pair<double, double>> from;  ///< first time [s] and value
  };

  static double rate_error(const SuccessTest& test, const Seen& seen, double time, double value) {
    if (!seen.from || !(time > seen.from->first)) return std::numeric_limits<double>::infinity();
    return test.error((value - seen.from->second) / (time - seen.from->first));
  }

  const ControlFile& control_;
  double half_step_;
  std::vector<Seen> seen_;
};

/// A plan that is made, but not yet in use.
struct Prepared {
  ReplanReport report;
  double seconds = 0.0;
};

class Loop {
 public:
  Loop(const ControlFile& control, const Scene& world, std::uint64_t seed,
       const WorldErrors& errors, const ControlHooks& hooks)
      : control_(control),
        model_(*control.file.problem.model),
        errors_(errors),
        hooks_(hooks),
        judge_(control),
        gains_(control.gains),
        pushes_(input_columns(control)),
        push_values_(VectorX::Zero(6 * static_cast<Eigen::Index>(pushes_.links.size()))),
        normal_(seed),
        planner_(control.file.problem, control.planner),
        simulator_(scene_of(world, control.plant_step)),
        dynamics_(simulator_.model()) {
    State state = simulator_.state();
    state.q = control_start(control, simulator_.scene());
    state.v = control.file.problem.start_v;
    if (seed != 0) perturb(state);
    simulator_.set_state(state);
    measured_q_ = state.q;
    measured_v_ = state.v;
    begin_servos();
    force_.setZero(model_.nv());
    planned_force_ = force_;
    noise_.setZero(model_.nv());
    moved_.setZero(model_.nv());
  }

  ControlRun run() {
    const double start = wall_seconds();
    const long steps = std::lround(control_.duration / control_.plant_step);
    judge_.see(simulator_.state());
    for (long i = 0; i < steps; ++i) {
      if (hooks_.keep_on && !hooks_.keep_on(simulator_.state().time)) {
        run_.stopped = true;
        break;
      }
      if (!step()) break;
      judge_.see(simulator_.state());
    }
    run_.end = simulator_.state();
    run_.wall_seconds = wall_seconds() - start;
    if (!run_.replan_seconds.empty())
      run_.violation_mean /= static_cast<double>(run_.replan_seconds.size());
    judge_.conclude(run_.end, run_);
    return std::move(run_);
  }

 private:
  static Scene scene_of(const Scene& world, double step) {
    Scene scene = world;
    scene.options.time_step = step;
    return scene;
  }

  void perturb(State& state) {
    const Perturbation& p = control_.perturbation;
    VectorX change = VectorX::Zero(model_.nv());
    for (int i = 1; i < model_.num_bodies(); ++i) {
      const Body& body = model_.body(i);
      const bool base = body.joint_type == JointType::kFloating;
      for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k) {
        change[k] = (base ? 0.0 : p.position) * normal_();
        state.v[k] += (base ? p.base_velocity : p.velocity) * normal_();
        if (p.extra.size() > 0 && p.extra[k] > 0.0) change[k] = p.extra[k] * normal_();
      }
    }
    const VectorX q = state.q;
    integrate_configuration(model_, q, change, 1.0, state.q);
  }

  void measure() {
    const State& state = simulator_.state();
    measured_q_ = state.q;
    measured_v_ = state.v;
    if (errors_.position_noise == 0.0 && errors_.velocity_noise == 0.0) return;
    for (double& x : noise_) x = errors_.position_noise * normal_();
    integrate_configuration(model_, state.q, noise_, 1.0, measured_q_);
    for (double& x : measured_v_) x += errors_.velocity_noise * normal_();
  }

  /// State at the time when a plan made of the measured one will be used: it moves on as the plan
  /// in use does.
  State predicted(double now) {
    State state{now, measured_q_, measured_v_};
    if (errors_.delay == 0.0) return state;
    planner_.sample(now, planned_q_, planned_v_, force_);
    planner_.sample(now + errors_.delay, next_q_, next_v_, force_);
    configuration_difference(model_, planned_q_, next_q_, moved_);
    integrate_configuration(model_, measured_q_, moved_, 1.0, state.q);
    state.v += next_v_ - planned_v_;
    state.time += errors_.delay;
    return state;
  }

  /// Makes the next plan from plan_from_, in this or another thread.
  Prepared prepare() {
    const Stopwatch watch(control_.planner.threads);
    const ReplanReport report = planner_.prepare(plan_from_.time, plan_from_.q, plan_from_.v);
    return {report, watch.seconds()};
  }

  void adopt(const Prepared& prepared) {
    planner_.adopt();
    run_.replan_seconds.push_back(prepared.seconds);
    if (hooks_.replanned) hooks_.replanned(planner_, prepared.report, prepared.seconds);
    run_.violation_mean += prepared.report.violation.mean;
    run_.restarts += prepared.report.restarted;
    pending_ = false;
  }

  bool step() {
    const double now = simulator_.state().time, slack = 1e-3 * control_.plant_step;
    const bool first = run_.replan_seconds.empty();
    measure();
    const VectorX &q = measured_q_, &v = measured_v_;
    if (!pending_ && now >= next_replan_ - slack) {
      pending_ = true;
      plan_from_ = first ? State{now, q, v} : predicted(now);
      next_replan_ += control_.interval;
      if (control_.own_thread && !first)
        other_thread_ = std::async(std::launch::async, [this] { return prepare(); });
    }
    if (pending_ && now >= plan_from_.time - slack)
      adopt(other_thread_.valid() ? other_thread_.get() : prepare());
    planner_.force(now, gains_, q, v, force_);
    simulator_.input().applied_force = force_;
    set_servos(now);
    push(now);
    if (hooks_.step) before_ = simulator_.state();
    const double start = thread_seconds();
    const StepReport report = simulator_.step();
    run_.world_seconds += thread_seconds() - start;
    if (!report.succeeded()) {
      run_.fault = report.fault;
    } else if (hooks_.step) {
      hooks_.step(before_, simulator_.input(), control_.plant_step, simulator_.state(), report);
    }
    return report.succeeded();
  }

  /// Lets the servos of the world do the feedback of their joints.
  void begin_servos() {
    const Model& world = simulator_.model();
    pushes_.targets = false;
    if (!simulator_.scene().options.effects.has(Effect::kServos)) return;
    for (std::size_t i = 0; i < world.servos().size(); ++i) {
      const Body& body = world.body(world.servos()[i].joint + 1);
      if (!control_.file.problem.motors[static_cast<std::size_t>(body.v_index)]) continue;
      gains_.stiffness[body.v_index] = gains_.damping[body.v_index] = 0.0;
      servos_.push_back({static_cast<Eigen::Index>(i), body.q_index, body.v_index});
    }
    if (servos_.empty()) return;
    Input& input = simulator_.input();
    const InputColumns targets{true, {}};
    targets.set(world, targets.values(world, input), input);
  }

  /// Sets the servos' targets to the plan at the end of the step.
  void set_servos(double now) {
    if (servos_.empty()) return;
    planner_.sample(now + control_.plant_step, next_q_, next_v_, planned_force_);
    for (const auto& [servo, q_index, v_index] : servos_) {
      simulator_.input().servo_position[servo] = next_q_[q_index];
      simulator_.input().servo_velocity[servo] = next_v_[v_index];
    }
  }

  /// Sets the wrenches on pushed links, about their origins as in a table of the run.
  void push(double now) {
    const double slack = 1e-3 * control_.plant_step;
    push_values_.setZero();
    for (const Push& push : control_.pushes) {
      if (now < push.start - slack || now >= push.start + push.duration - slack) continue;
      const auto column = std::find(pushes_.links.begin(), pushes_.links.end(), push.link);
      const Model& world = simulator_.model();
      const Frame& link = world.frames()[static_cast<std::size_t>(push.link)];
      dynamics_.set_configuration(simulator_.state().q);
      const Vector3 center = world.body(link.body).inertia.center - link.X_BF.translation;
      const Matrix3 R_WB =
          dynamics_.frame_pose(push.link).rotation * link.X_BF.rotation.transpose();
      auto wrench = push_values_.segment<6>(6 * (column - pushes_.links.begin()));
      wrench.head<3>() += push.force;
      wrench.tail<3>() += (R_WB * center).cross(push.force);
    }
    pushes_.set(simulator_.model(), push_values_, simulator_.input());
  }

  const ControlFile& control_;
  const Model& model_;
  WorldErrors errors_;
  const ControlHooks& hooks_;
  Judge judge_;
  FeedbackGains gains_;  ///< zero where a servo follows the plan
  struct Servo {
    Eigen::Index servo;  ///< index into Model::servos
    int q_index, v_index;
  };
  std::vector<Servo> servos_;  ///< servos of motors
  InputColumns pushes_;
  VectorX push_values_;  ///< values of the columns
  NormalNumbers normal_;
  Planner planner_;
  Simulator simulator_;
  Dynamics dynamics_;  ///< for poses of the world's links
  ControlRun run_;
  State plan_from_, before_;
  VectorX measured_q_, measured_v_, force_, noise_;
  VectorX planned_q_, planned_v_, next_q_, next_v_, moved_, planned_force_;
  double next_replan_ = 0.0;
  bool pending_ = false;
  std::future<Prepared> other_thread_;  ///< destroyed first: it uses the members above
};

}  // namespace

double SuccessTest::error(double value) const {
  if (std::isfinite(low) && std::isfinite(high)) return std::abs(value - 0.5 * (low + high));
  return std::max({0.0, low - value, value - high});
}

double SuccessTest::allowed() const {
  return std::isfinite(low) && std::isfinite(high) ? 0.5 * (high - low) : 0.0;
}

bool ControlRun::success() const {
  return std::all_of(passed.begin(), passed.end(), [](char one) { return one != 0; });
}

Scene scaled_world(const Scene& scene, double mass_factor, double friction_factor) {
  ModelEditor editor(scene.model);
  for (int i = 1; i < scene.model.num_bodies(); ++i) {
    const double mass = scene.model.body(i).inertia.mass;
    if (mass > 0.0) editor.set_mass(i, mass_factor * mass);
  }
  for (std::size_t g = 0; g < scene.model.geometries().size(); ++g) {
    Material material = scene.model.geometries()[g].material;
    material.friction *= friction_factor;
    editor.set_material(static_cast<int>(g), material);
  }
  Scene out = scene;
  out.model = editor.take();
  return out;
}

VectorX control_start(const ControlFile& control, const Scene& world) {
  const Problem& problem = control.file.problem;
  if (!problem.settle) return problem.start_q;
  SimulationOptions options = world.options;
  options.time_step = control.plant_step;
  options.effects.set(Effect::kServos, false);
  Workspace workspace(world.model);
  return settled(world.model, options, problem.motors, problem.start_q, workspace);
}

ControlRun run_control(const ControlFile& control, const Scene& world, std::uint64_t seed,
                       const WorldErrors& errors, const ControlHooks& hooks) {
  return Loop(control, world, seed, errors, hooks).run();
}

}  // namespace counterpoint::optimization
