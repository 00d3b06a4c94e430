// Forces on bodies and between two bodies, with their derivatives: collected here, then carried to
// the joints by a sweep (sweep.h).
#pragma once

#include <vector>

#include "counterpoint/engine/derivatives/constraints/pair_response.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"

namespace counterpoint {

/// Returns the response of a force that keeps its world axes and acts at a body-fixed point, as a
/// PairResponse of B against a world at rest.
PairResponse body_force(const Force& force);

class ForceResponses {
 public:
  explicit ForceResponses(const Model& model);

  /// Forgets all forces.
  void begin();
  /// Adds a force that is carried along with its body, at the body's origin in world axes.
  void add_load(int body, const Force& force) { load_[body] += force; }
  /// Adds `force` on a body at a place in W; `response` is that of minus the force, at that place.
  void add_force(const Model& model, int body, const Vector3& place, const Force& force,
                 BodyResponse response, const Kinematics& data);
  /// Adds a force on a body, as a PairResponse (body_force, drag); V_next, V_start: velocities of
  /// the body at the place.
  void add_body_force(const Model& model, int body, const Vector3& place,
                      const PairResponse& response, const Motion& V_next, const Motion& V_start,
                      const Kinematics& data);
  /// Adds the impulse of a constraint divided by h [s].
  void add_pair(const Model& model, const PairConstraint& pair, const PairBodies& bodies,
                const PairResponse& response, double h, const Kinematics& data);
  /// Adds the change of minus the forces on some bodies with a speed that depends on the motion of
  /// two bodies, of which one may be the world.
  void add_by_speed(std::span<const ForceBySpeed> forces, const SpeedByMotion& a,
                    const SpeedByMotion& b);

  /// Points `in` to these forces. The caller sets in.v_start and in.v_next.
  void put_into(SweepInput& in) const;
  /// Adds the couplings of two bodies along their paths. Call it after `sweep` has run with this
  /// input over the trees of these bodies.
  void add_couplings(const Model& model, const SweepInput& in, TreeSweep& sweep,
                     const SweepOutput& out) const;

 private:
  /// A force on one body that changes with the motion of another.
  struct Coupling {
    int body, by;
    BodyResponse response;  ///< rows at the reference of `body`'s tree, columns at that of `by`'s
  };

  struct Speed {
    size_t begin, end;  ///< range in speed_forces_
    SpeedByMotion motions[2];
    int count;
  };

  void add_inner(const Model& model, const PairConstraint& pair, const PairBodies& bodies,
                 const PairResponse& response, double h, const Kinematics& data);
  void couple(const Model& model, const PairConstraint& pair, int body, int by,
              BodyResponse response, const Kinematics& data);

  std::vector<Force> load_;  ///< per body
  std::vector<BodyResponse> response_;
  std::vector<char> responds_;
  std::vector<Coupling> couplings_;
  std::vector<InnerPair> inner_;
  std::vector<ForceBySpeed> speed_forces_;
  std::vector<Speed> speeds_;
  bool by_v_ = false;
};

}  // namespace counterpoint
