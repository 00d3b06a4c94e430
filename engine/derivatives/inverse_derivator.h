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

#include "counterpoint/engine/derivatives/pair_response.h"
#include "counterpoint/engine/derivatives/slip_response.h"
#include "counterpoint/engine/derivatives/sweep.h"
#include "counterpoint/engine/derivatives/velocity_terms.h"
#include "counterpoint/engine/step_derivatives.h"
#include "counterpoint/engine/step_workspace.h"

namespace counterpoint {

class InverseDerivator {
 public:
  explicit InverseDerivator(const Model& model);

  /// After step_inverse with these arguments and `ws`. du/dv+ is always found; false if du/dq and
  /// du/dv are not: what acts is not known here in closed form.
  bool compute(const Model& model, const SimulationOptions& options, EffectSet effects,
               const VectorRef& q, const VectorRef& v, const VectorRef& v_next, const Input& known,
               Workspace::Impl& ws, InverseDerivatives& d);

 private:
  /// A force of one body that changes with another's motion.
  struct Coupling {
    int body, by;
    BodyResponse response;  ///< rows at the reference of `body`'s tree, columns at that of `by`'s
  };

  void begin(const Model& model);
  void add_force(const Model& model, int body, const Vector3& place, const Force& force,
                 BodyResponse response, const Data& data);
  void add_wrenches(const Model& model, const Input& known, const Data& data);
  void add_drag(const Model& model, const std::vector<Motion>& V_next, const Data& data);
  bool add_contacts(const Model& model, const SimulationOptions& options, EffectSet effects,
                    Workspace::Impl& ws);
  bool contact_response(const Model& model, const SimulationOptions& options, EffectSet effects,
                        size_t contact, const PairBodies& bodies, Workspace::Impl& ws,
                        PairResponse& out);
  void add_pair(const Model& model, const PairConstraint& pair, const PairBodies& bodies,
                const PairResponse& response, double h, const Data& data);
  void add_inner(const Model& model, const PairConstraint& pair, const PairBodies& bodies,
                 const PairResponse& response, double h, const Data& data);
  bool add_slip(const Model& model, Workspace::Impl& ws, double share);
  void couple(const Model& model, const PairConstraint& pair, int body, int by,
              BodyResponse response, const Data& data);
  void set_velocities(const Model& model, const VectorRef& v, const VectorRef& v_next, double h,
                      const Workspace::Impl& ws);
  bool sweep_trees(const Model& model, EffectSet effects, double h, const VectorRef& q,
                   const VectorRef& v, const VectorRef& v_next, Workspace::Impl& ws,
                   InverseDerivatives& d);
  void add_flyers(const Model& model, double h, const VectorRef& v, const Vector3& gravity,
                  const Workspace::Impl& ws, InverseDerivatives& d) const;

  TreeSweep sweep_;
  VelocityTerms velocity_terms_;
  ContactMotionFinder motions_;
  SlipResponse slips_;
  std::vector<Force> load_;  ///< by body
  std::vector<BodyResponse> response_;
  std::vector<char> responds_;
  std::vector<Coupling> couplings_;
  std::vector<InnerPair> inner_;
  bool by_v_ = false;
  VectorX v_;             ///< nv: what velocity-dependent forces are taken at
  VectorX acceleration_;  ///< nv
};

}  // namespace counterpoint
