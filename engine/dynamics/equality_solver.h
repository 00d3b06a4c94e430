// Velocities that satisfy equality constraints, from one linear system that is kept factored.
//
//   w+ = w* - inv(M) J' f,    (J inv(M) J' + R) f = J w* + b
//
// Here f is minus the impulse of contact/problem.h. contact::Solver finds the same within its
// tolerance for any laws; here all laws must be equalities.
#pragma once

#include <vector>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

class EqualitySolver {
 public:
  /// Largest number of rows: beyond it contact::Solver is faster, since it solves islands one by
  /// one.
  static constexpr int kManyRows = 48;

  /// Returns false if there are too many rows or M is singular. All laws must be equalities.
  bool factor(const contact::Problem& problem);

  /// Computes w+ (num_velocities) for the present free velocity and biases of the problem; its M
  /// and J must be those of the last `factor`.
  void solve(const contact::Problem& problem, Eigen::Ref<VectorX> w);

 private:
  // Dense column-major matrices; the vectors keep their capacity.
  std::vector<double> mass_;      ///< mass matrix of one block, then its factor
  std::vector<double> jacobian_;  ///< J, rows x velocities
  std::vector<double> answer_;    ///< inv(M) J'
  std::vector<double> system_;    ///< the factor of J inv(M) J' + R
  std::vector<double> impulse_;
};

}  // namespace counterpoint
