// One backward pass over a tree that gives all derivatives of its inverse dynamics.
//
// All in world axes at one point of reference, the root's origin, where the columns of all joints
// of a path can be compared without shifting them. With the parent's velocity and acceleration
// V, A (of the world -g), S a column of the joint,
//
//   P = V x S,     PP = A x S + V x P,     S' = V_B x S         (x: the cross product of motions)
//
// and of the composite of all that a joint carries: inertia I, force f, and 2 B, the Coriolis
// forces of a motion m,  2 B m = sum 2 mu (r x (alpha x v), alpha x v)  over its particles mu at r
// with velocities v, which is linear in m's angular part alpha: by a 3x3 matrix N and the momentum
// p. For i carried by j, or of the same joint (Singh, Russell, Wensing 2022, eqs. 38-43, in other
// words):
//
//   dtau_i/dq_j = S_i'(2 B P_j + I PP_j)             dtau_i/dv_j = S_i'(2 B S_j + I (P_j + S'_j))
//   dtau_j/dq_i = S_j'(2 B P_i + I PP_i + S_i x* f)  dtau_j/dv_i = S_j'(2 B S_i + I (P_i + S'_i))
//   M_ij = S_i' I S_j
//
// f counts as carried along by the body. Forces that do otherwise, of contacts or wrenches in world
// axes, have a response beside it (BodyResponse): composites as well.
//
// Translations of planar and floating joints, along axes of the parent, count as a joint of their
// own before the rotation.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// (angular, linear).
inline Vector6 stacked(const Motion& m) {
  Vector6 s;
  s << m.angular, m.linear;
  return s;
}

/// How a force on a body changes with the body's motion, beyond being carried along: 6x6 over
/// (angular, linear), in world axes at one point, which is its tree's reference.
struct BodyResponse {
  Matrix6 q = Matrix6::Zero();     ///< by a displacement [rad, m] of the body
  Matrix6 next = Matrix6::Zero();  ///< by its velocity at the end of the step
  Matrix6 v = Matrix6::Zero();     ///< by its velocity at the start

  BodyResponse& operator+=(const BodyResponse& o) {
    q += o.q;
    next += o.next;
    v += o.v;
    return *this;
  }
  /// The same seen from a point from which the one so far is at p [m].
  void move(const Vector3& p);
};

/// Impulses between two bodies of one tree, in world axes at its reference: what the joints that
/// carry both do not feel.
struct InnerPair {
  int body_a = 0, body_b = 0;
  bool by_v = false;
  /// As in PairResponse (pair_response.h), and carried(wrench).
  Matrix6 displaced, carried, next, v_a, v_b;

  InnerPair& operator+=(const InnerPair& o) {
    by_v = by_v || o.by_v;
    displaced += o.displaced;
    carried += o.carried;
    next += o.next;
    v_a += o.v_a;
    v_b += o.v_b;
    return *this;
  }
};

/// Forces on bodies that change with one speed, and that with the motion of bodies: each at the
/// reference of its body's tree.
struct ForceBySpeed {
  int body;
  Vector6 force;  ///< of minus the force
};
struct SpeedByMotion {
  int body;
  Vector6 q, v;  ///< by a displacement, by the velocity at the start
};

/// What a sweep differentiates: tau = M a + n(q, v) - loads, of the weight what is not carried.
struct SweepInput {
  const double* v = nullptr;  ///< nv
  const double* a = nullptr;  ///< nv
  Vector3 gravity = Vector3::Zero();
  /// By body: the force on it, at its origin in world axes; may be null.
  const Force* load = nullptr;
  /// By body: of minus these forces, at the tree's reference; null: they are carried along.
  const BodyResponse* response = nullptr;
  const char* responds = nullptr;   ///< by body: has a response
  bool responds_to_v = false;       ///< any of them by the velocity at the start
  const double* v_start = nullptr;  ///< nv, where responds_to_v
  const double* v_next = nullptr;   ///< nv, where there are responses
  /// Of velocity-dependent forces this share is taken of dtau/dv, as when v is scaled by it.
  double velocity_factor = 1.0;
  /// M is added to d_next times this and to dv times that.
  double mass_in_next = 1.0, mass_in_v = 0.0;
};

/// nv x nv each, entries of one tree written, the rest left.
struct SweepOutput {
  MatrixX &dq, &dv, &dnext;
};

class TreeSweep {
 public:
  explicit TreeSweep(const Model& model);

  /// The derivatives of a tree's joint forces. Needs compute_poses, compute_inertias. What no joint
  /// connects is set to zero.
  void run(const Model& model, const Tree& tree, const Kinematics& data, const SweepInput& in,
           SweepOutput out);

  /// Adds what a force on `body` changes by as `by` moves, both moved by the last runs with
  /// responses: rows at the reference of body's tree, columns at that of by's.
  void add_coupling(const Model& model, int body, int by, const BodyResponse& response,
                    SweepOutput out) const;

  /// Adds what forces change by with a speed: an outer product over the coordinates that carry
  /// either.
  void add_by_speed(const Model& model, std::span<const ForceBySpeed> forces,
                    std::span<const SpeedByMotion> motions, SweepOutput out);

  /// Fills the columns P of velocities at the end and the start of the step (nv) of a tree, which
  /// add_coupling and add_inner_pair need; `run` does for trees with responses.
  void find_response_columns(const Model& model, const Tree& tree, const SweepInput& in);
  /// Adds what an inner pair's impulse contributes to -J'W.
  void add_inner_pair(const Model& model, const InnerPair& pair, SweepOutput out);

  /// The point of reference of a tree, in W [m].
  static const Vector3& reference(const Tree& tree, const Kinematics& data) {
    return data.X_WB[tree.body_begin].translation;
  }

 private:
  struct Column {
    Motion S, D, P, PP;      ///< D = P + S'
    Motion P_next, P_start;  ///< P with the velocities that responses are by
    int group = 0;           ///< first coordinate of those carried along together
  };
  /// Of a body, then of all that it carries.
  struct Composite {
    RigidInertia I;
    Matrix3 N;
    Vector3 p;
    Force f;
  };
  struct Moving {
    Motion V, A;
  };

  void go_out(const Model& model, const Tree& tree, const Kinematics& data, const SweepInput& in);
  void add_translations(const Body& body, int first, int count, const Kinematics& data,
                        const SweepInput& in, Moving& moving);
  void add_rotations(const Body& body, int first, int count, const Vector3& origin,
                     const Kinematics& data, const SweepInput& in,
                     Moving& moving);  // Parameters: all it depends on
  /// Carried weight (gravity_compensation.h) as a load that keeps its axes. True if there is any.
  bool add_carried_weight(const Model& model, const Tree& tree, const Kinematics& data,
                          const Vector3& gravity);
  void set_composite(int i, const Vector3& origin, const Kinematics& data, const SweepInput& in);
  void find_columns(const Model& model, const Tree& tree, const double* velocity,
                    Motion Column::*out);
  int list_columns(const Model& model, int body, int common, int* list) const;
  void enter(const Model& model, int i, const SweepInput& in, bool respond);
  void write_columns(const Model& model, int i, const SweepInput& in, SweepOutput& out);
  void write_column(int k, int group_begin, int group_end,
                    const Composite& whole,  // Parameters: all it depends on
                    const BodyResponse* response, const SweepInput& in, SweepOutput& out);

  std::vector<Column> columns_;          ///< nv
  std::vector<Composite> composites_;    ///< by body
  std::vector<Moving> moving_;           ///< by body
  std::vector<BodyResponse> responses_;  ///< by body: composites
  std::vector<char> responds_;           ///< by body
  std::vector<int> first_slot_;          ///< by body: how many coordinates carry it
  // Of the path to one body: the columns' components one after the other, for four at a time.
  int stride_ = 0;
  std::vector<double> path_;
  std::vector<int> path_column_;  ///< coordinate in v
  std::vector<int> path_body_;    ///< whose column is in the slot
  std::vector<double> products_;
  std::vector<int> own_;       ///< coordinates of two paths
  std::vector<int> rows_;      ///< coordinates that carry any of some bodies
  std::vector<char> carries_;  ///< by coordinate: is one of them
  std::vector<double> along_;  ///< by coordinate: the force along it
};

}  // namespace counterpoint
