// MuJoCo as a peer: the same scene, state and units as ours on its way in and out, so that one
// measurement serves both. Optional: without MuJoCo at build time every constructor throws.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"
#include "not_expressible.h"

struct mjModel_;
struct mjData_;

namespace counterpoint::peers {

/// How MuJoCo is set up.
///   kDefault  as it comes: time step and gravity of the scene, nothing else
///   kBest     for accuracy: elliptic cones, impratio 100, solimp 0.9999, shortest solref that it
///             allows, tolerance 1e-12, up to 1000 iterations, implicit integration, several points
///             a pair of convex shapes
///   kRungeKutta4  as kDefault, but for its Runge-Kutta method of order four
///   kElliptic  as kDefault, but with elliptic cones of friction in place of pyramids
enum class MujocoSettings { kDefault, kBest, kRungeKutta4, kElliptic };

/// "2.2.2", or empty: MuJoCo was not found when this was built.
std::string mujoco_version();

/// What a step took.
struct MujocoStep {
  int iterations = 0;            ///< of its solver
  double max_penetration = 0.0;  ///< at the start of the step [m], 0 if nothing overlaps
  std::string failure;           ///< why the step must not be trusted; empty: it may
};

/// What mj_inverse is given: a state in MuJoCo's own coordinates and its acceleration there.
struct MujocoMoment {
  std::vector<double> qpos, qvel, qacc;
};

/// One mjModel with its mjData. Not copyable; one thread.
class Mujoco {
 public:
  /// At the scene's start. @throws NotExpressible for what MuJoCo lacks or cannot compile, and if
  /// it is not there.
  Mujoco(const Scene& scene, MujocoSettings settings);
  ~Mujoco();
  Mujoco(const Mujoco&) = delete;
  Mujoco& operator=(const Mujoco&) = delete;

  void set_time_step(double h);  ///< [s]

  /// In our coordinates (model/model.h). Setting it forgets what MuJoCo's solver remembers.
  void set_state(const State& state);
  const State& state() const;

  /// One step under `input`: effort limits cut the applied force as they do in ours. If it fails
  /// the state is left as it was.
  MujocoStep step(const Input& input);

  /// `count` steps without input but for the model's servo targets, with nothing between them: for
  /// timing. Returns why it did not come to its end, or "".
  std::string run(long count);
  /// Of the state that run() left, brought back into ours; step() does it by itself.
  void finish_run();

  /// One step without input that keeps where it started and the acceleration there.
  /// Returns why it failed, or "".
  std::string step_from(MujocoMoment& moment);
  /// mj_inverse at each of these: for timing. What follows needs set_state.
  void run_inverse(const MujocoMoment* moments, std::size_t count);
  /// Largest force that the last inverse found to be applied, of the last step_from's moment there
  /// is none; and the largest force of constraints or bias beside it [N, N m].
  struct InverseForces {
    double applied = 0.0, scale = 0.0;
  };
  InverseForces inverse_forces() const;
  /// Bytes in use: model, data, and as much of the arena as has been used.
  std::size_t memory() const;
  /// What MuJoCo's own functions take (mujoco_derivatives.h).
  mjModel_* own_model() const;
  mjData_* own_data() const;

  // Of the last step.
  /// Forces at the contact points that carry or touch: geometries are those of the scene's model,
  /// A the lower index, force on B, in W [N].
  const std::vector<ContactForce>& contacts() const;
  /// By Model::closures: force on body B, in W [N]. Torques of welds are not given: NaN.
  const std::vector<ClosureForce>& closures() const;

  // Of the state as it is now, from MuJoCo's own model.
  std::vector<Pose> poses() const;         ///< X_WB, the world first
  std::vector<Motion> velocities() const;  ///< V_WB at each body's origin, in W
  double energy() const;                   ///< kinetic and potential [J]; springs included
  MatrixX mass_matrix() const;             ///< nv x nv, armature included

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::peers
