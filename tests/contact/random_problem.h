// Random contact problems, from a seed.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact::testing {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low, double high) {
    // std::uniform_real_distribution gives different numbers in different standard libraries.
    return low + (high - low) * static_cast<double>(engine_()) / 4294967295.0;
  }
  double signed_unit() { return uniform(-1.0, 1.0); }
  /// Long double rounds to the same double with every library of elementary functions: a seed gives
  /// the same problems everywhere.
  double log_uniform(double low, double high) {
    const long double from = low, to = high;
    return static_cast<double>(std::exp(static_cast<long double>(
        uniform(static_cast<double>(std::log(from)), static_cast<double>(std::log(to))))));
  }
  int integer(int low, int high) {
    return low + static_cast<int>(engine_() % static_cast<unsigned>(high - low + 1));
  }
  bool coin() { return (engine_() & 1u) != 0; }

 private:
  std::mt19937 engine_;
};

struct RandomOptions {
  int max_blocks = 4;
  int max_block_size = 8;
  int max_constraints = 8;
  double mass_ratio = 1e2;  ///< largest over smallest mass of the blocks
  double compliance_low = 1e-6, compliance_high = 1e-2;
  double max_friction = 2.0;
  double velocity = 1.0;                               ///< size of w* and bias [m/s]
  double smoothing_low = 1e-8, smoothing_high = 1e-2;  ///< k relative to m v^2
  bool hard = false;                                   ///< k = 0
  bool coulomb = false;                                ///< friction cones follow the Coulomb law
  bool only_cones = false;
  std::optional<LawType> only_type;  ///< if given, every constraint has this type,
  int only_rows = 0;                 ///< this number of rows if not 0,
  std::optional<bool> isotropic;     ///< and equal friction coefficients or not
};

inline Law random_law(Random& random, const RandomOptions& options, LawType type) {
  Law law;
  law.type = type;
  switch (type) {
    case LawType::kUnilateral:
    case LawType::kDryFriction:
      law.rows = 1;
      break;
    case LawType::kEquality:
    case LawType::kSpring:
      law.rows = options.only_rows > 0 ? options.only_rows : random.integer(1, 6);
      break;
    case LawType::kFrictionCone: {
      constexpr int kRows[] = {3, 3, 4, 6, 2};
      law.rows = options.only_rows > 0 ? options.only_rows : kRows[random.integer(0, 4)];
      law.coulomb = options.coulomb;
      const bool isotropic = options.isotropic ? *options.isotropic : random.coin();
      const double mu = random.integer(0, 9) == 0 ? 0.0 : random.uniform(0.0, options.max_friction);
      for (int i = 0; i < law.rows - 1; ++i) {
        law.friction[i] = isotropic ? mu : random.uniform(0.0, options.max_friction);
      }
      break;
    }
  }
  for (int i = 0; i < law.rows; ++i) {
    // Friction rows usually have no bias, except on conveyor belts.
    if (i == 0 || random.coin()) law.bias[i] = options.velocity * random.signed_unit();
  }
  return law;
}

/// Blocks of random size with a random positive definite M of random scale, and constraints of
/// every type. Some Jacobians repeat the one before, so that A is rank-deficient.
inline Problem random_problem(Random& random, const RandomOptions& options) {
  Problem problem;
  const int num_blocks = random.integer(1, options.max_blocks);
  std::vector<double> scale;
  for (int b = 0; b < num_blocks; ++b) {
    const int n = random.integer(1, options.max_block_size);
    problem.add_block(n);
    scale.push_back(random.log_uniform(1.0 / options.mass_ratio, 1.0) *
                    std::sqrt(options.mass_ratio));
  }
  const int num_constraints = random.integer(0, options.max_constraints);
  for (int i = 0; i < num_constraints; ++i) {
    constexpr LawType kTypes[] = {LawType::kFrictionCone, LawType::kFrictionCone,
                                  LawType::kUnilateral, LawType::kEquality, LawType::kDryFriction};
    LawType type = options.only_cones ? LawType::kFrictionCone : kTypes[random.integer(0, 4)];
    if (options.only_type) type = *options.only_type;
    const Law law = random_law(random, options, type);
    const int a = random.integer(0, num_blocks - 1);
    int b = random.integer(-1, num_blocks - 1);
    if (b == a) b = -1;
    problem.add_constraint(law, a, b);
  }
  for (int b = 0; b < num_blocks; ++b) {
    auto mass = problem.mass(b);
    const int n = static_cast<int>(mass.rows());
    MatrixX root(n, n);
    for (int i = 0; i < n * n; ++i) root.data()[i] = random.signed_unit();
    MatrixX m = scale[b] * (root * root.transpose() + 0.3 * MatrixX::Identity(n, n));
    mass = 0.5 * (m + m.transpose());
  }
  for (int i = 0; i < problem.num_velocities(); ++i) {
    problem.free_velocity()[i] = options.velocity * random.signed_unit();
  }
  for (int i = 0; i < num_constraints; ++i) {
    Law& law = problem.law(i);
    double alpha = 0.0;  // effective inverse mass, as the engine estimates it
    for (int side = 0; side < 2; ++side) {
      const int block = problem.block(i, side);
      if (block < 0) continue;
      auto jacobian = problem.jacobian(i, side);
      const bool repeat = i > 0 && problem.block(i - 1, side) == block &&
                          problem.law(i - 1).rows == law.rows && random.integer(0, 2) == 0;
      if (repeat) {
        jacobian = problem.jacobian(i - 1, side);
      } else {
        for (int r = 0; r < jacobian.rows(); ++r)
          for (int c = 0; c < jacobian.cols(); ++c)
            jacobian(r, c) = random.integer(0, 4) == 0 ? 0.0 : random.signed_unit();
      }
      alpha += 1.0 / scale[block];
    }
    law.regularizer = alpha * random.log_uniform(options.compliance_low, options.compliance_high);
    const double energy = options.velocity * options.velocity / alpha;
    const double k = energy * random.log_uniform(options.smoothing_low, options.smoothing_high);
    law.smoothing = options.hard ? 0.0 : k;
    law.bound = options.velocity / alpha * random.uniform(0.0, 1.0);
  }
  return problem;
}

/// Dense J of the whole problem, rows in the order of first_row.
inline MatrixX dense_jacobian(const Problem& problem) {
  MatrixX out = MatrixX::Zero(problem.num_rows(), problem.num_velocities());
  for (int i = 0; i < problem.num_constraints(); ++i) {
    for (int side = 0; side < 2; ++side) {
      const int b = problem.block(i, side);
      if (b < 0) continue;
      out.block(problem.first_row(i), problem.block_start(b), problem.law(i).rows,
                problem.block_size(b)) += problem.jacobian(i, side);
    }
  }
  return out;
}

inline MatrixX dense_mass(const Problem& problem) {
  MatrixX out = MatrixX::Zero(problem.num_velocities(), problem.num_velocities());
  for (int b = 0; b < problem.num_blocks(); ++b) {
    out.block(problem.block_start(b), problem.block_start(b), problem.block_size(b),
              problem.block_size(b)) = problem.mass(b);
  }
  return out;
}

}  // namespace counterpoint::contact::testing
