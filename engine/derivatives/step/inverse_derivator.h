// Derivatives of the inverse of a semi-implicit Euler step, in closed form.
//
//   u = M a + n(q, v) + joint forces(q, v, v+) - wrenches - J' f(J v+ + b(q, v)) / h,  a = (v+ - v)
//   / h
//
// M a + n by sweeps over the trees (sweep.h); each contact, drag and wrench as a force on its body
// with a 6x6 response to the body's displacement and velocities, which the same sweep carries to
// the joints; what couples two moving bodies by their paths; joint rows and joint forces on their
// own coordinates.
#pragma once

#include <optional>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/constraints/patch_response.h"
#include "counterpoint/engine/derivatives/constraints/slip_response.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/derivatives/forces/force_responses.h"
#include "counterpoint/engine/derivatives/forces/velocity_terms.h"
#include "counterpoint/engine/step/step_start.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

class InverseDerivator {
 public:
  explicit InverseDerivator(const Model& model);

  /// After step_inverse with these arguments and `ws`. du/dv+ is always found; false if du/dq and
  /// du/dv are not: what acts is not known here in closed form.
  bool compute(const InverseArguments& of, Workspace::Impl& ws, InverseDerivatives& d);

  /// What of a step displaces bodies beside w+ (overlap_correction.h).
  enum class Displacing {
    kLateImpulses,  ///< -(t / h) J' f / h of contacts that bounce, their t as it goes with (q, v)
    kRecovery,      ///< M(q) p / h - J' f(J w + b(q)) / h, w = w+ + p: of gaps that p may close
    kEqualities,    ///< C p - J' f(J p) / h: drag, and equalities without bias
  };
  /// These by q, by v, by w (at `w`), p held. Needs ws.constraints with the laws that `part` has,
  /// kinematics at (q, v) without forces and velocities at w in ws.velocity. False as compute.
  bool compute_displacing(Displacing part, const InverseArguments& of, const VectorRef& p,
                          const VectorRef& w, Workspace::Impl& ws, InverseDerivatives& d);

  /// Of (M(q) (w - m) - J' f(J w + b(q, v))) / h, what impulses make of a velocity m at (q, v): by
  /// q, by v and m changing alike, by w. Needs ws.constraints, kinematics at (q, v) and velocities
  /// at w in ws.velocity. False as compute. Takes velocity-dependent forces out of ws.data.
  bool compute_impulses(const InverseArguments& of, const VectorRef& m, const VectorRef& w,
                        Workspace::Impl& ws, InverseDerivatives& d);

 private:
  void begin(const Model& model, Workspace::Impl& ws, InverseDerivatives& d);
  bool add_contacts(const InverseArguments& of, Workspace::Impl& ws);
  bool contact_response(const InverseArguments& of, size_t contact, const PairBodies& bodies,
                        Workspace::Impl& ws, PairResponse& out);
  ImpulseShare find_share(const Bounce& bounce, double h, const Vector3& fall) const;
  bool add_patch(const InverseArguments& of, size_t contact, const PairBodies& bodies,
                 Workspace::Impl& ws, PairResponse& out);
  bool find_motion(const Model& model, double h, size_t contact, Workspace::Impl& ws,
                   ContactMotion& out);
  bool add_slip(const Model& model, const SimulationOptions& options, Workspace::Impl& ws);
  void set_velocities(const Model& model, const VectorRef& v, const VectorRef& v_next, double h,
                      const Workspace::Impl& ws);
  bool sweep_trees(const InverseArguments& of, Workspace::Impl& ws, InverseDerivatives& d);
  void add_closure_rows(const Model& model, const SimulationOptions& options,
                        const Workspace::Impl& ws, InverseDerivatives& d);

  std::optional<Displacing> displacing_;  ///< none: a step, or its impulses
  TreeSweep sweep_;
  VelocityTerms velocity_terms_;
  ClosureDerivator closures_;
  ContactMotionFinder motions_;
  SlipResponse slips_;
  ForceResponses forces_;
  MovingPatch patch_;
  VectorX v_;             ///< nv: what velocity-dependent forces are taken at
  VectorX acceleration_;  ///< nv
};

}  // namespace counterpoint
