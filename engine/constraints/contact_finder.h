// The contacts of a step: every candidate of the search becomes a constraint with rows, a parked
// contact, or part of a far pair (parked_contacts.h).
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "counterpoint/engine/constraints/bounce.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/constraints/contact_search.h"
#include "counterpoint/engine/constraints/friction_slip.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

/// Finds the contacts of a model and their laws. Holds scratch memory: use one per thread.
class ContactFinder {
 public:
  /// inverse_mass: per body [1/kg], as in ContactSearch.
  ContactFinder(const Model& model, std::vector<double> inverse_mass);

  /// Adds the contacts that may act within the step to `out`, with their laws, and their effects to
  /// `counts`. Requires poses and velocities; depends on (q, v) alone.
  void find(const StepContext& at, const Kinematics& data, SleepMask idle, ConstraintSet& out,
            EffectCounts& counts);
  /// Makes those contacts in `out` inactive that stay open at the velocity at the start and had no
  /// force in the last step, whose forces are `memory`: none where the options make laws smooth.
  /// Same requirements as find(); not for softened laws.
  void set_inactive(const StepContext& at, const Kinematics& data,
                    const std::vector<RememberedForce>& memory, ConstraintSet& out) const;
  /// Gives rows to all inactive contacts. Returns false if there were none.
  static bool activate_all(ConstraintSet& out);
  /// Gives rows to the parked and inactive contacts that the end velocity w reaches. Returns false
  /// if none was added. Requires the poses of find(). ahead: parked contacts count as reached if
  /// they would be at w after this many steps [-].
  bool find_reached(const StepContext& at, const Reached& w, const Kinematics& data,
                    ConstraintSet& out, double ahead = 1.0);
  /// Gives rows to all parked contacts, including those of far pairs, and to the inactive ones.
  /// Same requirements as find().
  void unpark_all(const StepContext& at, const Kinematics& data, ConstraintSet& out);
  /// Forgets the last find(): there are no contacts.
  void forget();

  /// A contact that may bounce: its gap [m], and its present velocity in its rows [m/s].
  struct Bouncing {
    const Material& surface;
    const PairConstraint& contact;
    double gap;
    const Vector3& v;
  };
  /// Finds the bounce of a contact in this step; `data` holds V_WB. Wedged trees do not bounce: a
  /// body held from several sides would gain energy under Newton's law of impact. Valid for the
  /// last find().
  Bounce find_bounce(const Model& model, const SimulationOptions& options, EffectSet effects,
                     const Kinematics& data, const Bouncing& what) const;
  /// Whether a body of the contact's trees penetrates another one by more than the margin. Valid
  /// for the last find().
  bool is_wedged(const PairConstraint& contact) const {
    return wedged_[contact.body_a] || wedged_[contact.body_b];
  }
  /// Relative free-fall acceleration that the bounce assumes, in W [m/s^2].
  Vector3 relative_fall(EffectSet effects, const PairConstraint& contact) const;

  const ContactSearch& search() const { return search_; }

 private:
  bool stays_open(const PairConstraint& contact, double h, const std::vector<Motion>& V,
                  const Kinematics& data) const;
  void find_crowds(const StepContext& at, const std::vector<collision::Candidate>& candidates);
  const Material& material_of(const Model& model, EffectSet effects,
                              const collision::Candidate& candidate);
  void move_to_meeting(const Model& model, collision::Candidate& candidate) const;
  ParkedContact describe(const StepContext& at, const Kinematics& data,
                         const collision::Candidate& candidate);
  Vector3 make_contact(const StepContext& at, const Kinematics& data, const ParkedContact& open,
                       PairConstraint& contact);
  void give_rows(const StepContext& at, const ParkedContact& parked, PairConstraint& contact,
                 ConstraintSet& out);
  void park_contacts_of(const StepContext& at, const FarPair& far, const Kinematics& data);
  void merge_parked(ConstraintSet& out);
  double turning_advance(const Vector3& n, const Vector3& arm, double h, int body,
                         const Kinematics& data);
  double gap_less_turning(const PairConstraint& contact, double gap, double h,
                          const Kinematics& data);

  ContactSearch search_;
  /// Per body: some body of its tree penetrates another one by more than the contact margin.
  std::vector<char> wedged_;
  std::vector<int> crowd_;     ///< per body: contacts that its tree may close in the step
  std::vector<Vector3> fall_;  ///< free_fall(model) [m/s^2]
  std::vector<double> speed_;  ///< initial sliding speed of each contact with rows [m/s]
  FrictionSlip friction_slip_;
  std::array<LawOptions, 2> law_options_;    ///< for the step's contacts, and for wedged ones
  std::vector<ParkedContact> newly_parked_;  ///< contacts of far pairs that w may reach
  std::vector<Motion> V_;                    ///< body velocities at the end of a step
  std::pair<int, int> material_of_{-1, -1};  ///< pair of geometries that has material_
  Material material_;
  /// Rotation of each body within the step at its present velocity, valid where turn_known_.
  std::vector<Quaternion> turn_;
  std::vector<char> turn_known_;
  std::vector<double> tree_mass_;  ///< per body: mass of its tree [kg]
};

}  // namespace counterpoint
