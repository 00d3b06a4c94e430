// counterpoint derivatives: derivatives of the forces behind each step of a motion.
#include "counterpoint/engine/derivatives.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "command.h"
#include "counterpoint/engine/clocks.h"
#include "counterpoint/engine/trajectory.h"
#include "input/motion.h"
#include "input/scene_arguments.h"
#include "measure/median.h"
#include "report/report.h"

namespace counterpoint::apps {
namespace {

struct DerivativesArguments {
  SceneArguments scene;
  std::string trajectory, output;
  std::optional<double> time_step, smoothing, compliance;
  double difference_step = 0.0;
  bool check = false, forward = false;
  Report report;
};

struct NamedBlock {
  const char* name;
  const MatrixX* matrix;
};

/// Entry with the largest difference between closed form and finite difference.
struct Worst {
  double relative = 0.0;  ///< difference relative to the block's largest entry
  int step = 0, row = 0, column = 0;
  const char* block = "";
  double exact = 0.0, difference = 0.0;
};

void compare(int step, const NamedBlock& exact, const MatrixX& reference, double floor,
             Worst& worst) {
  Eigen::Index row = 0, column = 0;
  const double apart = (*exact.matrix - reference).cwiseAbs().maxCoeff(&row, &column);
  const double relative = apart / std::max(reference.cwiseAbs().maxCoeff(), floor);
  if (relative <= worst.relative) return;
  worst = {relative,
           step,
           static_cast<int>(row),
           static_cast<int>(column),
           exact.name,
           (*exact.matrix)(row, column),
           reference(row, column)};
}

/// Table with a row for each row of a matrix.
class DerivativesOutput {
 public:
  DerivativesOutput(const std::string& file, const Model& model) : names_(coordinate_names(model)) {
    if (file.empty()) return;
    std::vector<Column> columns{"time", {"block", CellType::kText}, {"row", CellType::kText}};
    columns.insert(columns.end(), names_.v.begin(), names_.v.end());
    table_ = std::make_unique<TableWriter>(file, columns);
  }
  void write(double time, const NamedBlock& block) {
    if (!table_) return;
    const bool forces = std::string(block.name).rfind("u_", 0) == 0;
    for (Eigen::Index i = 0; i < block.matrix->rows(); ++i) {
      table_->number(time);
      table_->text(block.name);
      table_->text((forces ? names_.force : names_.v)[static_cast<size_t>(i)]);
      for (const double x : block.matrix->row(i)) table_->number(x);
      table_->end_row();
    }
  }
  void finish() {
    if (table_) table_->finish();
  }
  const CoordinateNames& names() const { return names_; }

 private:
  CoordinateNames names_;
  std::unique_ptr<TableWriter> table_;
};

/// Computes the scene's first step, for use if no trajectory is given.
Trajectory first_step(const Scene& scene) {
  Workspace workspace(scene.model);
  const State start{0.0, scene.q, scene.v};
  State next = start;
  const StepReport report = step_forward(scene.model, scene.options, contact::Settings(), start,
                                         Input(), workspace, next);
  if (!report.succeeded())
    throw InputError(
        "the scene's first step fails: give a trajectory, or see `counterpoint simulate`");
  Trajectory out;
  find_taut_links(next, out.taut_links.emplace_back());
  out.time = {0.0, scene.options.time_step};
  out.q.resize(scene.model.nq(), 2);
  out.v.resize(scene.model.nv(), 2);
  out.q << start.q, next.q;
  out.v << start.v, next.v;
  return out;
}

/// Computes, times and checks the derivatives step by step.
class DerivativesRun {
 public:
  DerivativesRun(const DerivativesArguments& arguments, const Scene& scene)
      : arguments_(arguments),
        scene_(scene),
        workspace_(scene.model),
        output_(arguments.output, scene.model) {}

  /// Processes step k; returns the fault if its forces cannot be found (see `inverse`).
  Fault step(int k, const Trajectory& trajectory, const SimulationOptions& options,
             const Input& known) {
    const Model& model = scene_.model;
    const auto q = trajectory.q.col(k), q_next = trajectory.q.col(k + 1), v = trajectory.v.col(k),
               v_next = trajectory.v.col(k + 1);
    const double begin = wall_seconds();
    if (arguments_.forward) {
      singular_ += !step_forward_derivatives(model, options, q, v, q_next, v_next, known,
                                             workspace_, inverse_, exact_, forward_);
    } else {
      step_inverse_derivatives(model, options, q, v, q_next, v_next, known, workspace_, inverse_,
                               exact_);
    }
    times_us.push_back(1e6 * (wall_seconds() - begin));
    if (inverse_.fault.any()) return inverse_.fault;
    by_differences += exact_.by_differences;
    const NamedBlock blocks[] = {
        {"u_q", &exact_.dq}, {"u_v", &exact_.dv}, {"u_v_next", &exact_.dv_next}};
    for (const NamedBlock& block : blocks) output_.write(trajectory.time[k], block);
    if (arguments_.forward) {
      for (const NamedBlock& block :
           {NamedBlock{"v_next_q", &forward_.dv_dq}, NamedBlock{"v_next_v", &forward_.dv_dv},
            NamedBlock{"v_next_u", &forward_.dv_du}, NamedBlock{"q_next_q", &forward_.dq_dq},
            NamedBlock{"q_next_v", &forward_.dq_dv}, NamedBlock{"q_next_u", &forward_.dq_du}})
        output_.write(trajectory.time[k], block);
    }
    if (!arguments_.check) return {};
    step_inverse_derivatives(model, options, q, v, q_next, v_next, known, workspace_, inverse_,
                             reference_, DerivativeMethod::kExtrapolated,
                             arguments_.difference_step);
    // A block may be zero, such as du/dq of a free body; this keeps the relative difference finite.
    const double floor = 0.05 * reference_.dv_next.cwiseAbs().maxCoeff();
    const MatrixX* references[] = {&reference_.dq, &reference_.dv, &reference_.dv_next};
    for (int i = 0; i < 3; ++i) compare(k, blocks[i], *references[i], floor, worst);
    return {};
  }
  void finish() { output_.finish(); }
  const CoordinateNames& names() const { return output_.names(); }
  int singular() const { return singular_; }

  Worst worst;
  int by_differences = 0;
  std::vector<double> times_us;

 private:
  const DerivativesArguments& arguments_;
  const Scene& scene_;
  Workspace workspace_;
  DerivativesOutput output_;
  Inverse inverse_;
  InverseDerivatives exact_, reference_;
  ForwardDerivatives forward_;
  int singular_ = 0;
};

void report_check(const DerivativesRun& run, const Trajectory& trajectory, Report& report) {
  const Worst& worst = run.worst;
  report["relative_difference_max"] = worst.relative;
  report.print("largest difference {:.3g} of the largest entry", worst.relative);
  if (worst.relative > 0.0) {
    report["where"] = {{"step", worst.step},
                       {"time_s", trajectory.time[static_cast<size_t>(worst.step)]},
                       {"block", worst.block},
                       {"row", run.names().force[static_cast<size_t>(worst.row)]},
                       {"column", run.names().v[static_cast<size_t>(worst.column)]},
                       {"exact", worst.exact},
                       {"difference", worst.difference}};
    report.print("{}", format_entries(" (step {step}, {block}: {row} by {column}, {exact:.9g} and "
                                      "{difference:.9g})",
                                      report["where"]));
  }
  report.print("\n");
}

int derivatives(DerivativesArguments& arguments) {
  Scene scene = arguments.scene.load();
  if (arguments.smoothing) scene.options.contact.smoothing = *arguments.smoothing;
  if (arguments.compliance) scene.options.contact.compliance = *arguments.compliance;
  const bool given = !arguments.trajectory.empty();
  Trajectory trajectory =
      given ? read_motion(arguments.trajectory, scene.model) : first_step(scene);
  const std::vector<double> steps =
      step_lengths(trajectory, arguments.time_step, scene.options.time_step);
  find_internal_states(scene.model, scene.options, steps, trajectory);
  DerivativesRun run(arguments, scene);
  const MotionPass pass =
      for_each_step("derivatives", scene, trajectory, steps,
                    [&](int k, const SimulationOptions& options, const Input& known) {
                      return run.step(k, trajectory, options, known);
                    });
  run.finish();
  Report& report = arguments.report;
  report.begin("derivatives", arguments.scene.file);
  report["status"] = pass.status();
  if (pass.failed) {
    report_failure(scene.model, *pass.failed, report);
    return kFailed;
  }
  report["steps"] = pass.done;
  report["steps_by_differences"] = run.by_differences;
  if (arguments.forward) report["singular_steps"] = run.singular();
  report["time_median_us"] = median(run.times_us);
  report.print("{} steps of {} coordinates, {:.3g} us each; {} by differences\n", pass.done,
               scene.model.nv(), median(run.times_us), run.by_differences);
  if (arguments.check) report_check(run, trajectory, report);
  report.write();
  if (!pass.stopped) return kSuccess;
  return end_stopped(" after {} of {} steps{}", pass.done, trajectory.num_steps(),
                     arguments.output.empty() ? "" : "; up to there, " + arguments.output);
}

}  // namespace

void add_derivatives(CommandLine& line) {
  auto [command, arguments] = line.add<DerivativesArguments>(
      "derivatives", "How the forces behind each step of a motion change with it, exactly",
      "Example:\n  counterpoint derivatives data/scenes/humanoid_drop.yaml drop.csv --check "
      "--smoothing 1e-3 --compliance 1e-2 --json check.json",
      derivatives);
  arguments.scene.add_to(command);
  command.add("TRAJECTORY", arguments.trajectory,
              "Motion as `simulate --output` writes it; default: the scene's first step");
  command.add("--timestep", arguments.time_step,
              "Time step [s] of a trajectory that does not say it; default: the scene's");
  command.add("--output", arguments.output,
              "CSV to write: a row for each row of each matrix of each step");
  command.add("--forward", arguments.forward,
              "Those of the forward step too: of the state at the end by q, v and force");
  command.add("--check", arguments.check,
              "Hold them against extrapolated differences of the inverse step");
  command.add("--difference-step", arguments.difference_step,
              "Of configurations [m, rad], with --check; default: by the smoothing", positive);
  command.add("--smoothing", arguments.smoothing,
              "Smoothing length of contacts [m] instead of the scene's", not_negative);
  command.add("--compliance", arguments.compliance, "Compliance of contacts instead of the scene's",
              positive);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
