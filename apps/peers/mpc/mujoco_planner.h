// MuJoCo MPC's planners with our robots and the terms of our control problems in its form.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "counterpoint/engine/optimize/control.h"

struct mjData_;

namespace counterpoint::peers {

/// Residuals of the task:
///   0 height of the base less that of the posture [m]
///   1 rotation vector of the base [rad]
///   2 velocity of the base, linear in W and angular in its own axes, less the target [m/s, rad/s]
///   3 joints less the posture [rad]
///   4 motors' forces over their limits
///   5 velocities of the joints [rad/s]
///   6 capture point less the mean of the feet, level components [m]
///   7 heights of the feet less those of a trot [m]
inline constexpr std::size_t kPlannerResiduals = 8;

struct MujocoPlannerTask {
  const optimization::ControlFile* control = nullptr;
  VectorX posture;                    ///< configuration that stands (nq)
  double target_speed = 0.0;          ///< target velocity of the base along x [m/s]
  double cadence = 2.0, lift = 0.06;  ///< strides a second and height of a step [m] of the trot
  std::string planner = "sampling";   ///< or cross_entropy, ilqg, gradient
  std::array<double, kPlannerResiduals> weights{};
  bool robust = false;  ///< norms of MuJoCo MPC's quadruped in place of halves of squares
  double step = 0.01, horizon = 0.35;  ///< [s]
  int candidates = 10, spline_points = 3;
  double exploration = 0.1;  ///< standard deviation over half the range of a control
  /// Controls are targets of servos, whose stiffness is this times the problem's; 0: forces.
  double servo = 0.0;
};

/// One at a time: MuJoCo has a single callback for sensors, which gives the residuals.
class MujocoPlanner {
 public:
  /// @throws NotExpressible for features that MuJoCo lacks, and for an unknown planner.
  explicit MujocoPlanner(const MujocoPlannerTask& task);
  ~MujocoPlanner();
  MujocoPlanner(const MujocoPlanner&) = delete;
  MujocoPlanner& operator=(const MujocoPlanner&) = delete;

  /// Makes the next plan from the state of the world in one thread. Returns processor time [s].
  double replan(const mjData_& world);
  /// Writes the motors' forces at the world's state (nv) [N m].
  void force(const mjData_& world, VectorX& out) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::peers
