// The robots that algorithms are timed on, ours and Pinocchio's, and how their coordinates go
// together.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/model/scene.h"
#include "peers/pinocchio.h"
#include "tables.h"

namespace counterpoint::apps {

/// Gone through in turn: branches and sines differ from one to the next.
constexpr int kStates = 64;

/// Random coordinates, velocities and accelerations (or forces) in our order.
struct States {
  std::vector<VectorX> q, v, x;
};

States random_states(const Model& model);

/// The same robot in both engines, and how their coordinates go together: theirs are T ours, with
/// the linear velocity of a free base in axes of the body.
class Pair {
 public:
  /// Both must live as long. @throws std::runtime_error if the peer lacks a joint.
  Pair(const Model& model, peers::PinocchioRobot& peer);

  VectorX coordinates(const VectorX& q) const;
  /// T x, of velocities or forces; and back.
  VectorX mapped(const VectorX& q, const VectorX& x) const;
  VectorX mapped_back(const VectorX& q, const VectorX& x) const;
  /// Accelerations: the body's axes turn, theirs is the rate of change seen from them.
  VectorX mapped_acceleration(const VectorX& q, const VectorX& v, const VectorX& a) const;

  /// Gives the peer all states, x as accelerations or as forces.
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

/// Calls compare(model, load, label) for each robot whose URDF is below options.robots, where
/// load(convention) gives Pinocchio's. What is missing is skipped, and said.
using LoadPinocchio =
    std::function<std::unique_ptr<peers::PinocchioRobot>(peers::PinocchioConvention)>;
void for_each_robot(
    const char* table, const PeerOptions& options,
    const std::function<void(const Model&, const LoadPinocchio&, const std::string&)>& compare);

}  // namespace counterpoint::apps
