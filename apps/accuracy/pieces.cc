#include "pieces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"

namespace counterpoint::apps::accuracy {
namespace {

constexpr long kRoom = 16;  // pieces allow time steps up to 16 times the scene's

int twos_in(long n) {
  int count = 0;
  while (n > 0 && n % 2 == 0) {
    n /= 2;
    ++count;
  }
  return count;
}

/// Largest number of steps up to `room` that is a multiple of 16, or of the largest power of two in
/// `room`.
long steps_of_piece(long room) {
  long unit = kRoom;
  while (unit > room) unit /= 2;
  return room / unit * unit;
}

long steps_wished(double wished, double h) {
  const double count = wished / h;
  const long steps = std::isfinite(count) && count < 1e9 ? std::lround(count) : 0;
  if (steps < 1 || std::abs(count - static_cast<double>(steps)) > 1e-6) {
    throw InputError(fmt::format(
        "--piece {:g} s: expected a multiple of the scene's time step, {:g} s", wished, h));
  }
  return steps;
}

}  // namespace

Plan plan_pieces(const SimulationOptions& options, int count, double length_wished) {
  const double h = options.time_step;
  const long spacing =
      static_cast<long>(std::floor(options.duration / h / std::max(count, 1) + 1e-6));
  if (count < 1 || spacing < 1) {
    throw InputError(fmt::format("a motion of {:g} s holds no {} pieces of one time step of {:g} s",
                                 options.duration, count, h));
  }
  Plan plan;
  plan.time_step = h;
  const long steps = length_wished > 0.0 ? steps_wished(length_wished, h) : steps_of_piece(spacing);
  if (steps > spacing) {
    throw InputError(fmt::format("--piece {:g} s: {} of them do not fit into {:g} s", length_wished,
                                 count, options.duration));
  }
  plan.length = static_cast<double>(steps) * h;
  plan.doublings = twos_in(steps);
  for (int k = 0; k < count; ++k) plan.starts.push_back(static_cast<double>(k * spacing) * h);
  return plan;
}

double exact_step(const Plan& plan, double near) {
  return plan.length / std::max(1.0, std::round(plan.length / near));
}

Deviation deviation(const Model& model, const VectorX& q_reference, const VectorX& q) {
  VectorX d(model.nv());
  configuration_difference(model, q_reference, q, d);
  double lengths = 0.0, angles = 0.0;
  int num_lengths = 0;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const int linear = joint_num_linear(body.joint_type);
    const int size = joint_nv(body.joint_type);
    lengths += d.segment(body.v_index, linear).squaredNorm();
    angles += d.segment(body.v_index + linear, size - linear).squaredNorm();
    num_lengths += linear;
  }
  const int num_angles = model.nv() - num_lengths;
  return {std::sqrt((lengths + angles) / std::max(model.nv(), 1)),
          num_lengths > 0 ? std::sqrt(lengths / num_lengths) : 0.0,
          num_angles > 0 ? std::sqrt(angles / num_angles) : 0.0};
}

}  // namespace counterpoint::apps::accuracy
