#include "counterpoint/model/mjcf/forces/couplings.h"

#include <cmath>

namespace counterpoint::mjcf {
namespace {

/// Coefficients below this share of the largest have cancelled and are dropped.
constexpr double kCancelled = 1e-12;

}  // namespace

Couplings::Couplings(RobotSpec& robot) : robot_(robot) {
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    index_[robot.joints[i].name] = static_cast<int>(i);
}

Couplings::Reduced Couplings::reduce(const Sum& sum) const {
  Reduced out;
  std::map<int, double> by_joint;
  double largest = 0.0;
  for (auto [joint, coefficient] : sum) {
    largest = std::max(largest, std::abs(coefficient));
    while (!robot_.joints[joint].mimic_master.empty()) {
      const JointSpec& follower = robot_.joints[joint];
      out.constant += coefficient * follower.mimic_offset;
      coefficient *= follower.mimic_multiplier;
      joint = index_.at(follower.mimic_master);
    }
    by_joint[joint] += coefficient;
  }
  for (const auto& [joint, coefficient] : by_joint)
    if (std::abs(coefficient) > kCancelled * largest) out.sum.emplace_back(joint, coefficient);
  return out;
}

Couplings::Outcome Couplings::couple(const Sum& sum, double value) {
  const Reduced reduced = reduce(sum);
  if (reduced.sum.empty()) return Outcome::kHeldAlready;
  if (reduced.sum.size() == 1) return Outcome::kLocks;
  if (reduced.sum.size() > 2) return Outcome::kTooMany;
  // The first joint of the sum follows the other one, as in the file.
  auto [first, a] = reduced.sum[0];
  auto [second, b] = reduced.sum[1];
  const Sum begin = reduce({sum.front()}).sum;
  if (!begin.empty() && begin[0].first == second) {
    std::swap(first, second);
    std::swap(a, b);
  }
  JointSpec& follower = robot_.joints[first];
  follower.mimic_master = robot_.joints[second].name;
  follower.mimic_multiplier = -b / a;
  follower.mimic_offset = (value - reduced.constant) / a;
  return Outcome::kCoupled;
}

}  // namespace counterpoint::mjcf
