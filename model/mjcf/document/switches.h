// Settings of <option> and its <flag>.
#pragma once

#include <set>
#include <string>

namespace counterpoint::mjcf {

struct Switches {
  std::set<std::string> off;  ///< <flag> attributes with the value "disable"
  bool pairs_only = false;    ///< collision="predefined"
  bool no_pairs = false;      ///< collision="dynamic"
  std::set<int> groups_off;   ///< actuatorgroupdisable
  bool elliptic = false;      ///< cone="elliptic"
  double impratio = 1.0;      ///< frictional over normal impedance [-]

  /// `kind`: equality, frictionloss, limit or contact. The flag `constraint` switches off all four.
  bool constraint_off(const char* kind) const {
    return off.count(kind) > 0 || off.count("constraint") > 0;
  }
};

}  // namespace counterpoint::mjcf
