#include "counterpoint/contact/inverse.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {
namespace {

// Computes y = J w + b of one constraint.
void constraint_velocity(const Problem& problem, int constraint, const Eigen::Ref<const VectorX>& w,
                         double* y) {
  const Law& law = problem.law(constraint);
  std::fill(y, y + law.rows, 0.0);
  for (int side = 0; side < 2; ++side) {
    const int block = problem.block(constraint, side);
    if (block < 0) continue;
    const ConstMatrixMap jacobian = problem.jacobian(constraint, side);
    const double* velocity = w.data() + problem.block_start(block);
    for (int j = 0; j < jacobian.cols(); ++j) {
      for (int r = 0; r < law.rows; ++r) y[r] += jacobian(r, j) * velocity[j];
    }
  }
  for (int r = 0; r < law.rows; ++r) y[r] += law.bias[r];
}

void check_cone(const Law& law, const double* y, const double* f, Residuals& out) {
  double phi = 0.0, z = 0.0, power = f[0] * y[0];
  for (int i = 1; i < law.rows; ++i) {
    const double mu = law.friction[i - 1];
    const double upright = f[i] + (i < 3 ? law.lean[static_cast<size_t>(i - 1)] * f[0] : 0.0);
    phi += upright == 0.0 ? 0.0 : (upright / mu) * (upright / mu);
    z += (mu * y[i]) * (mu * y[i]);
    power += upright * y[i];
  }
  phi = std::sqrt(phi);
  z = std::sqrt(z);
  // The shift is exact, not smoothed: residuals refer to the hard laws.
  const double normal = law.coulomb ? y[0] + z : y[0];
  if (law.coulomb) power += f[0] * z;
  out.primal = std::max(out.primal, phi - f[0]);
  out.dual = std::max(out.dual, z - normal);
  out.complementarity = std::max(out.complementarity, std::abs(power));
}

void check_law(const Law& law, const double* y, const double* f, Residuals& out) {
  switch (law.type) {
    case LawType::kUnilateral:
      out.primal = std::max(out.primal, -f[0]);
      out.dual = std::max(out.dual, -y[0]);
      out.complementarity = std::max(out.complementarity, std::abs(f[0] * y[0]));
      return;
    case LawType::kFrictionCone:
      check_cone(law, y, f, out);
      return;
    case LawType::kEquality:
      for (int i = 0; i < law.rows; ++i) out.dual = std::max(out.dual, std::abs(y[i]));
      return;
    case LawType::kSpring:
      for (int i = 0; i < law.rows; ++i)
        out.dual = std::max(out.dual, std::abs(y[i] + law.regularizer * f[i]));
      return;
    case LawType::kDryFriction:
      out.primal = std::max(out.primal, std::abs(f[0] - law.center) - law.bound);
      out.complementarity = std::max(
          out.complementarity, std::abs(law.bound * std::abs(y[0]) + (f[0] - law.center) * y[0]));
      return;
  }
}

}  // namespace

void compute_impulse(const Problem& problem, const Eigen::Ref<const VectorX>& w, VectorX& impulse) {
  impulse.resize(problem.num_rows());
  for (int c = 0; c < problem.num_constraints(); ++c) {
    double y[kMaxRows];
    constraint_velocity(problem, c, w, y);
    contact::impulse(problem.law(c), y, impulse.data() + problem.first_row(c));
  }
}

void compute_constraint_velocity(const Problem& problem, const Eigen::Ref<const VectorX>& w,
                                 VectorX& y) {
  y.resize(problem.num_rows());
  for (int c = 0; c < problem.num_constraints(); ++c) {
    constraint_velocity(problem, c, w, y.data() + problem.first_row(c));
  }
}

void compute_generalized_impulse(const Problem& problem, const Eigen::Ref<const VectorX>& impulse,
                                 VectorX& out) {
  out.setZero(problem.num_velocities());
  for (int c = 0; c < problem.num_constraints(); ++c) {
    const double* f = impulse.data() + problem.first_row(c);
    for (int side = 0; side < 2; ++side) {
      const int block = problem.block(c, side);
      if (block < 0) continue;
      const ConstMatrixMap jacobian = problem.jacobian(c, side);
      for (int j = 0; j < jacobian.cols(); ++j) {
        double sum = 0.0;
        for (int r = 0; r < jacobian.rows(); ++r) sum += jacobian(r, j) * f[r];
        out[problem.block_start(block) + j] += sum;
      }
    }
  }
}

Residuals compute_residuals(const Problem& problem, const Eigen::Ref<const VectorX>& w,
                            const VectorX& impulse) {
  Residuals out;
  for (int c = 0; c < problem.num_constraints(); ++c) {
    const Law& law = problem.law(c);
    const double* f = impulse.data() + problem.first_row(c);
    double y[kMaxRows], free[kMaxRows];
    constraint_velocity(problem, c, w, y);
    constraint_velocity(problem, c, problem.free_velocity(), free);
    for (int r = 0; r < law.rows; ++r) {
      out.force_scale = std::max(out.force_scale, std::abs(f[r]));
      out.velocity_scale = std::max({out.velocity_scale, std::abs(y[r]), std::abs(free[r])});
    }
    check_law(law, y, f, out);
  }
  VectorX pushed;
  compute_generalized_impulse(problem, impulse, pushed);
  double square = 0.0, scale_square = 0.0;
  for (int b = 0; b < problem.num_blocks(); ++b) {
    const ConstMatrixMap mass = problem.mass(b);
    const int start = problem.block_start(b), n = problem.block_size(b);
    for (int i = 0; i < n; ++i) {
      double momentum = 0.0;
      for (int j = 0; j < n; ++j) {
        momentum += mass(i, j) * (w[start + j] - problem.free_velocity()[start + j]);
      }
      const double gap = momentum - pushed[start + i];
      square += gap * gap / mass(i, i);
      scale_square += momentum * momentum / mass(i, i);
    }
  }
  for (int c = 0; c < problem.num_constraints(); ++c) {
    for (int side = 0; side < 2; ++side) {
      const int block = problem.block(c, side);
      if (block < 0) continue;
      const VectorX push = problem.jacobian(c, side).transpose() *
                           impulse.segment(problem.first_row(c), problem.law(c).rows);
      scale_square += push.cwiseAbs2().dot(problem.mass(block).diagonal().cwiseInverse());
    }
  }
  out.motion = std::sqrt(square);
  out.momentum_scale = std::sqrt(scale_square);
  return out;
}

}  // namespace counterpoint::contact
