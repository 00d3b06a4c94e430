// Numbers in exported files, with 17 digits: reading them gives the same bits.
#pragma once

#include <fmt/format.h>

#include <initializer_list>
#include <string>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

inline std::string export_number(double value) { return fmt::format("{:.17g}", value); }

inline std::string export_numbers(std::initializer_list<double> values) {
  std::string out;
  for (const double value : values) {
    if (!out.empty()) out += ' ';
    out += export_number(value);
  }
  return out;
}

inline std::string export_numbers(const Vector3& v) {
  return export_numbers({v.x(), v.y(), v.z()});
}

/// Returns the quaternion w x y z of a rotation matrix.
inline std::string export_quaternion(const Matrix3& R) {
  const Quaternion q(R);
  return export_numbers({q.w(), q.x(), q.y(), q.z()});
}

}  // namespace counterpoint
