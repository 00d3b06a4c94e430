// One backward sweep over a tree that gives all derivatives of its inverse dynamics.
//
// All vectors are in world axes at one point of reference, the root's origin, so that the columns
// of all joints on a path can be combined without shifting them. With the velocity and acceleration
// V, A of the parent (of the world: 0, -g), the velocity V_B of the body, and S a column of its
// joint,
//
//   P = V x S,     PP = A x S + V x P,     S' = V_B x S         (x: the cross product of motions)
//
// Everything that a joint carries is a composite body with inertia I, force f, and the operator 2 B
// of Coriolis forces on a motion m,  2 B m = sum 2 mu (r x (alpha x v), alpha x v)  over its
// particles of mass mu at r with velocities v. 2 B m is linear in the angular part alpha of m
// alone: it is given by a 3x3 matrix N and the momentum p. For i carried by j, or of the same joint
// (Singh, Russell, Wensing 2022, eqs. 38-43, rewritten):
//
//   dtau_i/dq_j = S_i'(2 B P_j + I PP_j)             dtau_i/dv_j = S_i'(2 B S_j + I (P_j + S'_j))
//   dtau_j/dq_i = S_j'(2 B P_i + I PP_i + S_i x* f)  dtau_j/dv_i = S_j'(2 B S_i + I (P_i + S'_i))
//   M_ij = S_i' I S_j
//
// This holds for a force f that is carried along with the body. Forces that are not, like contacts
// or wrenches in world axes, add a response (BodyResponse), which is summed over composites too.
//
// Translations of planar and floating joints, along axes of the parent, are treated as a separate
// joint before the rotation.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Returns (angular, linear).
inline Vector6 stacked(const Motion& m) {
  Vector6 s;
  s << m.angular, m.linear;
  return s;
}

/// Derivative of a force on a body by the body's motion, beyond being carried along: 6x6 over
/// (angular, linear), in world axes at one point, the reference of its tree.
struct BodyResponse {
  Matrix6 q = Matrix6::Zero();     ///< derivative by a displacement [rad, m] of the body
  Matrix6 next = Matrix6::Zero();  ///< derivative by its velocity at the end of the step
  Matrix6 v = Matrix6::Zero();     ///< derivative by its velocity at the start

  BodyResponse& operator+=(const BodyResponse& o) {
    q += o.q;
    next += o.next;
    v += o.v;
    return *this;
  }
  /// Moves the point of reference; the old one is at p [m] as seen from the new one.
  void move(const Vector3& p);
};

/// Derivatives of impulses between two bodies of one tree, in world axes at its reference. The
/// joints that carry both bodies do not feel these impulses.
struct InnerPair {
  int body_a = 0, body_b = 0;
  bool by_v = false;
  /// Matrices of PairResponse (pair_response.h); `carried` is carried(wrench).
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

/// Forces on bodies that change with a scalar speed, and that speed as a function of the motion of
/// bodies: each at the reference of its body's tree.
struct ForceBySpeed {
  int body;
  Vector6 force;  ///< derivative of minus the force by the speed
};
struct SpeedByMotion {
  int body;
  Vector6 q, v;  ///< gradient of the speed: displacement, velocity at the start
};

/// Derivatives of a force by the motion of a body, 3 x 6 each, at the reference of that body's
/// tree.
struct ForceByMotion {
  using Rows = Eigen::Matrix<double, 3, 6>;
  int row = 0;  ///< first row in the output
  int by = 0;
  Rows q, next, v;  ///< matrices with the meaning of BodyResponse
};

/// Arguments of a sweep, which differentiates tau = M a + n(q, v) - loads. Gravity in n is that on
/// the weight which is not carried (gravity_compensation.h).
struct SweepInput {
  const double* v = nullptr;  ///< nv
  const double* a = nullptr;  ///< nv
  Vector3 gravity = Vector3::Zero();
  /// Force on each body, at its origin in world axes; may be null.
  const Force* load = nullptr;
  /// Response of minus the force on each body, at the tree's reference; null: forces are carried
  /// along.
  const BodyResponse* response = nullptr;
  const char* responds = nullptr;   ///< per body: whether it has a response
  bool responds_to_v = false;       ///< some response has a derivative by the velocity at the start
  const double* v_start = nullptr;  ///< nv, needed if responds_to_v
  const double* v_next = nullptr;   ///< nv, needed if there are responses
  /// Factor of the velocity-dependent part of dtau/dv, for callers that scaled v by it.
  double velocity_factor = 1.0;
  /// M times mass_in_next is added to dnext, M times mass_in_v to dv.
  double mass_in_next = 1.0, mass_in_v = 0.0;
};

/// Results, nv x nv each. Only the entries of the tree that is swept are written.
struct SweepOutput {
  MatrixX &dq, &dv, &dnext;
};

class TreeSweep {
 public:
  explicit TreeSweep(const Model& model);

  /// Computes the derivatives of a tree's joint forces. Needs compute_poses, compute_inertias.
  /// Entries of coordinates on different branches are set to zero.
  void run(const Model& model, const Tree& tree, const Kinematics& data, const SweepInput& in,
           SweepOutput out);

  /// Adds the derivative of a force on body `body` by the motion of body `by`. Both trees must have
  /// been swept with responses. The response has its rows at the reference of body's tree, its
  /// columns at that of by's tree.
  void add_coupling(const Model& model, int body, int by, const BodyResponse& response,
                    SweepOutput out) const;

  /// Adds the change of forces with a speed: the outer product of the forces along all coordinates
  /// that carry their bodies and of the gradient of the speed.
  void add_by_speed(const Model& model, std::span<const ForceBySpeed> forces,
                    std::span<const SpeedByMotion> motions, SweepOutput out);

  /// Adds the derivatives of a force to three rows of `out`, 3 n x nv here. Needs columns as
  /// add_coupling.
  void add_force_rows(const Model& model, const ForceByMotion& force, SweepOutput out) const;

  /// Computes the columns P_next and P_start of a tree for the velocities at the end and the start
  /// of the step (nv). add_coupling and add_inner_pair need them; `run` computes them for trees
  /// with responses.
  void find_response_columns(const Model& model, const Tree& tree, const SweepInput& in);
  /// Adds the contribution of an inner pair's impulse W to the derivatives of -J'W.
  void add_inner_pair(const Model& model, const InnerPair& pair, SweepOutput out);

  /// Returns the point of reference of a tree, in W [m].
  static const Vector3& reference(const Tree& tree, const Kinematics& data) {
    return data.X_WB[tree.body_begin].translation;
  }

 private:
  struct Column {
    Motion S, D, P, PP;      ///< D = P + S'
    Motion P_next, P_start;  ///< P with the velocities at the end and at the start
    int group = 0;           ///< first coordinate of its translation or rotation
  };
  /// Sums over a body and, once its children are added, over everything it carries.
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
                     const Kinematics& data, const SweepInput& in, Moving& moving);
  /// Adds carried weight (gravity_compensation.h), a load in fixed axes. Returns whether there is
  /// any.
  bool add_carried_weight(const Model& model, const Tree& tree, const Kinematics& data,
                          const Vector3& gravity);
  void set_composite(int i, const Vector3& origin, const Kinematics& data, const SweepInput& in);
  void find_columns(const Model& model, const Tree& tree, const double* velocity,
                    Motion Column::*out);
  int list_columns(const Model& model, int body, int common, int* list) const;
  void enter(const Model& model, int i, const SweepInput& in, bool respond);
  void write_columns(const Model& model, int i, const SweepInput& in, SweepOutput& out);
  void write_column(int k, int group_begin, int group_end, const Composite& whole,
                    const BodyResponse* response, const SweepInput& in, SweepOutput& out);

  std::vector<Column> columns_;          ///< nv
  std::vector<Composite> composites_;    ///< per body
  std::vector<Moving> moving_;           ///< per body
  std::vector<BodyResponse> responses_;  ///< per body: composites
  std::vector<char> responds_;           ///< per body
  std::vector<int> first_slot_;  ///< per body: number of coordinates of its ancestors' joints
  // Columns on the path to one body, component after component, for lanes of four columns.
  int stride_ = 0;
  std::vector<double> path_;
  std::vector<int> path_column_;  ///< coordinate in v
  std::vector<int> path_body_;    ///< the body that has the slot
  std::vector<double> products_;
  std::vector<int> own_;       ///< coordinates of two paths
  std::vector<int> rows_;      ///< coordinates that carry any of several bodies
  std::vector<char> carries_;  ///< per coordinate: whether it is in rows_
  std::vector<double> along_;  ///< per coordinate: the force along it
};

}  // namespace counterpoint
