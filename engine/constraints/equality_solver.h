// Velocities that satisfy equality constraints: one linear system, kept factored.
//
//   w+ = w* - inv(M) J' f,    (J inv(M) J' + R) f = J w* + b
//
// contact::Solver finds the same to its tolerance, for any laws; here all laws are equalities.
#pragma once

#include <vector>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

class EqualitySolver {
 public:
  /// With more rows contact::Solver is faster, since it solves islands one by one.
  static constexpr int kManyRows = 48;

  /// False if there are too many rows, or M is singular. All laws must be equalities.
  bool factor(const contact::Problem& problem);

  /// w+ (num_velocities) for the free velocity and the biases that the problem has by now; its M
  /// and J are those of `factor`.
  void solve(const contact::Problem& problem, Eigen::Ref<VectorX> w);

 private:
  // Dense, column by column; vectors keep their capacity.
  std::vector<double> mass_;      ///< of one block, then its factor
  std::vector<double> jacobian_;  ///< J, rows x velocities
  std::vector<double> answer_;    ///< inv(M) J'
  std::vector<double> system_;    ///< the factor of J inv(M) J' + R
  std::vector<double> impulse_;
};

}  // namespace counterpoint
