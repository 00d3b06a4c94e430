// How the biases of a closure's rows (closures.h) change with the motion.
//
// With e the error of the closure, c its acceleration at constant joint velocities, y = J w and
// r(e) the speed of recovery, the bias of a closure, of which a share s is taken at the pose that w
// leads to, is
//
//   b = r(e) + (1 - s) h c / 2 + s ((e(q (+) h w) - e(q)) / h - y)
//
// A point p on the path of a joint with column S (world axes), whose carrier has velocity V and
// acceleration A, with P = V x S and PP = A x S + V x P (sweep.h), moves, speeds and accelerates by
//
//   dp/dq = S_p      du/dq = S_o x u + P_p      da/dq = S_o x a + 2 P_o x u + PP_p
//                    du/dv = S_p                da/dv = 2 S_o x u + (P + S')_p
//
// where u is its velocity, X_p the linear part of a motion X at p, X_o its angular part.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/derivatives/constraints/contact_motion.h"

namespace counterpoint {

/// Scratch of one thread for one model.
class ClosureDerivator {
 public:
  using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  explicit ClosureDerivator(const Model& model);

  /// For a state of the poses in `data` and v (nv).
  void begin(const Model& model, const Kinematics& data, const VectorRef& v);
  /// Sets the velocities w (nv) that biases are aimed with, in a step of h [s] from q.
  void aim(const Model& model, double h, const VectorRef& q, const VectorRef& w);

  /// Of rows as find_closures makes them, aimed or not: what is below. Needs begin, and aim if
  /// they are aimed.
  void compute(const Model& model, const ContactOptions& options, double h, const Closure& closure,
               const PairConstraint& pair, const Kinematics& data,
               bool aimed);  // Parameters: what it depends on, one by one

  /// Adds jacobian' `slopes`, of those below, `scale` times: to nv x nv.
  void add_to(MatrixX& out, double scale, const Columns& slopes) const;

  // By the coordinates that carry the bodies: a column each, the first `size`; the closure's rows
  // first.
  int size = 0;
  std::vector<int> coordinates;  ///< index in v
  Columns jacobian;
  /// Of the bias, in axes carried along with body A: by a displacement, by v, by w.
  Columns by_q, by_v, by_w;
  Vector3 bias;

 private:
  struct Column {
    Motion S, P, PP, D, P_w;  ///< at the tree's reference; D = P + S', P_w by w
  };
  struct Moving {
    Motion V, A, W;  ///< of the body, at the tree's reference; W by w
  };
  /// One body of the closure, its anchor and the place of the rows seen from the tree's reference.
  struct Side {
    int body = 0;
    double sign = 1.0;
    Vector3 anchor = Vector3::Zero(), place = Vector3::Zero();
    Moving moving;
    Vector3 u = Vector3::Zero(), a = Vector3::Zero();  ///< of the anchor
  };
  /// Error as a vector: of a distance what is between the anchors.
  struct Error {
    Vector3 apart;
    Matrix3 of_b, of_a;  ///< rotations only: by turns of the bodies
  };

  Side side(const Model& model, int body, double sign, const Pose& X_BC, const Vector3& place,
            const Kinematics& data) const;
  static Error error(const Closure& closure, bool turns, const Kinematics& data);
  void list(const Model& model, const PairConstraint& pair);
  void add_turns(const Model& model, const Side& side, const Error& error);
  void add_points(const Model& model, const Side& side, const Vector3& spin);
  void add_reached(const Model& model, const Side& side, const Pose& X_BC, bool turns,
                   const Error& error);
  void project(const Vector3& apart, const Vector3& parting, const Vector3& bend,
               const Vector3& apart_reached, const Vector3& y);
  void add_share_slope(const Model& model, double slope, int body, const Vector3& by_share);
  int fastest(const Model& model, const PairConstraint& pair, double& speed) const;

  std::vector<char> held_;  ///< by tree: under a closure
  std::vector<Column> columns_;
  std::vector<Moving> moving_;
  std::optional<Data> reached_;  ///< if there are closures: poses
  VectorX q_reached_, turn_;
  std::vector<int> slot_;  ///< by coordinate; -1: none
  // By slot: error, its rate and acceleration by q, the latter by v, J w by q, error reached by q
  // and w, what body A turns by.
  Columns error_, rate_, curvature_, curvature_v_, y_, reached_q_, reached_w_, carried_;
};

/// How the place of a closure's rows, and their frame, follow a displacement of B against A.
ContactMotion closure_motion(const Closure& closure, const PairConstraint& pair, const Kinematics& data);

}  // namespace counterpoint
