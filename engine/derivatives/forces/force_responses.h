// Forces on bodies and between two of them, with what they change by: gathered here, then carried
// to the joints by a sweep (sweep.h).
#pragma once

#include <vector>

#include "counterpoint/engine/derivatives/constraints/pair_response.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"

namespace counterpoint {

/// Of a force that a body carries at a point and that keeps its axes, which are those of W: as
/// PairResponse of B against a world that stays.
PairResponse body_force(const Force& force);

class ForceResponses {
 public:
  explicit ForceResponses(const Model& model);

  /// Forgets all forces.
  void begin();
  /// What a body carries as it is, at its origin in W's axes.
  void add_load(int body, const Force& force) { load_[body] += force; }
  /// `force` on a body at a place in W; the response is of minus it, there.
  void add_force(const Model& model, int body, const Vector3& place, const Force& force,
                 BodyResponse response, const Kinematics& data);
  /// `force` as body_force or a drag has it; V_next, V_start of the body at the place.
  void add_body_force(const Model& model, int body, const Vector3& place,
                      const PairResponse& response, const Motion& V_next, const Motion& V_start,
                      const Kinematics& data);  // Parameters: what it depends on, one by one
  /// The impulse of a constraint over h [s].
  void add_pair(const Model& model, const PairConstraint& pair, const PairBodies& bodies,
                const PairResponse& response, double h, const Kinematics& data);
  /// What minus the forces on some bodies change by, as a speed that two bodies have does. A body
  /// may be the world.
  void add_by_speed(std::span<const ForceBySpeed> forces, const SpeedByMotion& a,
                    const SpeedByMotion& b);

  /// Lets sweeps take these forces. `in` needs v_start, v_next besides.
  void put_into(SweepInput& in) const;
  /// After sweeps by `sweep` with that input over the trees of these bodies: what couples two
  /// bodies by their paths.
  void add_couplings(const Model& model, const SweepInput& in, TreeSweep& sweep,
                     const SweepOutput& out) const;

 private:
  /// A force of one body that changes with another's motion.
  struct Coupling {
    int body, by;
    BodyResponse response;  ///< rows at the reference of `body`'s tree, columns at that of `by`'s
  };

  struct Speed {
    size_t begin, end;  ///< of its forces
    SpeedByMotion motions[2];
    int count;
  };

  void add_inner(const Model& model, const PairConstraint& pair, const PairBodies& bodies,
                 const PairResponse& response, double h, const Kinematics& data);
  void couple(const Model& model, const PairConstraint& pair, int body, int by,
              BodyResponse response, const Kinematics& data);

  std::vector<Force> load_;  ///< by body
  std::vector<BodyResponse> response_;
  std::vector<char> responds_;
  std::vector<Coupling> couplings_;
  std::vector<InnerPair> inner_;
  std::vector<ForceBySpeed> speed_forces_;
  std::vector<Speed> speeds_;
  bool by_v_ = false;
};

}  // namespace counterpoint
