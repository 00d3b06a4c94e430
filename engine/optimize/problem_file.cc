#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/control/normal.h"
#include "counterpoint/engine/optimize/files/pose_reader.h"
#include "counterpoint/engine/optimize/files/term_reader.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/engine/optimize/retarget.h"
#include "counterpoint/engine/optimize/settle.h"
#include "counterpoint/engine/optimize/terms/evaluator.h"

namespace counterpoint::optimization {
namespace {

/// Reads one problem file from top to bottom.
class ProblemReader {
 public:
  ProblemReader(const std::filesystem::path& file, std::optional<int> steps,
                const SourceFiles& source)
      : root_(YamlValue::load(file)), steps_(steps), source_files_(source) {
    root_.expect_map({"name", "scene", "time_step", "steps", "start", "goal", "periodic", "guess",
                      "passive", "terms", "continuation", "max_iterations", "stage_iterations",
                      "tolerance", "violation_tolerance", "control", "retarget", "duration"});
    out_.file = file;
    out_.name = root_.has("name") ? root_.at("name").text() : file.stem().string();
    const std::filesystem::path scene = root_.at("scene").text();
    out_.scene_file = scene.is_absolute() ? scene : file.parent_path() / scene;
    out_.scene = std::make_shared<const Scene>(load_scene(out_.scene_file));
  }

  ProblemFile read() {
    TargetSources sources{TargetReader(out_.file.parent_path()), {}};
    Problem& problem = out_.problem;
    const Model& model = out_.scene->model;
    problem.model = &model;
    problem.options = out_.scene->options;
    if (root_.has("time_step")) problem.options.time_step = root_.at("time_step").positive();
    problem.steps = steps_ ? *steps_ : root_.at("steps").integer(4, 100'000);
    if (root_.has("duration")) read_duration(root_.at("duration"));
    problem.motors = motors_of(model);
    if (root_.has("passive")) read_passive(root_.at("passive"));
    read_continuation();
    read_ends();
    if (root_.has("periodic")) read_periodic(root_.at("periodic"));
    if (root_.has("retarget")) read_retargeting(root_.at("retarget"), sources);
    for (const YamlValue& entry : root_.at("terms").list()) {
      if (follows_fit(entry)) {
        if (!retargeting_) entry.at("target").fail("there is no 'retarget' in this file");
        retargeting_->followers.push_back(problem.terms.size());
      }
      for (Term& term : read_terms(entry, problem, start_, goal_, sources))
        problem.terms.push_back(std::move(term));
    }
    out_.retargeting = retargeting_;
    bool pushed = false;
    for (const Term& term : problem.terms)
      pushed = pushed || term.quantity == Quantity::kUnactuatedForce;
    if (!pushed) problem.terms.push_back(unactuated_condition(model, problem.motors));
    for (const auto& [target_file, table] : sources.tables.tables())
      out_.read_files.push_back(target_file);
    set_targets(problem, 0.0);
    check_problem(problem);
    make_guess();
    return std::move(out_);
  }

 private:
  /// Reads the motion to follow and the terms of its fit. Needs start and goal.
  void read_retargeting(const YamlValue& in, TargetSources& sources) {
    if (out_.problem.periodic) in.fail("a periodic motion follows files: see 'target'");
    sources.motion.emplace(in, source_files_, out_.scene, out_.file);
    retargeting_ = std::make_shared<Retargeting>();
    retargeting_->motion_file = sources.motion->motion_file();
    retargeting_->scene_file = sources.motion->scene_file();
    Problem& fit = retargeting_->fit;
    fit = out_.problem;
    fit.free_start = true;
    fit.goal_q.reset();
    for (const YamlValue& entry : in.at("fit").list())
      for (Term& term : read_terms(entry, fit, start_, goal_, sources)) {
        if (of_step(term.quantity) && term.quantity != Quantity::kAcceleration)
          entry.fail(
              "the fit knows no forces: a quantity of a frame or 'acceleration' is expected");
        fit.terms.push_back(std::move(term));
      }
    set_targets(fit, 0.0);
    check_problem(fit);
  }

  VectorX read_pose_of(const YamlValue& in, VectorX q) const {
    if (in.has("pose")) read_pose(in.at("pose"), out_.scene->model, q);
    return q;
  }

  VectorX read_velocity_of(const YamlValue& in) const {
    VectorX v = VectorX::Zero(out_.scene->model.nv());
    if (in.has("velocity")) {
      if (!in.at("velocity").is_map())
        in.at("velocity").fail("a map {coordinate: value} is expected");
      read_by_velocity(in.at("velocity"), out_.scene->model, v);
    }
    return v;
  }

  void read_ends() {
    Problem& problem = out_.problem;
    start_ = out_.scene->q;
    problem.start_v = VectorX::Zero(out_.scene->model.nv());
    if (root_.has("start")) {
      const YamlValue start = root_.at("start");
      start.expect_map({"pose", "velocity", "stand", "fixed"});
      start_ = read_pose_of(start, start_);
      problem.start_v = read_velocity_of(start);
      problem.settle = start.has("stand") && start.at("stand").boolean();
      problem.free_start = start.has("fixed") && !start.at("fixed").boolean();
    }
    if (problem.settle) start_ = standing(start_);
    problem.start_q = start_;
    end_ = start_;
    if (!root_.has("goal")) return;
    const YamlValue goal = root_.at("goal");
    goal.expect_map({"pose", "velocity", "fixed"});
    end_ = read_pose_of(goal, start_);
    problem.goal_v = read_velocity_of(goal);
    goal_ = end_;
    if (!goal.has("fixed") || goal.at("fixed").boolean()) problem.goal_q = end_;
  }

  /// The pose in which a robot stands with little smoothing; poses and costs of the file refer to
  /// it.
  VectorX standing(const VectorX& q) const {
    SimulationOptions options = stage_at(out_.problem, out_.settings, kStandingSmoothing).options;
    Workspace workspace(out_.scene->model);
    return settled(out_.scene->model, options, out_.problem.motors, q, workspace);
  }

  void read_periodic(const YamlValue& in) {
    in.expect_map({"displacement", "mirror"});
    Problem& problem = out_.problem;
    if (problem.goal_q) in.fail("a periodic motion has no goal: remove one of the two");
    problem.periodic = true;
    problem.displacement = in.at("displacement").vector3();
    if (!in.has("mirror")) return;
    const std::vector<YamlValue> sides = in.at("mirror").list();
    if (sides.size() != 2) in.at("mirror").fail("two words are expected, as [left_, right_]");
    try {
      problem.mirror = make_mirror(out_.scene->model, sides[0].text(), sides[1].text());
    } catch (const InputError& error) {
      in.at("mirror").fail(error.what());
    }
    if (problem.displacement.y() != 0.0)
      in.at("displacement").fail("a mirrored motion cannot go along y; expected [x, 0, z]");
  }

  /// Reads the range of a free duration. The guess has the time step, moved into the range.
  void read_duration(const YamlValue& in) {
    if (root_.has("retarget")) in.fail("a motion is followed at its own speed: remove 'duration'");
    const std::vector<double> range = in.numbers();
    if (range.size() != 2 || !(range[0] > 0.0) || !(range[0] < range[1]))
      in.fail("[least, most] in s is expected, 0 < least < most");
    Problem& problem = out_.problem;
    problem.duration = {range[0], range[1]};
    double& h = problem.options.time_step;
    h = std::clamp(h, range[0] / problem.steps, range[1] / problem.steps);
  }

  /// Reads joints whose motors are inactive.
  void read_passive(const YamlValue& in) {
    const Model& model = out_.scene->model;
    for (const YamlValue& name : in.list()) {
      const int joint = model.find_joint(name.text());
      if (joint < 0) name.fail(fmt::format("the scene has no joint '{}'", name.text()));
      const Body& body = model.body(joint + 1);
      for (int k = 0; k < joint_nv(body.joint_type); ++k)
        out_.problem.motors[static_cast<std::size_t>(body.v_index + k)] = 0;
    }
  }

  void read_continuation() {
    Settings& settings = out_.settings;
    if (root_.has("max_iterations"))
      settings.max_iterations = root_.at("max_iterations").integer(1, 1'000'000);
    if (root_.has("stage_iterations"))
      settings.stage_iterations = root_.at("stage_iterations").integer(1, 1'000'000);
    if (root_.has("tolerance")) settings.tolerance = root_.at("tolerance").positive();
    if (root_.has("violation_tolerance"))
      settings.violation_tolerance = root_.at("violation_tolerance").positive();
    if (!root_.has("continuation")) return;
    const YamlValue in = root_.at("continuation");
    in.expect_map({"start", "end", "factor", "max_factor", "extrapolate", "hard_factor",
                   "compliance_per_metre", "margin_per_smoothing", "quick_recovery_above",
                   "limits_below", "penalty_start", "penalty_end", "rounds", "multiplier_limit",
                   "contact_damping"});
    Continuation& c = settings.continuation;
    read_positive(in, "start", c.start);
    if (in.has("end")) c.end = in.at("end").positive();
    read_positive(in, "factor", c.factor);
    read_positive(in, "max_factor", c.max_factor);
    if (in.has("extrapolate")) c.extrapolate = in.at("extrapolate").boolean();
    read_positive(in, "hard_factor", c.hard_factor);
    read_positive(in, "compliance_per_metre", c.compliance_per_metre);
    read_positive(in, "margin_per_smoothing", c.margin_per_smoothing);
    read_positive(in, "quick_recovery_above", c.quick_recovery_above);
    read_positive(in, "limits_below", c.limits_below);
    read_positive(in, "penalty_start", c.penalty_start);
    read_positive(in, "penalty_end", c.penalty_end);
    read_positive(in, "multiplier_limit", c.multiplier_limit);
    read_positive(in, "contact_damping", c.contact_damping);
    if (in.has("rounds")) c.rounds = in.at("rounds").integer(1, 1000);
    for (const char* key : {"factor", "max_factor", "hard_factor"})
      if (in.has(key) && !(in.at(key).number() > 1.0))
        in.at(key).fail("smoothing has to fall: a number above 1 is expected");
  }

  /// Guess: targets of a configuration from a file, or a straight line from start to goal or along
  /// the displacement; plus waves.
  void make_guess() {
    const Problem& problem = out_.problem;
    const Model& model = *problem.model;
    VectorX end = end_;
    if (problem.periodic)
      for (int i = 1; i < model.num_bodies(); ++i)
        if (model.body(i).joint_type == JointType::kFloating)
          end.segment<3>(model.body(i).q_index) += problem.displacement;
    out_.guess = straight_line(model, start_, end, problem.steps);
    for (const Term& term : problem.terms)
      if (term.quantity == Quantity::kConfiguration && !term.targets.empty())
        out_.guess = term.targets;
    if (!root_.has("guess")) return;
    const YamlValue in = root_.at("guess");
    in.expect_map({"waves", "noise"});
    if (in.has("noise")) out_.noise = in.at("noise").number(0.0, 10.0);
    if (!in.has("waves")) return;
    for (const YamlValue& wave : in.at("waves").list()) {
      wave.expect_map({"amplitude", "cycles", "phase"});
      VectorX amplitude = VectorX::Zero(model.nv());
      read_by_velocity(wave.at("amplitude"), model, amplitude);
      const double cycles = wave.has("cycles") ? wave.at("cycles").number() : 0.5;
      const double phase = wave.has("phase") ? wave.at("phase").number() : 0.0;
      for (int t = 0; t <= problem.steps; ++t) {
        VectorX& q = out_.guess[static_cast<std::size_t>(t)];
        const double angle = 2.0 * std::numbers::pi * (cycles * t / problem.steps + phase);
        integrate_configuration(model, q, amplitude, std::cos(angle), q);
      }
    }
  }

  static constexpr double kStandingSmoothing = 1e-4;

  const YamlValue root_;
  const std::optional<int> steps_;
  const SourceFiles source_files_;
  ProblemFile out_;
  std::shared_ptr<Retargeting> retargeting_;
  VectorX start_, end_, goal_;
};

}  // namespace

ProblemFile load_problem(const std::filesystem::path& file, std::optional<int> steps) {
  return load_problem(file, steps, {});
}

ProblemFile load_problem(const std::filesystem::path& file, std::optional<int> steps,
                         const SourceFiles& source) {
  ProblemFile out = ProblemReader(file, steps, source).read();
  if (out.retargeting == nullptr && !(source.motion.empty() && source.scene.empty()))
    throw InputError(file.string() + ": the key 'retarget' is missing, which follows a motion");
  return out;
}

std::vector<VectorX> seeded_guess(const ProblemFile& file, std::uint64_t seed) {
  std::vector<VectorX> frames = file.guess;
  if (seed == 0 || file.noise == 0.0) return frames;
  const Model& model = *file.problem.model;
  NormalNumbers normal(seed);
  VectorX change = VectorX::Zero(model.nv());
  for (VectorX& q : frames) {
    for (int i = 1; i < model.num_bodies(); ++i) {
      const Body& body = model.body(i);
      if (body.joint_type == JointType::kFloating) continue;
      for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k)
        change[k] = file.noise * normal();
    }
    integrate_configuration(model, q, change, 1.0, q);
  }
  return frames;
}

bool matches(const std::string& pattern, const std::string& name) {
  std::size_t p = 0, n = 0, star = std::string::npos, mark = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      mark = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p;
      ++n;
    } else if (star != std::string::npos) {
      p = star + 1;
      n = ++mark;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

}  // namespace counterpoint::optimization
