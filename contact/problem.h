// The contact problem in generalized velocity space: all data that determine the physics of a step.
//
//   minimize over w+   1/2 |w+ - w*|_M^2  +  sum_i l_i(y_i),     y_i = J_i w+ + b_i
//
// Regularized Coulomb laws have no potential l_i; in general w+ solves M (w+ - w*) = sum_i J_i'
// f_i(y_i). The velocities are partitioned into blocks, one per kinematic tree; M is block
// diagonal, and every constraint touches one or two blocks. The library depends on Eigen only and
// knows neither bodies nor shapes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace counterpoint::contact {

using VectorX = Eigen::VectorXd;
using MatrixX = Eigen::MatrixXd;
using VectorMap = Eigen::Map<Eigen::VectorXd>;
using ConstVectorMap = Eigen::Map<const Eigen::VectorXd>;
/// Jacobians and mass blocks are stored row-major.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using MatrixMap = Eigen::Map<RowMatrix>;
using ConstMatrixMap = Eigen::Map<const RowMatrix>;

/// Largest number of rows of one constraint: normal, two sliding, torsion, two rolling.
inline constexpr int kMaxRows = 6;
/// Up to kMaxRows numbers of one constraint, without heap memory.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRows, 1>;
using RowsSquare = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxRows, kMaxRows>;

enum class LawType : unsigned char {
  kUnilateral,    ///< f >= 0: joint limit, frictionless contact (1 row)
  kFrictionCone,  ///< normal row first, then friction rows: 2 sliding [, 1 torsional [, 2 rolling]]
  kEquality,      ///< f = -y / r on every row: weld, loop closure, mimic (1 ... 6 rows)
  kSpring,        ///< same law, of a spring and damper: r is their strength, no compliance
  kDryFriction,   ///< |f - center| <= bound, opposing motion: dry joint friction, motor (1 row)
};

/// Law f(y) of one constraint: impulse f [N s] (torsional, rolling and angular rows: [N m s]) as a
/// function of the constraint velocity y [m/s]. The forward solver and the inverse evaluate this
/// same function.
struct Law {
  LawType type = LawType::kUnilateral;
  int rows = 1;
  bool coulomb =
      false;  ///< kFrictionCone: regularized Coulomb friction bounded by mu f_N, else convex
  double regularizer = 0.0;  ///< r [1/kg]; cone: R_T = r, R_N = normal_regularizer()
  /// R_N [1/kg] of a one-sided first row that is a spring with a damper, softer or harder than r
  /// says; 0: R_N follows from r. Friction of the convex cone then has R_N / mu^2.
  double normal = 0.0;
  double smoothing = 0.0;  ///< k [N m]; k -> 0 is the nonsmooth law
  /// coulomb: friction reaches its bound at this much more slip [m/s], independent of the load.
  double slip_speed = 0.0;
  double bound = 0.0;  ///< kDryFriction: largest impulse F [N s]
  /// kDryFriction: middle of the range of impulses, added to f [N s]: a motor's given part.
  double center = 0.0;
  /// kFrictionCone: friction[i] is the coefficient of row i + 1; sliding [-], torsional and rolling
  /// [m].
  std::array<double, kMaxRows - 1> friction{};
  /// coulomb: tilt of the cone [-]: f_T = -lean f_N + D phi_T, where D phi_T is the friction of the
  /// upright cone.
  std::array<double, 2> lean{};
  /// Bias b [m/s] of y = J w+ + b.
  std::array<double, kMaxRows> bias{};
};

/// The problem is filled anew every step; clear() keeps the capacity, so nothing is allocated once
/// the largest sizes have occurred. Maps are valid until the next add_*.
class Problem {
 public:
  void clear();
  /// Adds a velocity block and returns its index; the caller fills in its mass and free velocity.
  int add_block(int size);
  /// Adds a constraint between block_a and, if not -1, block_b, and returns its index; its Jacobian
  /// starts at zero.
  int add_constraint(const Law& law, int block_a, int block_b = -1);

  int num_blocks() const { return static_cast<int>(block_start_.size()) - 1; }
  int num_velocities() const { return block_start_.back(); }
  int num_constraints() const { return static_cast<int>(constraints_.size()); }
  int num_rows() const { return num_rows_; }

  int block_start(int block) const { return block_start_[block]; }
  int block_size(int block) const { return block_start_[block + 1] - block_start_[block]; }
  /// Mass matrix M of a block, symmetric positive definite, both triangles filled
  /// [kg, kg m, kg m^2].
  MatrixMap mass(int block);
  ConstMatrixMap mass(int block) const;
  /// Free velocity w* of all blocks [m/s, rad/s]: the velocity at the end of the step without
  /// constraints.
  VectorMap free_velocity();
  ConstVectorMap free_velocity() const;

  const Law& law(int constraint) const { return constraints_[constraint].law; }
  Law& law(int constraint) { return constraints_[constraint].law; }
  int first_row(int constraint) const { return constraints_[constraint].first_row; }
  /// Returns the block on `side` 0 or 1 of a constraint, -1 if there is none.
  int block(int constraint, int side) const { return constraints_[constraint].block[side]; }
  /// Returns whether all masses, free velocities, Jacobians and laws are finite.
  bool is_finite() const;
  /// Jacobian J of one side, rows x block size.
  MatrixMap jacobian(int constraint, int side);
  ConstMatrixMap jacobian(int constraint, int side) const;

 private:
  struct Constraint {
    Law law;
    int first_row = 0;
    std::array<int, 2> block{-1, -1};
    std::array<int, 2> jacobian_start{0, 0};
  };
  std::vector<int> block_start_{0};
  std::vector<int> mass_start_;
  std::vector<double> mass_data_, free_velocity_, jacobian_data_;
  std::vector<Constraint> constraints_;
  int num_rows_ = 0;
};

// ---- The law of one constraint: impulse, potential and Hessian as functions of the constraint
// velocity.
//
// Convex friction cone. Let z = (y_N, mu_1 y_1, mu_2 y_2, ...), tau = |z_T|, t = z_T / tau, and let
// g, s, a and p be those of the scalar law (laws/scalar_law.h) at the two eigenvalues
// lambda+- = z_N +- tau, with regularizer rho (normal_regularizer) and smoothing k:
//
//   f_N = (g+ + g-) / 2            b = (g+ + g-) / (s+ + s-) = (g- - g+) / (2 tau)
//   f_i = -mu_i b z_i              l = (p(lambda+) + p(lambda-)) / 2
//
// The Hessian in z is (a+ + a-)/2 for normal-normal and radial-radial, (a+ - a-)/2 for
// normal-radial, and b transverse. This is the scalar function g applied spectrally on the
// second-order cone (Jordan algebra); f minimizes 1/2 f'R f + f'y + k barrier(cone), where R_N =
// rho and R_i = rho / mu_i^2. There is no division by tau or by mu: without friction the normal row
// is the unilateral law.
//
// Regularized Coulomb friction (`coulomb`, laws/cones.h): the normal impulse depends on the
// normal velocity alone, f_N = g(y_N), and friction is -z_T / rho clamped to |phi_T| <= f_N,
// smoothed. It has no potential: G has a column df_T/dy_N, but the row df_N/dy_T is zero.

/// `lean` tilts the cone: f_T lies within mu f_N of -lean f_N. The solver works with the upright
/// cone and tilts only the impulses that it applies to the bodies (lean_impulse).

/// Returns f(y) [N s], `law.rows` long, for every law and friction model: the whole inverse of one
/// constraint. y [m/s]: `law.rows` long, bias included.
Rows impulse(const Law& law, const Rows& y);

/// Same on plain arrays of `law.rows` numbers, for inner loops.
void impulse(const Law& law, const double* y, double* f);

struct Evaluation {
  double potential = 0.0;  ///< potential l [J], grad l = -f; NaN for `coulomb`, which has none
  Rows impulse;            ///< f [N s]
  RowsSquare hessian;      ///< G = -df/dy [kg]; symmetric positive semidefinite unless `coulomb`
};

/// Evaluates l, f and G at y.
Evaluation evaluate(const Law& law, const Rows& y);

/// Evaluates f and G = -df/dy on plain arrays; G is rows x rows, row-major.
void evaluate(const Law& law, const double* y, double* f, double* hessian);

/// Returns the potential l(y) [J]; NaN for `coulomb`.
double potential(const Law& law, const double* y);

struct Slope {
  double first = 0.0;   ///< -f . d
  double second = 0.0;  ///< d' G d
};
/// Returns the first and second derivative of l at y along d (`coulomb`: -f . d and its
/// derivative).
Slope slope(const Law& law, const double* y, const double* d);

/// Returns |z_T| = |(mu_1 y_1, mu_2 y_2, ...)| [m/s]: De Saxce's form of regularized Coulomb
/// friction adds it to the normal velocity, and a lagged bias takes it from the last velocity.
double de_saxce_shift(const Law& law, const double* y);

/// Returns whether the first row can only push, f >= 0: contacts and limits.
inline bool is_one_sided(LawType type) {
  return type == LawType::kFrictionCone || type == LawType::kUnilateral;
}

/// Returns whether rows, regularizer, smoothing, friction, lean and bound are admissible for the
/// type, so that the law can be solved.
bool is_valid(const Law& law);
/// Returns whether the law has neither NaN nor infinity; slip_speed is not checked.
bool is_finite(const Law& law);
inline bool leans(const Law& law) { return law.lean[0] != 0.0 || law.lean[1] != 0.0; }
/// Subtracts lean f_N from the friction of f, `law.rows` numbers: an impulse of the upright cone,
/// or any other, since the map is linear. Real: a kind of number.
template <class Real>
void lean_impulse(const Law& law, Real* f) {
  for (int i = 0; leans(law) && i < 2; ++i) f[i + 1] -= law.lean[i] * f[0];
}

/// Softening of a law relative to the given one.
struct Softness {
  double factor = 1.0;  ///< factor of the regularizer [-]
  bool convex = false;  ///< friction is that of the convex law
  bool any() const { return factor != 1.0 || convex; }
  bool operator==(const Softness&) const = default;
};
/// Returns the softened law. A motor (dry friction without smoothing) stays unchanged. `convex`
/// also raises a negative bias of the first row to zero (no bounce, no overlap recovery) and drops
/// `lean`. Then f'(y - b) is at most that of the smoothing, so a step gains no energy; with a
/// negative bias, mu |v_T| <= y_N could amplify without bound the separation speed of a body that
/// turns about a nearby point.
Law soften(const Law& law, const Softness& softness);

/// Friction coefficients below this do not harden the normal row further.
inline constexpr double kMinRegularizingFriction = 0.1;
/// Returns rho [1/kg], the regularizer of the first row: Law::normal if given, else r, and of a
/// cone mu^2 r with mu = max(friction[0], 0.1), so that R_T = r sets the creep; a smaller mu would
/// make the normal row finer than round-off can resolve.
double normal_regularizer(const Law& law);
/// Returns the regularizer of friction in the scaled coordinates of laws/cones.h [1/kg]; of laws
/// other than Coulomb cones, that of the first row.
double friction_regularizer(const Law& law);
/// Returns v [m/s], the slip speed of a Coulomb cone in the scaled coordinates of laws/cones.h:
/// friction[0] slip_speed.
double scaled_slip_speed(const Law& law);

}  // namespace counterpoint::contact
