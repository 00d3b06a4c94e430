// counterpoint inverse: recovers the forces behind a trajectory.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <span>

#include "command.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/trajectory.h"
#include "input/inputs.h"
#include "input/motion.h"
#include "input/scene_arguments.h"
#include "report/contact_table.h"
#include "report/report.h"
#include "report/sensor_log.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

struct InverseArguments {
  SceneArguments scene;
  std::string trajectory, output, contacts, sensors;
  bool unknown_wrenches = false;
  std::optional<double> time_step;
  view::ViewOption view;
  Report report;
};

/// Largest values over all steps and coordinates [N or N m].
struct Extremes {
  double error = 0.0;       ///< |recovered - recorded|
  double recorded = 0.0;    ///< |recorded applied force|
  double scale = 0.0;       ///< Inverse::force_scale
  double unactuated = 0.0;  ///< |recovered| on coordinates without actuator
  /// |(q_next (-) q) / h - v_next| [m/s, rad/s]: zero for semi_implicit_euler, except for the
  /// translation of free trees.
  double mismatch = 0.0;
  long contacts = 0;
};

/// Computes Extremes::mismatch of one step.
double velocity_mismatch(const Model& model, const Trajectory& trajectory, int step,
                         double time_step, std::span<const int> free_trees) {
  VectorX velocity(model.nv());
  configuration_difference(model, trajectory.q.col(step), trajectory.q.col(step + 1), velocity);
  velocity = velocity / time_step - trajectory.v.col(step + 1);
  for (const int t : free_trees)
    velocity.segment<3>(model.trees()[static_cast<std::size_t>(t)].v_begin).setZero();
  return velocity.lpNorm<Eigen::Infinity>();
}

void add_extremes(const Model& model, const Trajectory& trajectory, int step,
                  const Inverse& inverse, Extremes& extremes) {
  extremes.scale = std::max(extremes.scale, inverse.force_scale);
  extremes.contacts += static_cast<long>(inverse.contacts.size());
  if (trajectory.applied_force.size() > 0) {
    const auto recorded = trajectory.applied_force.col(step);
    VectorX difference = inverse.applied_force - recorded;
    for (int i = 1; i < model.num_bodies(); ++i)  // nothing records what held a prescribed joint
      if (model.joint(i - 1).prescribed)
        difference.segment(model.body(i).v_index, joint_nv(model.body(i).joint_type)).setZero();
    const double error = difference.lpNorm<Eigen::Infinity>();
    // Written so that NaN is kept: every comparison with NaN is false.
    if (!(error <= extremes.error)) extremes.error = error;
    extremes.recorded = std::max(extremes.recorded, recorded.lpNorm<Eigen::Infinity>());
  }
  for (int i = 1; i < model.num_bodies(); ++i) {
    if (model.joint(i - 1).actuated) continue;
    const Body& body = model.body(i);
    const auto force = inverse.applied_force.segment(body.v_index, joint_nv(body.joint_type));
    extremes.unactuated = std::max(extremes.unactuated, force.lpNorm<Eigen::Infinity>());
  }
}

/// The tables of the inverse, each only if requested.
class Output {
 public:
  Output(const InverseArguments& arguments, const Scene& scene) {
    const Model& model = scene.model;
    if (!arguments.output.empty()) {
      std::vector<Column> columns{"time", "time_step"};
      const CoordinateNames names = coordinate_names(model);
      columns.insert(columns.end(), names.force.begin(), names.force.end());
      for (const Actuator& actuator : model.actuators())
        columns.emplace_back(actuator.name + kActuatorForceSuffix);
      forces_ = std::make_unique<TableWriter>(arguments.output, columns);
    }
    if (!arguments.contacts.empty())
      contacts_ = std::make_unique<ContactTable>(arguments.contacts, model);
    if (!arguments.sensors.empty())
      sensors_ = std::make_unique<SensorLog>(arguments.sensors, model, scene.options, 0);
  }

  void write(double time, double time_step, const Inverse& inverse) {
    if (contacts_) contacts_->add_step(time, inverse);
    if (!forces_) return;
    forces_->number(time);
    forces_->number(time_step);
    for (const double force : inverse.applied_force) forces_->number(force);
    for (const double force : inverse.actuator_force) forces_->number(force);
    forces_->end_row();
  }

  void write_sensors(const Trajectory& trajectory, int k, double h, const Input& known) {
    if (!sensors_) return;
    sensors_->add_step(trajectory.time[static_cast<std::size_t>(k)],
                       {trajectory.q.col(k), trajectory.v.col(k), trajectory.q.col(k + 1),
                        trajectory.v.col(k + 1), known, h});
  }

  void finish() {
    if (forces_) forces_->finish();
    if (sensors_) sensors_->finish();
    if (contacts_) contacts_->finish();
  }

 private:
  std::unique_ptr<TableWriter> forces_;
  std::unique_ptr<ContactTable> contacts_;
  std::unique_ptr<SensorLog> sensors_;
};

/// Lists the files that a stopped run leaves.
std::string kept(const InverseArguments& arguments) {
  std::vector<std::string> files;
  for (const std::string& file : {arguments.output, arguments.contacts, arguments.sensors})
    if (!file.empty()) files.push_back(file);
  return (files.empty() ? "" : fmt::format("; up to there, {}", fmt::join(files, " and "))) +
         std::string(arguments.view.wanted() ? "; no replay was written" : "");
}

/// Recovers forces step by step and writes them, until a step fails or Ctrl-C.
MotionPass recover(const InverseArguments& arguments, const Scene& scene,
                   const Trajectory& trajectory, const std::vector<double>& lengths,
                   Extremes& extremes) {
  const Model& model = scene.model;
  Output output(arguments, scene);
  Workspace workspace(model);
  Inverse result;
  const auto step = [&](int k, const SimulationOptions& options, const Input& known) {
    step_inverse(model, options, trajectory.q.col(k), trajectory.v.col(k), trajectory.q.col(k + 1),
                 trajectory.v.col(k + 1), known, workspace, result);
    if (result.fault.any()) return result.fault;
    add_extremes(model, trajectory, k, result, extremes);
    extremes.mismatch = std::max(
        extremes.mismatch,
        velocity_mismatch(model, trajectory, k, options.time_step, workspace.free_trees()));
    output.write(trajectory.time[k], options.time_step, result);
    output.write_sensors(trajectory, k, options.time_step, known);
    return Fault();
  };
  const MotionPass pass = for_each_step("recovering forces", scene, trajectory, lengths, step);
  output.finish();
  return pass;
}

/// Returns a reason why the forces found may not be those that acted; empty if there is none. Rows
/// written by simulate are exact to the bit. Other rows are suspect if a coordinate without
/// actuator needs a force, or if velocities do not lead from row to row.
std::string doubt(const Scene& scene, const Trajectory& trajectory, const Extremes& extremes) {
  constexpr double kForce = 1e-6;      // relative to the largest force; our own motions leave 1e-8
  constexpr double kVelocity = 1e-10;  // [m/s, rad/s]; our own motions leave 1e-13 m over a step
  if (trajectory.is_as_written()) return {};
  std::string why;
  if (trajectory.altered_rows > 0)
    why =
        fmt::format("{} of {} rows are not as simulate wrote them (state_hash): edited or rounded",
                    trajectory.altered_rows, trajectory.num_rows());
  else if (extremes.unactuated > kForce * extremes.scale)
    why = fmt::format("a force of {:.3g} N or N m is found where nothing is actuated",
                      extremes.unactuated);
  else if (scene.options.integrator == Integrator::kSemiImplicitEuler &&
           extremes.mismatch > kVelocity)
    why = fmt::format("velocities are up to {:.3g} m/s or rad/s off what leads from row to row",
                      extremes.mismatch);
  if (why.empty()) return {};
  return why +
         ". Of rounded, thinned or measured rows this command takes what contacts carry for "
         "applied forces, since "
         "contacts are too stiff for such velocities: use compare --mode inverse "
         "(docs/guide/recordings.md)";
}

void report_forces(const Scene& scene, const Trajectory& trajectory, int steps,
                   const Extremes& extremes, Report& report) {
  report["steps"] = steps;
  report["altered_rows"] = trajectory.altered_rows;
  const std::string doubted = doubt(scene, trajectory, extremes);
  report["doubt"] = doubted;
  if (!doubted.empty()) fmt::print(stderr, "note: {}: {}\n", trajectory.file, doubted);
  report["contacts_mean"] = static_cast<double>(extremes.contacts) / std::max(steps, 1);
  report["force_scale_max"] = extremes.scale;
  report["unactuated_force_max"] = extremes.unactuated;
  report["velocity_mismatch_max"] = extremes.mismatch;
  report.print_entries(
      "{steps} steps; largest force at work {force_scale_max:.6g}, largest unactuated force "
      "{unactuated_force_max:.3g} [N, N m]\n");
  if (trajectory.applied_force.size() == 0) return;
  const auto relative = [](double error, double scale) {
    return scale > 0.0 ? error / scale : error;
  };
  report["applied_force_max"] = extremes.recorded;
  report["applied_force_error_max"] = extremes.error;
  report["applied_force_relative_error_max"] = relative(extremes.error, extremes.scale);
  report["applied_force_relative_to_applied_max"] = relative(extremes.error, extremes.recorded);
  report.print_entries(
      "applied forces recovered to {applied_force_relative_error_max:.3g} of the largest force at "
      "work, {applied_force_relative_to_applied_max:.3g} of the largest applied\n");
}

/// Takes the wrenches out of a motion, so that the inverse does not know them, and adds J' F at the
/// start of each step to its applied forces, if it has any: there the inverse finds them again.
void make_wrenches_unknown(const Model& model, Trajectory& trajectory) {
  Dynamics dynamics(model);
  MatrixX jacobian;
  Input known;
  for (int k = 0; trajectory.applied_force.size() > 0 && k < trajectory.num_steps(); ++k) {
    trajectory.set_known(model, k, known);
    if (known.wrenches.empty()) continue;
    dynamics.set_configuration(trajectory.q.col(k));
    for (const ExternalWrench& pull : known.wrenches) {
      dynamics.frame_jacobian(pull.frame, jacobian);
      trajectory.applied_force.col(k) += jacobian.topRows<3>().transpose() * pull.wrench.torque +
                                         jacobian.bottomRows<3>().transpose() * pull.wrench.force;
    }
  }
  InputColumns before;  // columns before those of the wrenches
  before.targets = trajectory.columns.targets;
  const auto first = static_cast<Eigen::Index>(before.names(model).size());
  const auto count = static_cast<Eigen::Index>(6 * trajectory.columns.links.size());
  trajectory.known.middleRows(first, count).setZero();
}

int inverse(InverseArguments& arguments) {
  arguments.view.check();
  const Scene scene = arguments.scene.load();
  Trajectory trajectory = read_motion(arguments.trajectory, scene.model);
  const std::vector<double> steps =
      step_lengths(trajectory, arguments.time_step, scene.options.time_step);
  find_internal_states(scene.model, scene.options, steps, trajectory);
  if (arguments.unknown_wrenches) make_wrenches_unknown(scene.model, trajectory);
  Extremes extremes;
  const MotionPass pass = recover(arguments, scene, trajectory, steps, extremes);
  if (arguments.view.wanted() && !pass.failed && !pass.stopped)
    view::write_replay(
        arguments.view.file(), scene,
        {arguments.scene.file, {arguments.trajectory}, arguments.scene.package_folders()},
        view::clip_of(scene, trajectory, steps, arguments.view.rate(), true));

  Report& report = arguments.report;
  report.begin("inverse", arguments.scene.file);
  report["status"] = pass.status();
  if (pass.failed) {
    report_failure(scene.model, *pass.failed, report);
    return kFailed;
  }
  report_forces(scene, trajectory, pass.done, extremes, report);
  report.write();
  if (!pass.stopped) return kSuccess;
  return end_stopped(" after {} of {} steps{}", pass.done, trajectory.num_steps(), kept(arguments));
}

}  // namespace

void add_inverse(CommandLine& line) {
  auto [command, arguments] = line.add<InverseArguments>(
      "inverse", "Recover the applied and contact forces behind a trajectory",
      "Example:\n  counterpoint inverse data/scenes/arm7.yaml arm.csv --output forces.csv "
      "--contacts contacts.csv",
      inverse);
  arguments.scene.add_to(command);
  command.add("TRAJECTORY", arguments.trajectory, "Motion as `simulate --output` writes it",
              required);
  command.add("--timestep", arguments.time_step,
              "Time step [s] of a trajectory that does not say it; default: the scene's");
  command.add("--unknown-wrenches", arguments.unknown_wrenches,
              "Find the motion's wrenches on links too, as applied forces of the coordinates that "
              "they move");
  command.add("--output", arguments.output, "Table to write: the applied force of every step");
  command.add("--contacts", arguments.contacts,
              "Table to write: every contact of every step and its force");
  command.add("--sensors FILE", arguments.sensors,
              "Table to write: the readings of the scene's sensors in every step, as `simulate "
              "--sensors` does with seed 0");
  arguments.view.add_to(command);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
