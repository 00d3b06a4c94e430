// The constraints of one step as they follow from (q, w): contacts, joint limits, mimic joints.
#pragma once

#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/data.h"
#include "counterpoint/engine/inverse_weights.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// A contact with its law. Rows: velocity of B relative to A along n, t1, t2, then relative angular
/// velocity about n, t1, t2.
struct ContactConstraint {
  collision::Candidate candidate;
  int body_a = 0, body_b = 0;
  Matrix3 frame;  ///< columns n, t1, t2 in W
  contact::Law law;
};

/// One row on joint coordinates: y = coefficient[0] w[v_index[0]] + coefficient[1] w[v_index[1]] +
/// b.
struct JointConstraint {
  contact::Law law;
  int v_index[2] = {-1, -1};  ///< the second is -1 for a limit
  double coefficient[2] = {1.0, 0.0};
};

struct ConstraintSet {
  std::vector<ContactConstraint> contacts;
  std::vector<JointConstraint> joints;
  double max_penetration = 0.0;  ///< [m]

  bool empty() const { return contacts.empty() && joints.empty(); }
};

/// Finds the constraints of a model. Scratch memory inside: one per thread.
class ConstraintFinder {
 public:
  ConstraintFinder(const Model& model, InverseWeights weights);

  /// Everything which may push within the step, judged from (q, v) alone: the inverse must come to
  /// the same set. Needs compute_poses and compute_velocities.
  void find(const Model& model, const SimulationOptions& options, const VectorRef& q,
            const VectorRef& v, const Data& data, ConstraintSet& out);

  const InverseWeights& weights() const { return weights_; }
  const collision::Collider& collider() const { return collider_; }

 private:
  void find_candidates(const Model& model, const SimulationOptions& options, const Data& data);
  bool spread_travel(const Model& model, double threshold);
  void find_contacts(const Model& model, const SimulationOptions& options, const Data& data,
                     ConstraintSet& out);

  InverseWeights weights_;
  std::vector<double> contact_weight_;  ///< inverse mass a contact on each body feels [1/kg]
  collision::Collider collider_;
  std::vector<double> radius_;  ///< of each body's geometry about the body origin [m]
  std::vector<double> travel_;  ///< of each body's surface within the step [m]
  std::vector<double> margin_;
  std::vector<collision::Candidate> candidates_;
};

/// Velocity of B relative to A at a contact, in its frame (rows as in ContactConstraint), from the
/// bodies' V_WB (data.h).
contact::Rows contact_velocity(const ContactConstraint& contact, const Data& data,
                               const std::vector<Motion>& V);

}  // namespace counterpoint
