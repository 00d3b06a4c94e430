// Random rotations and poses for tests, from a seed.
#pragma once

#include <random>

#include "counterpoint/model/spatial.h"

namespace counterpoint::test {

inline Vector3 random_vector(std::mt19937& rng, double scale = 1.0) {
  std::uniform_real_distribution<double> u(-scale, scale);
  const double x = u(rng);
  const double y = u(rng);
  return {x, y, u(rng)};
}

inline Vector3 random_unit(std::mt19937& rng) {
  std::normal_distribution<double> g;
  const double x = g(rng);
  const double y = g(rng);
  return Vector3(x, y, g(rng)).normalized();
}

inline Matrix3 random_rotation(std::mt19937& rng) {
  std::normal_distribution<double> g;
  const double w = g(rng);
  const double x = g(rng);
  const double y = g(rng);
  return Quaternion(w, x, y, g(rng)).normalized().toRotationMatrix();
}

inline Pose random_pose(std::mt19937& rng, double scale = 1.0) {
  const Matrix3 rotation = random_rotation(rng);
  return {rotation, random_vector(rng, scale)};
}

}  // namespace counterpoint::test
