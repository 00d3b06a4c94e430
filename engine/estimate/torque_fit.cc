#include "counterpoint/engine/estimate/torque_fit.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "counterpoint/engine/estimate/fit/fit_spread.h"
#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"
#include "counterpoint/engine/estimate/torques/torque_passes.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::estimation {
namespace {

using K = ParameterKind;

void check_parameters(const std::vector<Parameter>& parameters, const std::vector<int>& forces) {
  for (const Parameter& p : parameters) {
    const bool channel = is_channel(p.kind);
    if (!is_linear(p.kind) && !channel)
      throw InputError(fmt::format(
          "parameter '{}': joint forces without contact do not tell it; expected mass, com_x, "
          "com_y, com_z, inertia, shear_*, spread_*, inertial, damping, dry_friction, "
          "breakaway_friction, stribeck_speed, armature, gravity, force_offset, force_gain or "
          "force_delay, or another objective",
          p.name));
    const bool recorded = std::all_of(p.targets.begin(), p.targets.end(), [&](int target) {
      return std::find(forces.begin(), forces.end(), target) != forces.end();
    });
    if (channel && !recorded)
      throw InputError(
          fmt::format("parameter '{}': the force of this joint is not recorded", p.name));
  }
}

double longest_delay(const std::vector<Parameter>& parameters) {
  double out = 0.0;
  for (const Parameter& p : parameters)
    if (p.kind == K::kForceDelay) out = std::max({out, std::abs(p.lower), std::abs(p.upper)});
  return out;
}

void fill(const Coordinates& coordinates, const LinearQuantities& quantities,
          const TorqueSearch& search, std::size_t recordings, TorqueFit& out) {
  const VectorX& x = search.x();
  const Eigen::Index n = x.size();
  MatrixX& by_recording = out.parameters.information_by_recording;
  by_recording = MatrixX::Zero(n, static_cast<Eigen::Index>(recordings));
  const MatrixX information = search.information(&by_recording);
  out.parameters.information = coordinates.information_of_values(information);
  const VectorX prior = coordinates.prior_weights;
  const MatrixX H = information + MatrixX(prior.asDiagonal());
  const VectorX scale = H.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixX by_coordinates =
      scale.asDiagonal() *
      (scale.asDiagonal() * H * scale.asDiagonal()).ldlt().solve(MatrixX::Identity(n, n)) *
      scale.asDiagonal();
  const MatrixX covariance = coordinates.covariance_of_values(by_coordinates);
  double rows = 0.0;
  for (const TorqueChannel& channel : search.channels()) rows += channel.rows / channel.correlation;
  const double quantile = fitting::student_95(std::max(1.0, rows - static_cast<double>(n)));
  const VectorX values = coordinates.values(x);
  std::vector<fitting::EndPoint> ends;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Parameter& p = coordinates.parameters[static_cast<std::size_t>(i)];
    ends.push_back({values[i], p.logarithmic ? x[i] : values[i], p.lower, p.upper, p.logarithmic,
                    fitting::is_told(covariance(i, i), prior[i], coordinates.range(i))});
  }
  fitting::set_parameters(ends, covariance, quantile, out.parameters);
  const Eigen::Index inertial = quantities.num_inertial();
  const MatrixX D = quantities.derivatives(coordinates, x).topRows(inertial);
  out.bodies = quantities.bodies();
  out.inertial = quantities.at(values).head(inertial);
  out.inertial_covariance = D * by_coordinates * D.transpose();
  out.channels = search.channels();
  out.parameters.cost = search.cost();
}

}  // namespace

TorqueFit fit_torques(const Scene& scene, const ColumnMap& map,
                      const std::vector<const Recording*>& recordings,
                      const std::vector<Parameter>& parameters, const TorqueFitOptions& options) {
  const TorqueTask task{map, recordings, options, longest_delay(parameters)};
  check_torques(scene, task);
  const std::vector<int> forces = recorded_forces(map);
  check_parameters(parameters, forces);
  const Coordinates coordinates(parameters, parameter_values(parameters, scene),
                                scene.model.dry_friction());
  const LinearQuantities quantities(scene, parameters);
  TorqueFit out;
  TorquePasses passes(scene, task, coordinates, quantities);
  passes.scan_speeds();
  passes.run(out.parameters.start_cost);
  out.parameters.linearizations = passes.count();
  out.parameters.stopped = options.stop && options.stop();
  fill(coordinates, quantities, passes.search(), recordings.size(), out);
  return out;
}

TorqueScore score_torques(const Scene& scene, const ColumnMap& map,
                          const std::vector<const Recording*>& recordings,
                          const std::vector<Parameter>& parameters, const VectorX& values,
                          const TorqueFitOptions& options, const VectorX& held) {
  const TorqueTask task{map, recordings, options, longest_delay(parameters)};
  check_torques(scene, task);
  const std::vector<int> forces = recorded_forces(map);
  const std::vector<StepParameter> friction = friction_of(forces);
  const std::vector<ChannelValues> channels = channel_values(forces, parameters, values);
  const std::vector<ChannelRows> rows = torque_rows(scene, task, friction, channels);
  const CoordinateNames names = coordinate_names(scene.model);
  TorqueScore out;
  out.held = VectorX::Zero(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t c = 0; c < rows.size(); ++c) {
    const ChannelRows& channel = rows[c];
    if (channel.recorded.size() == 0)
      throw InputError(
          fmt::format("the recordings are too short for a cutoff of {:g} Hz", options.cutoff));
    const auto at = static_cast<Eigen::Index>(c);
    const double gain = channels[c].gain;
    const double most_in_scene = gain * scene.model.friction_at_rest(channel.coordinate);
    VectorX left = gain * channel.modelled - channel.recorded +
                   VectorX::Constant(channel.recorded.size(), channels[c].offset);
    const VectorX rubbed = gain * modelled_friction(scene.model, channel, 2 * at);
    std::vector<Eigen::Index> rest;
    for (Eigen::Index i = 0; i < left.size() && most_in_scene > 0.0; ++i) {
      if (!channel.rests[static_cast<std::size_t>(i)]) continue;
      rest.push_back(i);
      left[i] -= rubbed[i];
      out.held[at] = std::max(out.held[at], std::abs(left[i]));
    }
    const bool known = scene.model.breaks_away(channel.coordinate);
    const double most =
        known ? most_in_scene : std::max(most_in_scene, held.size() > 0 ? held[at] : out.held[at]);
    for (const Eigen::Index i : rest) left[i] -= std::clamp(left[i], -most, most);
    out.coordinates.push_back(coordinate_metrics(
        names.force[static_cast<std::size_t>(channel.coordinate)], left, channel.recorded));
    out.recorded.push_back(channel.recorded);
    out.predicted.push_back(channel.recorded + left);
  }
  return out;
}

}  // namespace counterpoint::estimation
