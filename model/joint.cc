#include "counterpoint/model/joint.h"

#include <array>
#include <cmath>

namespace counterpoint {
namespace {

using Suffixes = std::span<const char* const>;
constexpr std::array kScalarQ{"q"};
constexpr std::array kScalarV{"v"};
constexpr std::array kScalarForce{"u"};
constexpr std::array kPlanarQ{"x", "y", "angle"};
constexpr std::array kPlanarV{"vx", "vy", "w"};
constexpr std::array kPlanarForce{"fx", "fy", "tz"};
// Spherical joints use the last four, three and three of these.
constexpr std::array kFloatingQ{"x", "y", "z", "qw", "qx", "qy", "qz"};
constexpr std::array kFloatingV{"vx", "vy", "vz", "wx", "wy", "wz"};
constexpr std::array kFloatingForce{"fx", "fy", "fz", "tx", "ty", "tz"};

}  // namespace

Matrix3 turned_about_z(const Matrix3& R, double angle) {
  const double s = std::sin(angle), c = std::cos(angle);
  Matrix3 out;
  out.col(0) = c * R.col(0) + s * R.col(1);
  out.col(1) = c * R.col(1) - s * R.col(0);
  out.col(2) = R.col(2);
  return out;
}

const char* joint_type_name(JointType type) {
  switch (type) {
    case JointType::kRevolute:
      return "revolute";
    case JointType::kPrismatic:
      return "prismatic";
    case JointType::kPlanar:
      return "planar";
    case JointType::kSpherical:
      return "spherical";
    case JointType::kFloating:
      return "floating";
  }
  return "?";
}

JointSuffixes joint_suffixes(JointType type) {
  switch (type) {
    case JointType::kRevolute:
    case JointType::kPrismatic:
      return {kScalarQ, kScalarV, kScalarForce};
    case JointType::kPlanar:
      return {kPlanarQ, kPlanarV, kPlanarForce};
    case JointType::kSpherical:
      return {Suffixes(kFloatingQ).subspan(3), Suffixes(kFloatingV).subspan(3),
              Suffixes(kFloatingForce).subspan(3)};
    case JointType::kFloating:
      return {kFloatingQ, kFloatingV, kFloatingForce};
  }
  return {};
}

}  // namespace counterpoint
