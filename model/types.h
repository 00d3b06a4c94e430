// Numeric types of the project: Eigen types in double precision.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <stdexcept>
#include <string>

namespace counterpoint {

using Vector3 = Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using VectorX = Eigen::VectorXd;
using Matrix3 = Eigen::Matrix3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using MatrixX = Eigen::MatrixXd;
using Quaternion = Eigen::Quaterniond;
using VectorRef = Eigen::Ref<const VectorX>;
using VectorOut = Eigen::Ref<VectorX>;

/// Standard gravity [m/s^2], ISO 80000-3. Also the g0 of the contact smoothing, with or without gravity.
inline constexpr double kStandardGravity = 9.80665;

/// Input a user can correct: a file, an element, a value. The message says where, what was expected
/// and what to do. Commands turn it into exit code 2.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
};

}  // namespace counterpoint
