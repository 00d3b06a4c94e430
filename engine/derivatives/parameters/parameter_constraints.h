// Derivatives of the constraints' part of an inverse step by its parameters.
#pragma once

#include "counterpoint/engine/derivatives/constraints/contact_motion.h"
#include "counterpoint/engine/derivatives/parameters/law_change.h"
#include "counterpoint/engine/derivatives/parameters/prepared_parameter.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

class ParameterConstraints {
 public:
  /// Adds what one parameter makes of -J' f / h of all contacts to du (nv), after step_inverse.
  /// False where it is not known how a contact moves with it.
  bool add_contacts(const PreparedParameter& p, const Model& model,
                    const SimulationOptions& options, EffectSet effects, Workspace::Impl& ws,
                    VectorOut du);
  /// Of all rows on joint coordinates.
  static void add_joint_rows(const PreparedParameter& p, const SimulationOptions& options,
                             const VectorRef& v_next, const Workspace::Impl& ws, VectorOut du);
  static void add_first_friction(const PreparedParameter& p, const Model& model,
                                 const SimulationOptions& options, const VectorRef& v_next,
                                 const Workspace::Impl& ws, VectorOut du);

 private:
  /// How a place of contact goes with a parameter, in W; the frame turns by `turn`.
  struct PlaceChange {
    Vector3 place = Vector3::Zero(), turn = Vector3::Zero();
    double gap = 0.0;
  };
  /// What a contact is made from.
  struct Source {
    Material surface;
    double alpha = 0.0, gap = 0.0;
  };
  bool find_place(const PreparedParameter& p, const Model& model,
                  const collision::Candidate& contact, double h, const Workspace::Impl& ws,
                  PlaceChange& out);
  bool find_slip(const PreparedParameter& p, const Model& model, const SimulationOptions& options,
                 const PairConstraint& pair, const Workspace::Impl& ws, double& out);
  static void add_contact(const Model& model,
                          const SimulationOptions& options,  // Parameters: all it depends on
                          EffectSet effects, const PairConstraint& pair, const Source& source,
                          const LawSource& change, const PlaceChange& place, Workspace::Impl& ws,
                          VectorOut du);

  ContactMotionFinder motions_;
};

}  // namespace counterpoint
