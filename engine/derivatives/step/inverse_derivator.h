// Derivatives of the inverse of a semi-implicit Euler step, in closed form.
//
//   u = M a + n(q, v) + joint forces(q, v, v+) - wrenches - J' f(J v+ + b(q, v)) / h
//   a = (v+ - v) / h
//
// Sweeps over the trees (sweep.h) differentiate M a + n. Each contact, drag and wrench is a force
// on its body with a 6x6 response to the body's displacement and velocities, which the same sweep
// carries to the joints. Two moving bodies are coupled along their paths. Joint rows and joint
// forces act on their own coordinates.
#pragma once

#include <optional>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/constraints/patch_response.h"
#include "counterpoint/engine/derivatives/constraints/slip_response.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/derivatives/forces/contact_force_rows.h"
#include "counterpoint/engine/derivatives/forces/force_responses.h"
#include "counterpoint/engine/derivatives/forces/velocity_terms.h"
#include "counterpoint/engine/derivatives/inverted_step.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

class InverseDerivator {
 public:
  explicit InverseDerivator(const Model& model);

  /// Computes d after step_inverse with these arguments and `ws`. du/dv+ is always found. Returns
  /// false if du/dq and du/dv are not, because something acts that has no closed form.
  bool compute(const InverseArguments& of, const InvertedStep& inverted, InverseDerivatives& d);

  /// Forces that displace bodies in addition to h w+ (overlap_correction.h).
  enum class Displacing {
    kLateImpulses,  ///< -(t / h) J' f / h of contacts that bounce, at times t(q, v)
    kRecovery,      ///< M(q) p / h - J' f(J w + b(q)) / h, w = w+ + p: gaps that p may close
    kEqualities,    ///< C p - J' f(J p) / h: drag, and equalities without bias
  };
  /// Computes their derivatives by q, by v and by w (at `w`), with p held. Needs
  /// *inverted.constraints with the laws of `part`, kinematics at (q, v) without forces, and
  /// velocities at w in *inverted.body_velocity. Returns false like compute.
  bool compute_displacing(Displacing part, const InverseArguments& of, const VectorRef& p,
                          const VectorRef& w, const InvertedStep& inverted, InverseDerivatives& d);

  /// Computes the derivatives of (M(q) (w - m) - J' f(J w + b(q, v))) / h, the equation by which
  /// impulses change the velocity m to w at (q, v): by q, by v and m with dm = dv, and by w. Needs
  /// *inverted.constraints, kinematics at (q, v) and velocities at w in *inverted.body_velocity.
  /// Returns false like compute. Removes velocity-dependent forces from inverted.at().
  bool compute_impulses(const InverseArguments& of, const VectorRef& m, const VectorRef& w,
                        const InvertedStep& inverted, InverseDerivatives& d);

 private:
  void begin(const Model& model, InverseDerivatives& d);
  bool add_contacts(const InverseArguments& of, const InvertedStep& inverted);
  bool contact_response(const InverseArguments& of, size_t contact, const PairBodies& bodies,
                        const InvertedStep& inverted, PairResponse& out);
  ImpulseShare find_share(const Bounce& bounce, double h, const Vector3& fall) const;
  bool add_patch(const InverseArguments& of, size_t contact, const PairBodies& bodies,
                 const InvertedStep& inverted, PairResponse& out);
  bool find_motion(const Model& model, double h, size_t contact, const InvertedStep& inverted,
                   ContactMotion& out);
  bool add_slip(const Model& model, const SimulationOptions& options, const InvertedStep& inverted);
  void set_velocities(const Model& model, const VectorRef& v, const VectorRef& v_next, double h,
                      const InvertedStep& inverted);
  bool sweep_trees(const InverseArguments& of, const InvertedStep& inverted, InverseDerivatives& d);
  bool add_closure_rows(const Model& model, const SimulationOptions& options,
                        const InvertedStep& inverted, InverseDerivatives& d);

  std::optional<Displacing> displacing_;  ///< empty: a step, or its impulses
  TreeSweep sweep_;
  VelocityTerms velocity_terms_;
  ClosureDerivator closures_;
  ContactMotionFinder motions_;
  SlipResponse slips_;
  TendonCurvature curvature_;
  ForceResponses forces_;
  ContactForceRows contact_forces_;
  MovingPatch patch_;
  VectorX v_;             ///< nv: velocity at which velocity-dependent forces are taken
  VectorX acceleration_;  ///< nv
};

}  // namespace counterpoint
