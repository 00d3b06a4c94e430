// Joints coupled linearly: what equalities, tendons and actuators make of it.
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

  /// Sum of coefficient times coordinate; joints by index into RobotSpec::joints.
  using Sum = std::vector<std::pair<int, double>>;
  /// The same by joints that follow no other, each once, plus a constant.
  struct Reduced {
    Sum sum;
    double constant = 0.0;
  };
  Reduced reduce(const Sum& sum) const;

  enum class Outcome { kCoupled, kHeldAlready, kLocks, kTooMany };
  /// Makes one joint follow another so that the sum is `value`, if two joints are in it.
  Outcome couple(const Sum& sum, double value);

 private:
  RobotSpec& robot_;
  std::map<std::string, int> index_;
};

}  // namespace counterpoint::mjcf
