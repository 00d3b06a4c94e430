// Forces of tendons (model/parts/tendon.h), each a row on the coordinates with y = dL/dt = J w+, J
// = dL/dq at the start of the step:
//
//   spring, damper   f = -h (k (L + h y - L0) + d y)
//   slack spring     the same spring, pulling only below or above its rest lengths
//   servo            f = clamp(h (k (L_t - L - h y) + d (v_t - y) + F), h F_least, h F_most)
//   friction, limits as of joints
//
// F: force of the input. The impulse f acts as J' f. All are functions of (q, w+) and known inputs,
// so the inverse has the same rows.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// Second derivatives of a tendon's length [m/rad^2, ...], and scratch memory that only grows.
struct TendonCurvature {
  /// Derivative of arm i by the displacement of the coordinate of arm j.
  double& operator()(int i, int j) { return entries[static_cast<size_t>(i * arms + j)]; }
  int arms = 0;
  std::vector<double> entries;
  std::vector<Vector3> by_q[2];  ///< per arm: velocities of the two ends of a segment
};

/// Lengths and moment arms of a model's tendons in one configuration.
class Tendons {
 public:
  explicit Tendons(const Model& model);

  /// Computes them at q (nq), whose poses are in `at`, without those of idle bodies.
  void find(const Model& model, const VectorRef& q, const Kinematics& at, SleepMask idle);

  double length(int tendon) const { return length_[static_cast<size_t>(tendon)]; }  ///< [m]
  /// Moment arms dL/dq [m/rad, -]: coordinates that can change the length, ascending.
  std::span<const RowTerm> arms(int tendon) const { return arms_[static_cast<size_t>(tendon)]; }
  /// Whether find() left it out, since its bodies are idle.
  bool is_idle(int tendon) const { return idle_[static_cast<size_t>(tendon)] != 0; }

  /// Computes d2L/dq2 of a spatial tendon.
  void find_curvature(const Model& model, int tendon, const Kinematics& at,
                      TendonCurvature& out) const;

 private:
  /// A coordinate on the way from the reference body of a segment to the body of its end.
  struct Step {
    int arm = 0;  ///< index among the arms
    int body = 0, v_index = 0;
    double sign = 1.0;  ///< -1: the joint lies on the reference body's side
  };
  struct Chain {
    int end = -1;             ///< body of the end, or -1: nothing moves it
    std::vector<Step> steps;  ///< from the reference outwards
  };
  void add_turning(const Model& model, const Chain& chain, const Kinematics& at, const Vector3& by,
                   const std::vector<Vector3>& columns, TendonCurvature& out) const;
  Chain make_chain(const Model& model, int reference, int end, const std::vector<int>& arms) const;

  std::vector<double> length_;
  std::vector<std::vector<RowTerm>> arms_;
  std::vector<char> idle_;
  std::vector<int> moved_;  ///< per tendon: a body that changes its length
  /// Per tendon and segment: the ways to its start and to its end.
  std::vector<std::vector<std::array<Chain, 2>>> chains_;
};

/// Appends the rows of springs, dampers, friction and limits, except of idle tendons.
void add_tendon_rows(const StepContext& at, const Tendons& tendons, const InverseWeights& weights,
                     ConstraintSet& out);

/// Appends the rows of servos and inputs, except of idle tendons. Targets and forces from `input`,
/// else from the model.
void add_tendon_servos(const StepContext& at, const Tendons& tendons, const Input& input,
                       ConstraintSet& out);

/// Returns the energy in the springs of tendons at q (nq) [J].
double tendon_energy(const Model& model, const VectorRef& q, const std::vector<Pose>& X_WB);

}  // namespace counterpoint
