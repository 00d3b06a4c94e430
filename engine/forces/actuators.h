// Forces of actuators (model/parts/actuator.h) in a step.
//
//   on joints, tendons   a row with y = gear w+, or gear dL/dt: impulse h clamp(f - c y, bounds)
//   muscles              the same row along their pull, f >= 0
//   on links, adhesion   wrenches, constant over the step
//
// f, c and the wrenches follow from (q, v), the internal states z and the command at the start of a
// step. The inverse knows them all and finds the same rows and wrenches.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/forces/tendons.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

class Actuators {
 public:
  explicit Actuators(const Model& model);

  /// Finds the forces of a step from its start: poses and contacts (of `constraints`) at q, the
  /// lengths of tendons, at.z and the command of `input`.
  void find(const StepContext& at, const Kinematics& data, const Tendons& tendons,
            const ConstraintSet& constraints, const Input& input);
  /// Appends the rows of those on joints and tendons, except on idle bodies.
  void add_rows(const StepContext& at, const Tendons& tendons, SleepMask idle,
                ConstraintSet& out) const;
  std::span<const ExternalWrench> wrenches() const { return wrenches_; }

  /// Whether derivatives of all forces by (q, v) are those of rows of given gains: they depend on
  /// joints and fixed tendons alone, and not on the velocity at the start of the step.
  bool have_closed_forms() const { return closed_forms_; }

  /// Computes the forces of the step (one per actuator) [N, N m] and writes their internal states
  /// at its end into z_next (nz), given the velocities w (nv) that the rows see.
  void conclude(const StepContext& at, const Tendons& tendons, const VectorRef& w, VectorX& force,
                VectorX& z_next);

 private:
  /// Force f - c y of one actuator, within bounds, and what its states become.
  struct Drive {
    double force = 0.0;      ///< f [N, N m]
    double gain = 0.0;       ///< c [N s/m, N m s/rad]
    double stiffness = 0.0;  ///< -df/dx [N/m, N m/rad]
    double least = 0.0, most = 0.0;
    double command = 0.0;  ///< command behind all filters
    double length = 0.0;   ///< x [m, rad]
    double rate = 0.0;     ///< y at the start [m/s, rad/s]
  };
  double find_command(const Actuator& actuator, double given, const StepContext& at);
  void find_length(const Actuator& actuator, const StepContext& at, const Tendons& tendons,
                   Drive& drive) const;
  void find_law(const Actuator& actuator, const StepContext& at, Drive& drive) const;
  void add_wrench(const Actuator& actuator, double force, const Kinematics& data);
  void attract(const Model& model, const Actuator& actuator, double force, const Kinematics& data,
               const ConstraintSet& constraints);

  std::vector<Drive> drives_;
  std::vector<ExternalWrench> wrenches_;
  bool closed_forms_ = false;
  VectorX z_next_;  ///< nz: states of the commands at the end of the step
};

}  // namespace counterpoint
