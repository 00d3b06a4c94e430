// Derivatives of the constraint forces of an inverse step by its parameters.
#pragma once

#include "counterpoint/engine/derivatives/constraints/contact_motion.h"
#include "counterpoint/engine/derivatives/inverted_step.h"
#include "counterpoint/engine/derivatives/parameters/law_change.h"
#include "counterpoint/engine/derivatives/parameters/prepared_parameter.h"

namespace counterpoint {

class ParameterConstraints {
 public:
  /// Adds the derivative of -J' f / h of all contacts by one parameter to du (nv), after
  /// step_inverse. Returns false if the change of a contact with the parameter has no closed form.
  bool add_contacts(const PreparedParameter& p, const Model& model,
                    const SimulationOptions& options, EffectSet effects,
                    const InvertedStep& inverted, VectorOut du);
  /// Adds the same of all rows on joint coordinates; add_first_friction: of dry friction at
  /// coordinates that have none yet.
  static void add_joint_rows(const PreparedParameter& p, const InverseArguments& of,
                             const InvertedStep& inverted, VectorOut du);
  static void add_first_friction(const PreparedParameter& p, const InverseArguments& of,
                                 const InvertedStep& inverted, VectorOut du);

 private:
  /// Derivatives of a contact's place, in W, by a parameter; `turn`: rotation of its frame.
  struct PlaceChange {
    Vector3 place = Vector3::Zero(), turn = Vector3::Zero();
    double gap = 0.0;
  };
  /// Quantities that a contact's law is made from.
  struct Source {
    Material surface;
    double alpha = 0.0, gap = 0.0;
  };
  bool find_place(const PreparedParameter& p, const Model& model,
                  const collision::Candidate& contact, double h, const InvertedStep& inverted,
                  PlaceChange& out);
  bool find_slip(const PreparedParameter& p, const Model& model, const SimulationOptions& options,
                 const PairConstraint& pair, const InvertedStep& inverted, double& out);
  static void add_contact(const Model& model, const SimulationOptions& options, EffectSet effects,
                          const PairConstraint& pair, const Source& source, const LawSource& change,
                          const PlaceChange& place, const InvertedStep& inverted, VectorOut du);

  ContactMotionFinder motions_;
};

}  // namespace counterpoint
