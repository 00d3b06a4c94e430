// Derivatives of the contact forces on chosen bodies by the motion of all coordinates. The
// responses of contacts are collected as they are found, then multiplied by the columns of a sweep
// (sweep.h).
#pragma once

#include <span>
#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/constraints/pair_response.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"

namespace counterpoint {

class ContactForceRows {
 public:
  /// Forgets all contacts, and chooses the bodies.
  void begin(const ContactForceDerivatives& wanted);
  /// Adds the impulse of a contact divided by h [s].
  void add_pair(const Model& model, const PairConstraint& pair, const PairBodies& bodies,
                const PairResponse& response, double h, const Kinematics& data);
  /// Adds the change of forces with a speed, as ForceResponses::add_by_speed.
  void add_by_speed(std::span<const ForceBySpeed> forces, const SpeedByMotion& a,
                    const SpeedByMotion& b);
  /// Writes the derivatives of the chosen bodies' forces. Call it after `sweep` has run with this
  /// input over all trees.
  void write(const Model& model, const SweepInput& in, TreeSweep& sweep,
             ContactForceDerivatives& out) const;

 private:
  void add(const ForceByMotion& change);

  std::vector<int> bodies_;
  std::vector<ForceByMotion> changes_;
};

}  // namespace counterpoint
