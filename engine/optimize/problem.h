// A trajectory optimization problem: the frames of a motion are its variables, and nothing else.
//
// Frames q_0 ... q_N are h apart; velocities are differences, v_t = (q_t (-) q_{t-1}) / h, and the
// applied forces u_t of the step from frame t to frame t + 1 are those that step_inverse recovers
// from (q_t, v_t, v_{t+1}). What is wanted of the motion is a sum of squares,
//
//   minimize over q   1/2 sum over frames, terms of | weight (value - target) |^2
//
// subject to conditions, terms that are to vanish; one is that there is no force where
// there is no motor (kUnactuatedForce). After Kurtz, Castro, Oncul and Lin, "Inverse Dynamics Trajectory
// Optimization for Contact-Implicit Model Predictive Control" (2023), and Todorov, "A convex,
// smooth and invertible contact model for trajectory optimization" (ICRA 2011).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "counterpoint/model/scene.h"

namespace counterpoint::optimization {

/// What a term is about, by rows. A frame has what (q_{t-1}, q_t) tells; a step, from frame t to
/// t + 1, what needs q_{t+1} too.
enum class Quantity {
  // nv rows, of a frame
  kConfiguration,  ///< q_t (-) target [m, rad]; target: nq
  kVelocity,       ///< v_t [m/s, rad/s]
  kJointLimits,    ///< how far a coordinate is beyond `length` before its limit [m, rad]
  // nv rows, of a step
  kAcceleration,     ///< (v_{t+1} - v_t) / h
  kAppliedForce,     ///< u_t [N, N m]
  kUnactuatedForce,  ///< the same
  // of a frame, and of a point or a body
  kPosition,         ///< 3 rows: of the point, in W [m]
  kOrientation,      ///< 3 rows: log(R_target' R_WB) [rad]
  kPointVelocity,    ///< 3 rows: change of the point's position over h, in W [m/s]
  kClearance,        ///< 1 row: target less the point's height, where that is positive [m]
  kSliding,          ///< 2 rows: horizontal velocity of the point times exp(-height / length) [m/s]
  kTilt,             ///< 2 rows: horizontal part of a body axis times exp(-height / length) [1]
  kCenterOfMass,     ///< 3 rows: of all that moves, or of the body's tree [m]
  kMomentum,         ///< 3 rows: mass times the velocity of that point [kg m/s]
  kAngularMomentum,  ///< 3 rows: about the centre of mass [kg m^2/s]
  // of a step, and of a body
  kContactForce,  ///< 3 rows: of all contacts on the body, in W [N]
};
/// As in problem files: "configuration", "applied_force", ...
const char* quantity_name(Quantity quantity);
std::optional<Quantity> quantity_from_name(const std::string& name);
std::string quantity_names();
/// Is it of a step, not of a frame?
bool of_step(Quantity quantity);
/// Has it a row for every coordinate of v?
bool of_coordinates(Quantity quantity);
int rows_of(const Model& model, Quantity quantity);

/// Frames first ... last; negative ones are counted from the end, -1 being the last.
struct FrameRange {
  int first = 0, last = -1;
};

struct Term {
  Quantity quantity = Quantity::kConfiguration;
  std::string name;        ///< in reports
  VectorX weight;          ///< by row, inverse units of the value
  VectorX target;          ///< by row, or nq for kConfiguration; empty: zero
  bool condition = false;  ///< driven to zero (newton.h) instead of weighed against the others
  FrameRange frames;
  int body = 0;                               ///< index into Model::bodies
  Vector3 point = Vector3::Zero();            ///< in the body frame [m]
  Vector3 axis = Vector3::UnitZ();            ///< kTilt: in the body frame, unit length
  Matrix3 orientation = Matrix3::Identity();  ///< kOrientation: the target
  double radius = 0.0;                        ///< heights are of the point less this [m]
  double length = 0.05;                       ///< [m, rad], see Quantity
  /// The weight grows by this factor as smoothing falls from kLateFrom to kLateTo: for what would
  /// block the search while contacts are forming.
  double late_weight = 1.0;
};

/// Smoothing [m] between which late weights grow.
inline constexpr double kLateFrom = 1e-2, kLateTo = 1e-5;

/// A reflection of configurations in the plane y = 0: coordinates change places and signs.
struct Mirror {
  std::vector<int> q_index, v_index;  ///< mirrored[i] = sign[i] original[index[i]]
  VectorX q_sign, v_sign;
};
/// The mirror of a model whose joints' names say left and right: `left` in a name becomes `right`
/// and the reverse; all other joints stay. Signs follow from the axes at the default pose.
/// @throws InputError where a joint has no partner, or axes that are no mirror image.
Mirror make_mirror(const Model& model, const std::string& left, const std::string& right);

struct Problem {
  const Model* model = nullptr;
  /// How steps are done at the end of the continuation: `contact`, `effects`. time_step is h.
  SimulationOptions options;
  int steps = 0;  ///< N
  /// Frame t + N is frame t, mirrored if there is a mirror, and moved by `displacement` [m] (every
  /// floating tree). Frames 0 ... N - 1 are the variables. Else frames 1 ... N are.
  bool periodic = false;
  Vector3 displacement = Vector3::Zero();
  std::optional<Mirror> mirror;
  VectorX start_q, start_v;       ///< frame 0 and the velocity there; not periodic
  std::optional<VectorX> goal_q;  ///< frame N; none: free
  VectorX goal_v;                 ///< nv: velocity at frame N, with goal_q
  /// Start and goal stand: their floating trees are raised or lowered, at each smoothing, until
  /// contacts carry their weight.
  bool settle = false;
  std::vector<Term> terms;
  /// nv: is a motor there? As motors_of gives it, less those that are to do nothing.
  std::vector<char> motors;

  double h() const { return options.time_step; }
};

/// nv: has the joint a motor? All but free bases do.
std::vector<char> motors_of(const Model& model);
/// Weights for kUnactuatedForce (nv): zero where there is a motor, else one over the weight of the
/// coordinate's tree [N], or that times `lever` [m] for torques; of a body on its own twice its
/// radius of gyration, if that is shorter.
VectorX unactuated_weights(const Model& model, const std::vector<char>& motors, double lever = 0.5);
/// The term that nothing pushes where no motor is, as a condition. Units: weights of trees.
Term unactuated_condition(const Model& model, const std::vector<char>& motors, double lever = 0.5);
/// g0 times the mass of all bodies [N].
double scene_weight(const Model& model);

/// Frames on a straight line between two configurations: steps + 1 of them.
std::vector<VectorX> straight_line(const Model& model, const VectorX& from, const VectorX& to,
                                   int steps);

/// @throws InputError where sizes or indices do not fit the model.
void check_problem(const Problem& problem);

}  // namespace counterpoint::optimization
