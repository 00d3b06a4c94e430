// Linear couplings between joints, from equalities, for use by tendons and actuators.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/model_builder.h"

namespace counterpoint::mjcf {

class Couplings {
 public:
  explicit Couplings(RobotSpec& robot);

  /// Sum of coefficient times joint coordinate; joints by index into RobotSpec::joints.
  using Sum = std::vector<std::pair<int, double>>;
  /// The same sum in terms of joints that follow no other, each once, plus a constant.
  struct Reduced {
    Sum sum;
    double constant = 0.0;
  };
  Reduced reduce(const Sum& sum) const;

  enum class Outcome { kCoupled, kHeldAlready, kLocks, kTooMany };
  /// Makes one joint follow another so that the sum equals `value`; possible if the reduced sum has
  /// two joints.
  Outcome couple(const Sum& sum, double value);

 private:
  RobotSpec& robot_;
  std::map<std::string, int> index_;
};

}  // namespace counterpoint::mjcf
