// MuJoCo MPC's `Direct` optimizer (Gauss-Newton on positions through mj_inverse, derivatives by
// finite differences) on one of our scenes. Optional: built where COUNTERPOINT_MUJOCO_MPC names a
// checkout of google-deepmind/mujoco_mpc.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/model/scene.h"
#include "peers/mujoco.h"

namespace counterpoint::peers {

/// Least-squares problem over frames q_0 ... q_N, time_step apart, for one robot with a floating
/// base and joints of one coordinate:
///
///   1/2 sum over frames |pose_weight (q_t (-) target_t)|^2
///   + 1/2 sum over steps |force_weight u_t|^2
///
/// q_0 is fixed, and the robot is at rest before it.
struct DirectTask {
  const Scene* scene = nullptr;
  std::vector<VectorX> targets;  ///< q_0 ... q_N (nq); also the initial guess
  VectorX pose_weight;           ///< nv [1/m, 1/rad]
  VectorX force_weight;          ///< nv [1/N, 1/(N m)]
};

class MujocoDirect {
 public:
  /// Uses MuJoCo's default contacts. @throws NotExpressible
  explicit MujocoDirect(const DirectTask& task);
  ~MujocoDirect();
  MujocoDirect(const MujocoDirect&) = delete;
  MujocoDirect& operator=(const MujocoDirect&) = delete;

  /// Runs at most `most` further Gauss-Newton iterations; returns the number done.
  int iterate(int most);
  double cost() const;
  /// Largest force on the base over all steps [N], and torque [N m].
  double base_force() const;
  double base_torque() const;
  /// Largest difference of any coordinate [m, rad] between frame t + 1 and the result of mj_step
  /// from frame t under the force of mj_inverse.
  double forward_check();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::peers
