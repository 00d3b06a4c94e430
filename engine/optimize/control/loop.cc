#include <algorithm>
#include <cmath>
#include <ctime>

#include "counterpoint/engine/optimize/control.h"
#include "counterpoint/engine/optimize/control/normal.h"
#include "counterpoint/engine/optimize/newton/wall_clock.h"
#include "counterpoint/engine/optimize/settle.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint::optimization {
namespace {

/// Processor time of this thread [s], which depends little on other load of the machine.
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Seconds of a planner: processor time of one thread, or wall time of several.
class Stopwatch {
 public:
  explicit Stopwatch(int threads) : wall_(threads != 1), start_(now()) {}
  double seconds() const { return now() - start_; }

 private:
  double now() const { return wall_ ? optimization::seconds() : thread_seconds(); }
  bool wall_;
  double start_;
};

class Loop {
 public:
  Loop(const ControlFile& control, const Scene& world, std::uint64_t seed,
       const WorldErrors& errors)
      : control_(control),
        model_(*control.file.problem.model),
        errors_(errors),
        normal_(seed),
        planner_(control.file.problem, control.planner),
        simulator_(scene_of(world, control.plant_step)) {
    State state = simulator_.state();
    state.q = control.file.problem.start_q;
    state.v = control.file.problem.start_v;
    if (control.file.problem.settle) {
      Workspace workspace(simulator_.model());
      state.q = settled(simulator_.model(), simulator_.options(), control.file.problem.motors,
                        state.q, workspace);
    }
    if (seed != 0) perturb(state);
    simulator_.set_state(state);
    measured_q_ = state.q;
    measured_v_ = state.v;
    force_.setZero(model_.nv());
    noise_.setZero(model_.nv());
  }

  ControlRun run(const std::function<bool(double)>& keep_on) {
    const long steps = std::lround(control_.duration / control_.plant_step);
    for (long i = 0; i < steps; ++i) {
      if (keep_on && !keep_on(simulator_.state().time)) {
        run_.stopped = true;
        break;
      }
      if (!step()) break;
    }
    run_.states.push_back(simulator_.state());
    if (!run_.replan_seconds.empty())
      run_.violation_mean /= static_cast<double>(run_.replan_seconds.size());
    judge();
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

  void replan() {
    const Stopwatch watch(control_.planner.threads);
    const ReplanReport report = planner_.replan(plan_from_.time, plan_from_.q, plan_from_.v);
    run_.replan_seconds.push_back(watch.seconds());
    run_.violation_mean += report.violation.mean;
    run_.restarts += report.restarted;
    pending_ = false;
  }

  bool step() {
    const double now = simulator_.state().time, slack = 1e-3 * control_.plant_step;
    const bool first = run_.replan_seconds.empty();
    measure();
    const VectorX &q = measured_q_, &v = measured_v_;
    if (!pending_ && now >= next_replan_ - slack) {
      pending_ = true;
      plan_from_ = {now, q, v};
      next_replan_ += control_.interval;
    }
    if (pending_ && (first || now >= plan_from_.time + errors_.delay - slack)) replan();
    planner_.force(now, control_.gains, q, v, force_);
    Input& input = simulator_.input();
    input.applied_force = force_;
    input.wrenches.clear();
    for (const Push& push : control_.pushes)
      if (now >= push.start - slack && now < push.start + push.duration - slack)
        input.wrenches.push_back(
            {push.body, {Vector3::Zero(), push.force}, model_.body(push.body).inertia.center});
    run_.states.push_back(simulator_.state());
    run_.applied_force.push_back(force_);
    const double before = thread_seconds();
    const StepReport report = simulator_.step();
    run_.world_seconds += thread_seconds() - before;
    if (!report.succeeded()) run_.fault = report.fault;
    return report.succeeded();
  }

  void judge() {
    const double end = run_.states.back().time;
    const bool finished = end > control_.duration - 0.5 * control_.plant_step;
    for (const SuccessTest& test : control_.success) {
      double error = 0.0;
      if (test.rate) {
        const State& last = run_.states.back();
        const auto from = std::find_if(run_.states.begin(), run_.states.end(), [&](const State& s) {
          return s.time >= test.from - 0.5 * control_.plant_step;
        });
        error = from == run_.states.end() || !(last.time > from->time)
                    ? std::numeric_limits<double>::infinity()
                    : test.error((last.q[test.q_index] - from->q[test.q_index]) /
                                 (last.time - from->time));
      } else if (test.always) {
        for (const State& s : run_.states)
          if (s.time >= test.from) error = std::max(error, test.error(s.q[test.q_index]));
      } else {
        error = test.error(run_.states.back().q[test.q_index]);
      }
      run_.error.push_back(error);
      run_.passed.push_back(finished && error <= test.allowed());
    }
  }

  const ControlFile& control_;
  const Model& model_;
  WorldErrors errors_;
  NormalNumbers normal_;
  Planner planner_;
  Simulator simulator_;
  ControlRun run_;
  State plan_from_;
  VectorX measured_q_, measured_v_, force_, noise_;
  double next_replan_ = 0.0;
  bool pending_ = false;
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

ControlRun run_control(const ControlFile& control, const Scene& world, std::uint64_t seed,
                       const WorldErrors& errors, const std::function<bool(double)>& keep_on) {
  return Loop(control, world, seed, errors).run(keep_on);
}

}  // namespace counterpoint::optimization
