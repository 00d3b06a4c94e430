#include "recordings/motion_metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::apps {
namespace {

/// Half width of the 95 % interval of a normal distribution [standard deviations].
constexpr double kInterval95 = 1.959964;
/// Share of the carried weight above which a single shape of the world is named as the support.
constexpr double kAlone = 0.99;

/// Weight of all moving bodies [N]; uses standard gravity if the scene has none.
double moving_weight(const Model& model) {
  const double g = model.gravity().norm();
  double mass = 0.0;
  for (const Body& body : model.bodies()) mass += body.inertia.mass;
  return mass * (g > 0.0 ? g : kStandardGravity);
}

/// Accumulates the differences between an estimated and a recorded force.
class Agreement {
 public:
  Agreement(std::string name, std::string unit) {
    out_.name = std::move(name);
    out_.unit = std::move(unit);
  }

  void add(double estimated, double deviation, double recorded) {
    const double difference = estimated - recorded;
    if (!std::isfinite(difference)) return;
    ++out_.rows;
    squares_ += difference * difference;
    inside_ += std::abs(difference) <= kInterval95 * deviation ? 1 : 0;
  }

  ForceAgreement finish() {
    if (out_.rows > 0) {
      out_.rms = std::sqrt(squares_ / out_.rows);
      out_.inside_95 = static_cast<double>(inside_) / out_.rows;
    }
    return out_;
  }

 private:
  ForceAgreement out_;
  double squares_ = 0.0;
  int inside_ = 0;
};

/// Mean of a recorded force about the time t, weighted by a triangle that reaches h [s] to either
/// side. Estimated forces of a row are such means. Recorded values are interpolated linearly.
double mean_about(const Recording& recording, Eigen::Index row, double t, double h) {
  const auto at = [&](double time) {
    return recorded_at(recording, recording.contact_force, row, time);
  };
  return (at(t - h) + 4.0 * at(t) + at(t + h)) / 6.0;
}

/// Agreement of the recorded contact forces by component. They are the first entries of the sums.
std::vector<ForceAgreement> contact_agreements(const ColumnMap& map, const Recording& recording,
                                               const MotionEstimate& estimate) {
  std::vector<ForceAgreement> out;
  const double h = estimate.time[1] - estimate.time[0];
  for (std::size_t k = 0; k < map.contact_forces.size() && k < estimate.sums.size(); ++k) {
    const ColumnMap::ContactForce& force = map.contact_forces[k];
    for (std::size_t axis = 0; axis < force.components.size(); ++axis) {
      if (force.components[axis].column.empty()) continue;
      Agreement agreement(force.name + ".contact.f" + "xyz"[axis], "N");
      const auto at = static_cast<Eigen::Index>(3 * k + axis);
      for (std::size_t row = 0; row < estimate.time.size(); ++row) {
        const auto column = static_cast<Eigen::Index>(row);
        agreement.add(estimate.sum_force(at, column), estimate.sum_deviation(at, column),
                      mean_about(recording, at, estimate.time[row], h));
      }
      out.push_back(agreement.finish());
    }
  }
  return out;
}

/// Agreement of the recorded applied forces that the estimate does not use.
std::vector<ForceAgreement> applied_agreements(const Model& model, const ColumnMap& map,
                                               const Recording& recording,
                                               const MotionEstimate& estimate) {
  const CoordinateNames names = coordinate_names(model);
  const std::vector<std::string> units = force_units(model);
  std::vector<ForceAgreement> out;
  for (const ColumnMap::Entry& entry : map.entries) {
    const bool used =
        entry.index < map.force_deviation.size() && std::isfinite(map.force_deviation[entry.index]);
    if (entry.kind != ColumnMap::Entry::Kind::kForce || entry.source.column.empty() || used)
      continue;
    const auto i = static_cast<std::size_t>(entry.index);
    Agreement agreement(names.force[i], units[i]);
    for (std::size_t row = 0; row < estimate.time.size(); ++row) {
      const auto column = static_cast<Eigen::Index>(row);
      agreement.add(
          estimate.force(entry.index, column), estimate.force_deviation(entry.index, column),
          recorded_at(recording, recording.applied_force, entry.index, estimate.time[row]));
    }
    out.push_back(agreement.finish());
  }
  return out;
}

/// Name of the carrier that a body belongs to: the recorded contact force it is part of, else its
/// link.
std::string carrier_name(const Model& model, const ColumnMap& map, int body) {
  for (const ColumnMap::ContactForce& force : map.contact_forces)
    if (std::find(force.bodies.begin(), force.bodies.end(), body) != force.bodies.end())
      return force.name;
  return model.joint(body - 1).link;
}

/// Computes the carriers: contact forces of the world's shapes along -gravity, averaged over the
/// rows.
void set_carriers(const Model& model, const ColumnMap& map, const MotionEstimate& estimate,
                  ExplainedMetrics& out) {
  const Vector3 up = model.gravity().norm() > 0.0 ? Vector3(-model.gravity().normalized())
                                                  : Vector3(Vector3::UnitZ());
  std::map<std::string, double> by_carrier, by_shape;
  int rows = 0;
  for (std::size_t row = 0; row < estimate.contacts.size(); ++row) {
    if (!estimate.force.col(static_cast<Eigen::Index>(row)).allFinite()) continue;
    ++rows;
    for (const ContactEstimate& pair : estimate.contacts[row]) {
      const Geometry& a = model.geometries()[static_cast<std::size_t>(pair.geometry_a)];
      const Geometry& b = model.geometries()[static_cast<std::size_t>(pair.geometry_b)];
      if ((a.body == 0) == (b.body == 0)) continue;
      const double carried = (a.body == 0 ? 1.0 : -1.0) * pair.force.dot(up) / out.weight;
      by_carrier[carrier_name(model, map, a.body == 0 ? b.body : a.body)] += carried;
      by_shape[a.body == 0 ? a.name : b.name] += carried;
    }
  }
  for (const auto& [name, sum] : by_carrier) {
    out.carriers.push_back({name, sum / rows});
    out.carried += sum / rows;
  }
  std::stable_sort(
      out.carriers.begin(), out.carriers.end(),
      [](const Carrier& a, const Carrier& b) { return std::abs(a.share) > std::abs(b.share); });
  out.support = "world";
  for (const auto& [name, sum] : by_shape)
    if (sum / rows > kAlone * out.carried) out.support = name;
}

void set_unexplained(const Model& model, const MotionEstimate& estimate, ExplainedMetrics& out) {
  const CoordinateNames names = coordinate_names(model);
  const VectorX weights = optimization::unactuated_weights(model, optimization::motors_of(model));
  out.has_unactuated = !weights.isZero(0.0);
  out.unexplained =
      VectorX::Constant(estimate.force.cols(), std::numeric_limits<double>::quiet_NaN());
  for (Eigen::Index row = 0; row < estimate.force.cols(); ++row) {
    if (!estimate.force.col(row).allFinite()) continue;
    Eigen::Index coordinate = 0;
    const double value =
        estimate.force.col(row).cwiseProduct(weights).cwiseAbs().maxCoeff(&coordinate);
    out.unexplained[row] = value;
    if (value <= out.worst_unexplained.value) continue;
    out.worst_unexplained = {value, estimate.time[static_cast<std::size_t>(row)],
                             names.force[static_cast<std::size_t>(coordinate)]};
  }
}

/// Finds the row with the largest cost ratio, and the coordinate with the largest residual in it,
/// in standard deviations; or the sensor, if its rms residual is larger.
void set_worst_cost(const Model& model, const MotionEstimate& estimate, ExplainedMetrics& out) {
  if (estimate.cost_ratio.size() == 0) return;
  Eigen::Index row = 0;
  out.worst_cost.value = estimate.cost_ratio.maxCoeff(&row);
  out.worst_cost.time = estimate.time[static_cast<std::size_t>(row)];
  VectorX difference(model.nv());
  configuration_difference(model, estimate.q.col(row), estimate.recorded.col(row), difference);
  double most = 0.0;
  const std::vector<std::string> names = position_names(model);
  for (int i = 0; i < model.nv() && i < estimate.position_deviation.size(); ++i) {
    const double deviation = estimate.position_deviation[i];
    if (!(deviation > 0.0) || std::abs(difference[i]) / deviation <= most) continue;
    most = std::abs(difference[i]) / deviation;
    out.worst_cost.coordinate = names[static_cast<std::size_t>(i)];
  }
  for (const SensorMetrics& one : estimate.sensors) {
    if (one.rms / one.deviation <= most) continue;
    most = one.rms / one.deviation;
    out.worst_cost.coordinate = one.name;
  }
}

}  // namespace

ExplainedMetrics explained_metrics(const Scene& scene, const ColumnMap& map,
                                   const Recording& recording, const MotionEstimate& estimate) {
  ExplainedMetrics out;
  out.weight = moving_weight(scene.model);
  out.contact_forces = contact_agreements(map, recording, estimate);
  out.applied_forces = applied_agreements(scene.model, map, recording, estimate);
  set_carriers(scene.model, map, estimate, out);
  set_unexplained(scene.model, estimate, out);
  set_worst_cost(scene.model, estimate, out);
  return out;
}

double recorded_at(const Recording& recording, const MatrixX& values, Eigen::Index row, double t) {
  const std::vector<double>& time = recording.time;
  const auto after = std::lower_bound(time.begin(), time.end(), t);
  if (after == time.end()) return values(row, values.cols() - 1);
  const auto k = after - time.begin();
  if (k == 0 || *after == t) return values(row, k);
  const double share = (t - *(after - 1)) / (*after - *(after - 1));
  return (1.0 - share) * values(row, k - 1) + share * values(row, k);
}

std::vector<std::string> position_names(const Model& model) {
  const CoordinateNames names = coordinate_names(model);
  std::vector<std::string> out = names.v;
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    const int positions = joint_nq(body.joint_type), velocities = joint_nv(body.joint_type);
    const int same = positions == velocities ? velocities : joint_num_linear(body.joint_type);
    for (int k = 0; k < same; ++k)
      out[static_cast<std::size_t>(body.v_index + k)] =
          names.q[static_cast<std::size_t>(body.q_index + k)];
  }
  return out;
}

std::vector<std::string> force_units(const Model& model) {
  std::vector<std::string> out;
  for (int b = 1; b < model.num_bodies(); ++b) {
    const JointType type = model.body(b).joint_type;
    for (int k = 0; k < joint_nv(type); ++k)
      out.emplace_back(k < joint_num_linear(type) ? "N" : "N m");
  }
  return out;
}

std::vector<std::string> sum_names(const ColumnMap& map, const std::vector<ContactSum>& sums) {
  std::set<std::string> taken;
  std::vector<std::string> out;
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const bool link = k >= map.contact_forces.size();
    const bool again = link && taken.count(sums[k].name) > 0;
    out.push_back(again ? sums[k].name + ".link" : sums[k].name);
    taken.insert(out.back());
  }
  return out;
}

}  // namespace counterpoint::apps
