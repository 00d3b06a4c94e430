// Small mechanical scenes written directly as contact problems: bodies with 6 velocities (linear,
// angular) at their centres of mass, contacts at given points.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact::testing {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

constexpr double kGravity = 9.81;

struct SceneOptions {
  double time_step = 0.002;
  double compliance = 1e-6;  ///< eps
  double smoothing = 0.0;    ///< delta [m]
  bool coulomb = false;
};

struct ScenePoint {
  int block_a, block_b;  ///< -1: the world
  Vector3 arm_a, arm_b;  ///< from the centres of mass to the contact [m]
  Vector3 normal;        ///< unit vector from a to b
  double friction, gap;
};

inline int add_body(Problem& problem, double mass, const Vector3& inertia, const Vector3& linear,
                    const Vector3& angular) {
  const int b = problem.add_block(6);
  problem.mass(b).setZero();
  problem.mass(b).diagonal() << mass, mass, mass, inertia;
  problem.free_velocity().segment<3>(problem.block_start(b)) = linear;
  problem.free_velocity().segment<3>(problem.block_start(b) + 3) = angular;
  return b;
}

inline Vector3 box_inertia(double mass, const Vector3& size) {
  const Vector3 s = size.cwiseAbs2();
  return mass / 12.0 * Vector3(s[1] + s[2], s[0] + s[2], s[0] + s[1]);
}

inline Matrix3 cross_matrix(const Vector3& v) {
  Matrix3 m;
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return m;
}

/// Adds contacts to a problem that has all its bodies. Rows: normal, t1, t2 of v_b - v_a.
inline void add_points(Problem& problem, const std::vector<ScenePoint>& points,
                       const SceneOptions& options) {
  const int first = problem.num_constraints();
  for (const ScenePoint& p : points) {
    Law law;
    law.type = LawType::kFrictionCone;
    law.rows = 3;
    law.coulomb = options.coulomb;
    law.friction[0] = law.friction[1] = p.friction;
    double alpha = 0.0;
    for (const int b : {p.block_a, p.block_b}) {
      if (b >= 0) alpha += 1.0 / problem.mass(b)(0, 0);
    }
    law.regularizer = options.compliance * alpha;
    law.smoothing = options.smoothing * 9.80665 / alpha;
    law.bias[0] = p.gap / options.time_step * (p.gap < 0.0 ? 0.2 : 1.0);
    if (p.block_a < 0) {
      problem.add_constraint(law, p.block_b);
    } else {
      problem.add_constraint(law, p.block_b, p.block_a);
    }
  }
  for (size_t i = 0; i < points.size(); ++i) {
    const ScenePoint& p = points[i];
    const Vector3 n = p.normal;
    const Vector3 seed = std::abs(n.x()) < 0.7 ? Vector3::UnitX() : Vector3::UnitY();
    Matrix3 frame;  // rows: n, t1, t2
    frame.row(0) = n;
    frame.row(1) = (seed - seed.dot(n) * n).normalized();
    frame.row(2) = n.cross(Vector3(frame.row(1)));
    Eigen::Matrix<double, 3, 6> b, a;
    b << frame, -frame * cross_matrix(p.arm_b);
    a << -frame, frame * cross_matrix(p.arm_a);
    const int c = first + static_cast<int>(i);
    if (p.block_a < 0) {
      problem.jacobian(c, 0) = b;
    } else {
      problem.jacobian(c, 0) = p.block_b >= 0 ? MatrixX(b) : MatrixX(a);
      if (p.block_b >= 0) problem.jacobian(c, 1) = a;
    }
  }
}

/// A stack of cubes with edge `size` [m] at rest on the ground, four contacts per face, masses from
/// bottom to top; the free velocity includes one step of gravity.
inline Problem make_stack(const std::vector<double>& masses, double size, double friction,
                          const SceneOptions& options) {
  Problem problem;
  for (const double m : masses) {
    add_body(problem, m, box_inertia(m, Vector3::Constant(size)),
             Vector3(0, 0, -kGravity * options.time_step), Vector3::Zero());
  }
  std::vector<ScenePoint> points;
  const double half = 0.5 * size;
  for (int level = 0; level < static_cast<int>(masses.size()); ++level) {
    for (const double x : {-half, half}) {
      for (const double y : {-half, half}) {
        points.push_back({level - 1, level, Vector3(x, y, half), Vector3(x, y, -half),
                          Vector3::UnitZ(), friction, 0.0});
      }
    }
  }
  add_points(problem, points, options);
  return problem;
}

}  // namespace counterpoint::contact::testing
