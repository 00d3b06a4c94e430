#include "optimize/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/model/text_files.h"
#include "measure/median.h"
#include "tasks/archive.h"

namespace counterpoint::optimization {

template <class Archive>
void serialize(Archive& a, Progress& progress) {
  a(apps::tasks::as_in_memory(progress));
}
template <class Archive>
void serialize(Archive& a, Result& r) {
  using apps::tasks::as_in_memory;
  a(r.outcome, r.q, r.v, r.applied_force, r.cost, r.cost_by_term, as_in_memory(r.unactuated),
    as_in_memory(r.violation), r.smoothing, as_in_memory(r.options), r.iterations, r.stages,
    r.refused_stages, r.history, r.seconds);
}

}  // namespace counterpoint::optimization

namespace counterpoint::apps {

namespace opt = optimization;

template <class Archive>
void serialize(Archive& a, OptimizedStart& start) {
  a(start.seed, start.result, tasks::as_in_memory(start.verification), start.stages);
}

std::string bytes_of(const OptimizedStart& start) { return tasks::to_bytes(start); }

OptimizedStart start_of(const std::string& bytes) {
  return tasks::from_bytes<OptimizedStart>(bytes);
}

bool is_better(const OptimizedStart& a, const OptimizedStart& b) {
  if (a.feasible() != b.feasible()) return a.feasible();
  if (!a.feasible()) return a.result.violation.max < b.result.violation.max;
  return a.result.cost < b.result.cost;
}

void write_fit(const std::string& file, const opt::ProblemFile& problem, const opt::Fit& fit) {
  const Model& model = *problem.problem.model;
  opt::RepeatedMotion motion;
  motion.q = fit.q;
  motion.v = motion.applied_force = std::vector<VectorX>(fit.q.size(), VectorX::Zero(model.nv()));
  for (std::size_t t = 1; t < fit.q.size(); ++t) {
    configuration_difference(model, fit.q[t - 1], fit.q[t], motion.v[t]);
    motion.v[t] /= problem.problem.h();
  }
  motion.v[0] = motion.v[1];
  write_motion(file, model, problem.problem.h(), motion);
}

void fill_fit(const opt::Fit& fit, const opt::ProblemFile& problem, const OptimizedStart& start,
              Json& out) {
  const Model& model = *problem.problem.model;
  out["fit_iterations"] = fit.iterations;
  Json& errors = out["fit_rms"] = Json::object();
  for (const opt::FitError& error : fit.errors) errors[error.name] = error.rms;
  const VectorX rms = opt::rms_deviation(model, fit.q, start.result.q);
  double joints = 0.0, place = 0.0, turn = 0.0, worst = 0.0;
  int count = 0;
  std::string worst_name;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const auto own = rms.segment(body.v_index, joint_nv(body.joint_type));
    if (body.joint_type == JointType::kFloating) {
      place = std::max(place, own.head<3>().norm());
      turn = std::max(turn, own.tail<3>().norm());
      continue;
    }
    joints += own.squaredNorm();
    count += joint_nv(body.joint_type);
    if (own.maxCoeff() <= worst) continue;
    worst = own.maxCoeff();
    worst_name = model.joint(i - 1).name;
  }
  out["joint_deviation_rms"] = count > 0 ? std::sqrt(joints / count) : 0.0;
  out["joint_deviation_rms_max"] = worst;
  out["joint_deviation_rms_max_joint"] = worst_name;
  out["base_deviation_rms_m"] = place;
  out["base_deviation_rms_rad"] = turn;
}

void print_fit(Report& report) {
  const Json& json = report.json();
  std::string errors;
  for (const auto& [name, rms] : json["fit_rms"].items())
    errors += fmt::format("{}{} {:.3g}", errors.empty() ? "" : ", ", name, rms.get<double>());
  report.print(
      "fit: rms {} (m, rad); the motion leaves it by {}\n", errors,
      format_entries("{joint_deviation_rms:.3g} rad rms (largest: "
                     "{joint_deviation_rms_max_joint} {joint_deviation_rms_max:.3g}), base "
                     "{base_deviation_rms_m:.3g} m, {base_deviation_rms_rad:.3g} rad",
                     json));
}

Json read_json(const std::string& file) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file))
    throw InputError(fmt::format("{}: {}", file, why_unreadable(file)));
  Json json = Json::parse(stream, nullptr, false);
  if (json.is_discarded()) throw InputError(file + ": is no JSON");
  return json;
}

std::vector<VectorX> frames_from(const std::string& file, opt::Problem& problem) {
  const Model& model = *problem.model;
  const Trajectory trajectory = read_trajectory(file, model);
  const int rows = trajectory.num_rows(), steps = problem.steps;
  if (problem.duration && rows > 1)
    problem.options.time_step = (trajectory.time.back() - trajectory.time.front()) / steps;
  std::vector<VectorX> frames;
  VectorX difference(model.nv());
  for (int t = 0; t <= steps; ++t) {
    const double at = static_cast<double>(t) * (rows - 1) / steps;
    const int row = std::min(static_cast<int>(at), std::max(rows - 2, 0));
    VectorX q = trajectory.q.col(row);
    if (at > row && rows > 1) {
      configuration_difference(model, trajectory.q.col(row), trajectory.q.col(row + 1), difference);
      integrate_configuration(model, trajectory.q.col(row), difference, at - row, q);
    }
    frames.push_back(q);
  }
  return frames;
}

void fill_report(const OptimizedStart& start, Json& out) {
  const opt::Result& result = start.result;
  const opt::Verification& found = start.verification;
  std::vector<double> times;
  for (const opt::Progress& p : result.history)
    times.push_back(1e3 *
                    (p.step.linearize_seconds + p.step.factor_seconds + p.step.trial_seconds));
  out["status"] = result.outcome == opt::Outcome::kStopped ? "stopped"
                  : start.feasible()                       ? "ok"
                                                           : "infeasible";
  out["outcome"] = opt::outcome_name(result.outcome);
  out["seed"] = start.seed;
  out["cost"] = result.cost;
  out["iterations"] = result.iterations;
  out["stages"] = result.stages;
  out["refused_stages"] = result.refused_stages;
  out["wall_seconds"] = result.seconds;
  out["newton_step_ms"] = times.empty() ? 0.0 : median(times);
  for (const auto& [key, part] :
       {std::pair("newton_linearize_ms", &opt::Iteration::linearize_seconds),
        std::pair("newton_factor_ms", &opt::Iteration::factor_seconds),
        std::pair("newton_trial_ms", &opt::Iteration::trial_seconds)}) {
    times.clear();
    for (const opt::Progress& p : result.history) times.push_back(1e3 * p.step.*part);
    out[key] = times.empty() ? 0.0 : median(times);
  }
  out["smoothing_end_m"] = result.smoothing;
  out["time_step_s"] = result.options.time_step;
  out["duration_s"] = result.options.time_step * static_cast<double>(result.applied_force.size());
  out["unactuated_force_relative_max"] = found.unactuated_max;
  out["unactuated_force_relative_mean"] = found.unactuated_mean;
  out["violation_max"] = result.violation.max;
  out["forward_check_max"] = found.forward_check_max;
  out["forward_failures"] = found.forward_failures;
  out["overlap_max_m"] = found.overlap_max;
  out["cone_violation_max"] = found.cone_violation_max;
  out["stance_slip_max_m"] = found.stance_slip_max;
  out["landing_slip_max_m"] = found.landing_slip_max;
  out["effort_share_max"] = found.effort_max;
  out["contact_force_relative_max"] = found.contact_force_max;
}

void write_iterations(const std::string& file, const opt::Result& result) {
  TableWriter table(file, {"iteration", "stage", "smoothing_m", "penalty", "cost",
                           "unactuated_force_relative_max", "unactuated_force_relative_mean",
                           "violation_max", "accepted", "trials", "step_max", "damping", "seconds",
                           "linearize_ms", "factor_ms", "trial_ms"});
  for (const opt::Progress& p : result.history) {
    for (const double x :
         {static_cast<double>(p.iteration), static_cast<double>(p.stage), p.smoothing, p.penalty,
          p.cost, p.unactuated.max, p.unactuated.mean, p.violation.max, p.step.accepted ? 1.0 : 0.0,
          static_cast<double>(p.step.trials), p.step.step, p.step.damping, p.seconds,
          1e3 * p.step.linearize_seconds, 1e3 * p.step.factor_seconds, 1e3 * p.step.trial_seconds})
      table.number(x);
    table.end_row();
  }
  table.finish();
}

}  // namespace counterpoint::apps
