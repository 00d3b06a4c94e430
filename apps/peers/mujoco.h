// MuJoCo with our scenes, states and units at its interface, so that one measurement serves both
// engines. Optional: without MuJoCo at build time every constructor throws.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"
#include "mujoco_settings.h"
#include "not_expressible.h"

struct mjModel_;
struct mjData_;

namespace counterpoint::peers {

/// Version, such as "2.2.2"; empty if MuJoCo was not found at build time.
std::string mujoco_version();

/// Report of a step.
struct MujocoStep {
  int iterations = 0;            ///< iterations of its solver
  double max_penetration = 0.0;  ///< at the start of the step [m], 0 if nothing overlaps
  std::string failure;           ///< why the step is invalid; empty: it is valid
};

/// Input of mj_inverse: a state and its acceleration in MuJoCo's coordinates.
struct MujocoMoment {
  std::vector<double> qpos, qvel, qacc;
};

/// One mjModel with its mjData. Not copyable; one thread.
class Mujoco {
 public:
  /// Starts at the scene's start. @throws NotExpressible for features that MuJoCo lacks or cannot
  /// compute, and if MuJoCo is missing.
  Mujoco(const Scene& scene, MujocoSettings settings);
  ~Mujoco();
  Mujoco(const Mujoco&) = delete;
  Mujoco& operator=(const Mujoco&) = delete;

  void set_time_step(double h);  ///< [s]

  /// State in our coordinates (model/model.h). Setting it clears the solver's warm start.
  void set_state(const State& state);
  const State& state() const;

  /// Takes one step of the scene under `input`, in substeps if set; effort limits clamp the applied
  /// force as in our engine. If the step fails, the state is unchanged.
  MujocoStep step(const Input& input);

  /// Takes `count` steps with the model's servo targets as the only input and nothing between them,
  /// for timing. Returns the reason of a failure, or "".
  std::string run(long count);
  /// Reads the state after run() into state(); step() does this itself.
  void finish_run();

  /// Takes one step without input and stores its start and the acceleration there. Returns the
  /// reason of a failure, or "".
  std::string step_from(MujocoMoment& moment);
  /// Calls mj_inverse for each moment, for timing. Call set_state before any other use.
  void run_inverse(const MujocoMoment* moments, std::size_t count);
  /// Largest applied force that the last inverse found (none was applied in step_from), and the
  /// largest constraint or bias force [N, N m].
  struct InverseForces {
    double applied = 0.0, scale = 0.0;
  };
  InverseForces inverse_forces() const;
  /// Bytes in use: model, data, and the used part of the arena.
  std::size_t memory() const;
  /// Arguments for MuJoCo's own functions (mujoco_derivatives.h).
  mjModel_* own_model() const;
  mjData_* own_data() const;

  // Results of the last step.
  /// Forces at all contact points: geometries of the scene's model, A with the lower index, force
  /// on B in W [N].
  const std::vector<ContactForce>& contacts() const;
  /// Forces of Model::closures on body B, in W [N]. Torques of welds are not available: NaN.
  const std::vector<ClosureForce>& closures() const;

  // Quantities of the current state, from MuJoCo's own model.
  std::vector<Pose> poses() const;         ///< X_WB, the world first
  std::vector<Motion> velocities() const;  ///< V_WB at each body's origin, in W
  double energy() const;                   ///< kinetic and potential energy, including springs [J]
  MatrixX mass_matrix() const;             ///< nv x nv, including armature

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::peers
