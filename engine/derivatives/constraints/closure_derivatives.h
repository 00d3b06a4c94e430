// Derivatives of the biases of a closure's rows (closures.h) by the motion.
//
// With e the error of the closure, c its acceleration at constant joint velocities, y = J w, r(e)
// the speed of recovery, and s the share of the bias that is aimed, that is taken at the pose that
// w leads to, the bias is
//
//   b = r(e) + (1 - s) h c / 2 + s ((e(q (+) h w) - e(q)) / h - y)
//
// Let a joint have the column S (world axes), its parent body velocity V and acceleration A, and
// let P = V x S, PP = A x S + V x P (sweep.h). A point p on a body that the joint carries, with
// velocity u and acceleration a, has the derivatives
//
//   dp/dq = S_p      du/dq = S_o x u + P_p      da/dq = S_o x a + 2 P_o x u + PP_p
//                    du/dv = S_p                da/dv = 2 S_o x u + (P + S')_p
//
// where X_p is the linear part of a motion X at p, X_o its angular part.
//
// Rows in A's anchor frame hold components of a vector r that is seen from there: from A's anchor
// to B's, or the z axis of B's frame, of which the error is z_A x r. All derivatives of r and of
// its acceleration (acceleration_seen) are taken in axes carried along with A, and those at the
// pose reached in A's axes there. Springs scale b by error_share, have no limit of the speed r(e),
// and are not aimed. Screws have no derivatives here.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/derivatives/constraints/contact_motion.h"

namespace counterpoint {

/// Differentiates closure biases. Scratch memory inside: one object per thread and model.
class ClosureDerivator {
 public:
  using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  explicit ClosureDerivator(const Model& model);

  /// Sets the state: poses in `data`, and v (nv).
  void begin(const Model& model, const Kinematics& data, const VectorRef& v);
  /// Sets the velocities w (nv) that biases are aimed with, in a step of h [s] from q (nq).
  void aim(const Model& model, double h, const VectorRef& q, const VectorRef& w);

  /// Computes the results below for rows of find_closures, aimed or not. Needs begin, and aim if
  /// `aimed`.
  void compute(const Model& model, const ContactOptions& options, double h,
               const ActingClosure& acting, const PairConstraint& pair, const Kinematics& data,
               bool aimed);
  /// Whether compute knows the derivatives of the rows of a pair.
  static bool knows(const PairConstraint& pair) { return pair.error != ClosureError::kThread; }

  /// Adds scale jacobian' slopes to `out` (nv x nv); slopes: one of the derivatives below.
  void add_to(MatrixX& out, double scale, const Columns& slopes) const;

  // Results: a column for each coordinate that carries a body of the closure, the first `size`
  // columns; the closure's rows come first.
  int size = 0;
  std::vector<int> coordinates;  ///< index in v
  Columns jacobian;
  /// Derivatives of the bias, in axes carried along with body A: by a displacement, by v, by w.
  Columns by_q, by_v, by_w;
  Vector3 bias;  ///< in the rows of the pair

 private:
  struct Column {
    Motion S, P, PP, D, P_w;  ///< at the tree's reference; D = P + S', P_w is P with w
  };
  struct Moving {
    Motion V, A, W;  ///< motion of the body at the tree's reference; W: velocity with w
  };
  /// One body of the closure, with its anchor and the place of the rows relative to the tree's
  /// reference.
  struct Side {
    int body = 0;
    double sign = 1.0;
    Vector3 anchor = Vector3::Zero(), place = Vector3::Zero();
    Moving moving;
    Vector3 u = Vector3::Zero(), a = Vector3::Zero();  ///< velocity, acceleration of the anchor
  };
  /// Error as a vector; for a distance the vector between the anchors, for axes that of B.
  struct Error {
    Vector3 apart;
    Matrix3 of_b, of_a;  ///< kTurn and kAxis: derivatives by rotations of the bodies
    Matrix3 R_WA;        ///< axes of A's anchor frame
  };
  /// Error, its acceleration, the error at the pose reached and y, in W.
  struct Motions {
    Vector3 e, c, e_reached, y;
  };

  /// Calls visit(body, coordinate) for every coordinate from a body to the root.
  template <class Visit>
  static void for_each_on_path(const Model& model, int leaf, Visit visit) {
    for (int i = leaf; i != 0; i = model.body(i).parent) {
      const int first = model.body(i).v_index;
      for (int k = first; k < first + joint_nv(model.body(i).joint_type); ++k) visit(i, k);
    }
  }

  Side side(const Model& model, int body, double sign, const Pose& X_BC, const Vector3& place,
            const Kinematics& data) const;
  static Error error(const Closure& closure, const Pose& X_BC, const PairConstraint& pair,
                     const Kinematics& data);
  void list(const Model& model, const PairConstraint& pair);
  void add_turns(const Model& model, const Side& side, const Error& error);
  void add_points(const Model& model, const Side& side, const Vector3& spin, double share);
  void add_axis(const Model& model, const Side& b, const Vector3& z);
  void add_reached(const Model& model, const Side& side, const Pose& X_BC, bool turns,
                   const Error& error);
  void add_carrier(const Model& model, const Side& a);
  void project(double h, bool bend, const Vector3& parting, const Motions& m);
  void take_distance(const Closure& closure, const PairConstraint& pair, double h,
                     const Vector3& parting, Motions& m);
  void see_from_a(const PairConstraint& pair, const Side& a, const Vector3& u, const Error& here,
                  const Error& there, Motions& m);
  void turn_with_a(const Side& a, const Vector3& spin, Motions& m);
  void keep_rows(const PairConstraint& pair, Motions& m);
  Motions find_motions(const Model& model, double h, const ActingClosure& acting,
                       const PairConstraint& pair, const Kinematics& data, bool aimed);
  void add_share_slope(const Model& model, double slope, int body, const Vector3& by_share);
  int fastest(const Model& model, const PairConstraint& pair, double& speed) const;

  std::vector<char> held_;  ///< per tree: whether a closure acts on it
  std::vector<Column> columns_;
  std::vector<Moving> moving_;
  std::optional<Data> reached_;  ///< poses that w leads to; set if there are closures
  VectorX q_reached_, turn_;
  std::vector<int> slot_;  ///< per coordinate: its column, or -1
  // Derivatives, one column per slot: error, its rate and acceleration by q; acceleration by v; J w
  // by q; error at the pose reached by q and by w; rotation of body A by q.
  Columns error_, rate_, curvature_, curvature_v_, y_, reached_q_, reached_w_, carried_;
  // Rotation of A at the pose reached, by q and by w; angular velocity and acceleration of A by q,
  // angular acceleration by v; angular velocity of B relative to A by q.
  Columns turned_q_, turned_w_, omega_, alpha_, alpha_v_, spin_;
};

/// Returns how the place of a closure's rows, and their frame, follow a displacement of B relative
/// to A.
ContactMotion closure_motion(const Model& model, const ActingClosure& acting,
                             const PairConstraint& pair, const Kinematics& data);

}  // namespace counterpoint
