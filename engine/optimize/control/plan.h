// A plan while it is used: nothing in it changes while the next one is made.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

struct Plan {
  const Model* model = nullptr;
  double h = 0.0;               ///< time step [s]
  double time = 0.0;            ///< time of frame 0 [s]
  std::vector<VectorX> frames;  ///< configurations in the world, 0 ... N (nq each)
  std::vector<VectorX> force;   ///< applied force of each step (nv each) [N, N m]
  VectorX start_v;              ///< velocity of frame 0 (nv)

  int last() const { return static_cast<int>(frames.size()) - 1; }
  const VectorX& frame(int t) const { return frames[static_cast<std::size_t>(t)]; }

  /// Writes the velocity at a frame (nv), the difference to the frame before it.
  void write_velocity(int t, VectorX& out) const {
    if (t == 0) {
      out = start_v;
      return;
    }
    configuration_difference(*model, frame(t - 1), frame(t), out);
    out /= h;
  }

  /// Writes configuration, velocity and applied force at a time [s]; beyond the end, those of the
  /// last frame at rest. next_v: scratch (nv).
  void sample(double at, VectorX& q, VectorX& v, VectorX& applied, VectorX& next_v) const {
    const double s = std::max(0.0, (at - time) / h);
    const int k = static_cast<int>(std::min(std::floor(s), static_cast<double>(last())));
    applied = force[static_cast<std::size_t>(std::min(k, last() - 1))];
    q = frame(k);
    v.setZero(model->nv());
    if (k == last()) return;
    write_velocity(k, v);
    write_velocity(k + 1, next_v);
    integrate_configuration(*model, frame(k), next_v, (s - k) * h, q);
    v += (s - k) * (next_v - v);
  }
};

}  // namespace counterpoint::optimization
