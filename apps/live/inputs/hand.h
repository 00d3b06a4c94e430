// The hand of a page, which pulls a body by a spring or turns it (docs/reference/live.md, On the
// page).
#pragma once

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/state.h"

namespace counterpoint::live {

/// Returns the index of the frame of the link that each body's joint moves; -1 for the world.
std::vector<int> link_frames(const Model& model);

class Hand {
 public:
  /// The model must outlive the hand.
  explicit Hand(const Model& model);

  /// Pulls the point of a body, in its frame [m], towards `target` in W [m].
  void drag(int body, const Vector3& point, const Vector3& target);
  /// Turns a body by a torque in W [N m].
  void turn(int body, const Vector3& torque);
  void release() { body_ = 0; }

  int body() const { return body_; }  ///< held body; 0: none
  /// Frame of the link that the held body's joint moves, in which wrench() acts.
  int frame() const { return frame_[body_]; }
  bool turns() const { return turns_; }

  /// Computes the wrench for a step of h [s] from a state, and sets point() and force().
  void update(const State& state, double h);
  const Vector3& point() const { return point_W_; }  ///< held point in W [m]
  const Vector3& force() const { return force_; }    ///< force [N], or torque [N m], in W
  /// The wrench about the origin of frame(), in axes of W.
  const Force& wrench() const { return wrench_; }

 private:
  void hold(int body);
  double mobility(const State& state, const Vector3& arm);

  const Model& model_;
  Dynamics dynamics_;
  std::vector<int>
      frame_;  ///< index of the frame of the link that a body's joint moves, one per body
  int body_ = 0;
  bool turns_ = false;
  double mass_ = 0.0;                 ///< mass of the body's tree [kg]
  double mobility_ = 0.0;             ///< see mobility() [1/kg]
  int age_ = 0;                       ///< steps since mobility_ was computed
  Vector3 point_ = Vector3::Zero();   ///< held point in the body frame [m]
  Vector3 target_ = Vector3::Zero();  ///< in W [m], or the wanted torque [N m]
  Vector3 point_W_ = Vector3::Zero(), force_ = Vector3::Zero();
  Force wrench_;
  MatrixX jacobian_;
  VectorX zero_, rest_, push_, tau_;
};

}  // namespace counterpoint::live
