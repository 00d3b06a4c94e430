// Robots that algorithms are timed on, in our model and in Pinocchio's, and the map between their
// coordinates.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/model/scene.h"
#include "peers/pinocchio.h"
#include "tables.h"

namespace counterpoint::apps {

/// States used in turn, so that branches and sines differ from one evaluation to the next.
constexpr int kStates = 64;

/// Random coordinates, velocities and accelerations (or forces) in our order.
struct States {
  std::vector<VectorX> q, v, x;
};

States random_states(const Model& model);

/// Calls evaluate(i) for states taken in turn.
template <class Evaluate>
void run_in_turn(int evaluations, const Evaluate& evaluate) {
  for (int k = 0; k < evaluations; ++k) evaluate(static_cast<std::size_t>(k % kStates));
}

/// The same robot in both engines, and the map between their coordinates: theirs are T ours, with
/// the linear velocity of a free base in the body-fixed frame.
class Pair {
 public:
  /// Both must outlive it. @throws std::runtime_error if the peer lacks a joint.
  Pair(const Model& model, peers::PinocchioRobot& peer);

  VectorX coordinates(const VectorX& q) const;
  /// T x for velocities or forces, and its inverse.
  VectorX mapped(const VectorX& q, const VectorX& x) const;
  VectorX mapped_back(const VectorX& q, const VectorX& x) const;
  /// Accelerations in Pinocchio's sense: the rate of change seen from the rotating body-fixed
  /// frame.
  VectorX mapped_acceleration(const VectorX& q, const VectorX& v, const VectorX& a) const;

  /// Passes all states to the peer, with x as accelerations or as forces.
  void set_states(const States& states, bool accelerations);

  const peers::PinocchioJoint& joint(int i) const {
    return joints_[static_cast<std::size_t>(i) - 1];
  }
  bool floating(int i) const { return model_.body(i).joint_type == JointType::kFloating; }

 private:
  Matrix3 turn(int i, const VectorX& q) const;

  const Model& model_;
  peers::PinocchioRobot& peer_;
  std::vector<peers::PinocchioJoint> joints_;
};

/// Calls compare(model, load, label) for each robot whose URDF is below options.robots;
/// load(convention) returns Pinocchio's model. Missing robots are skipped with a message.
using LoadPinocchio =
    std::function<std::unique_ptr<peers::PinocchioRobot>(peers::PinocchioConvention)>;
void for_each_robot(
    const char* table, const PeerOptions& options,
    const std::function<void(const Model&, const LoadPinocchio&, const std::string&)>& compare);

}  // namespace counterpoint::apps
