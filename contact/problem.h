// The contact problem in generalized velocity space: everything that shapes the physics of one
// step.
//
//   minimize over w+   1/2 |w+ - w*|_M^2  +  sum_i l_i(y_i),     y_i = J_i w+ + b_i
//
// Velocities are partitioned in blocks (a kinematic tree each); M is block diagonal; every
// constraint touches one block or two. Knows only Eigen: no bodies, no shapes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace counterpoint::contact {

using VectorX = Eigen::VectorXd;
using MatrixX = Eigen::MatrixXd;
using VectorMap = Eigen::Map<Eigen::VectorXd>;
using ConstVectorMap = Eigen::Map<const Eigen::VectorXd>;
/// Jacobians and mass blocks are stored row by row.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using MatrixMap = Eigen::Map<RowMatrix>;
using ConstMatrixMap = Eigen::Map<const RowMatrix>;

/// Largest number of rows of one constraint: normal, two sliding, torsion, two rolling.
inline constexpr int kMaxRows = 6;
/// Rows of one constraint, on the stack.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRows, 1>;
using RowsSquare = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxRows, kMaxRows>;

enum class LawType : unsigned char {
  kUnilateral,    ///< f >= 0: joint limit, frictionless contact (1 row)
  kFrictionCone,  ///< normal row first, then friction rows: 2 sliding [, 1 torsional [, 2 rolling]]
  kEquality,      ///< f = -y / r on every row: weld, loop closure, mimic (1 ... 6 rows)
  kDryFriction,   ///< |f| <= bound, opposing motion: dry joint friction (1 row)
};

/// The law f(y) of one constraint: impulse [N s] (torsional, rolling and angular rows: [N m s])
/// from contact-space velocity y [m/s]. The forward solver and the inverse call the same function
/// of this.
struct Law {
  LawType type = LawType::kUnilateral;
  int rows = 1;
  bool coulomb = false;      ///< kFrictionCone: exact Coulomb friction bounded by mu f_N
  double regularizer = 0.0;  ///< r [1/kg]; cone: R_T = r, R_N = friction[0]^2 r
  double smoothing = 0.0;    ///< k [N m]: k -> 0 is the hard law
  /// coulomb: friction reaches its bound at so much more slip [m/s], whatever the load.
  double slip_speed = 0.0;
  double bound = 0.0;  ///< kDryFriction: largest impulse [N s]
  /// kFrictionCone: coefficient of friction row i + 1; sliding [-], torsional and rolling [m].
  std::array<double, kMaxRows - 1> friction{};
  /// coulomb: sliding friction is this share of f_N less, f_T = -lean f_N + what the cone gives
  /// [-].
  std::array<double, 2> lean{};
  /// b [m/s]: y = J w+ + b.
  std::array<double, kMaxRows> bias{};
};

/// Filled anew every step; clear() keeps the capacity, so that nothing is allocated once sizes have
/// been seen. Maps are valid until the next add_*.
class Problem {
 public:
  void clear();
  /// Adds a velocity block; its mass and free velocity are to be filled in by the caller.
  int add_block(int size);
  /// Adds a constraint between block_a and, if not -1, block_b; the Jacobian starts at zero.
  int add_constraint(const Law& law, int block_a, int block_b = -1);

  int num_blocks() const { return static_cast<int>(block_start_.size()) - 1; }
  int num_velocities() const { return block_start_.back(); }
  int num_constraints() const { return static_cast<int>(constraints_.size()); }
  int num_rows() const { return num_rows_; }

  int block_start(int block) const { return block_start_[block]; }
  int block_size(int block) const { return block_start_[block + 1] - block_start_[block]; }
  /// M of a block, symmetric positive definite, both triangles filled. [kg, kg m, kg m^2]
  MatrixMap mass(int block);
  ConstMatrixMap mass(int block) const;
  /// w*: the velocity [m/s, rad/s] at the end of the step if there were no constraint.
  VectorMap free_velocity();
  ConstVectorMap free_velocity() const;

  const Law& law(int constraint) const { return constraints_[constraint].law; }
  Law& law(int constraint) { return constraints_[constraint].law; }
  int first_row(int constraint) const { return constraints_[constraint].first_row; }
  /// Block on `side` 0 or 1 of a constraint; -1 if there is none.
  int block(int constraint, int side) const { return constraints_[constraint].block[side]; }
  /// Every number of masses, free velocities, Jacobians and laws is finite.
  bool is_finite() const;
  /// J of one side: rows x block size.
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

// ---- The law of one constraint: impulse, potential, Hessian as functions of contact-space
// velocity.
//
// Friction cone. With z = (y_N, mu_1 y_1, mu_2 y_2, ...), tau = |z_T|, t = z_T / tau and the scalar
// law g, a of scalar_law.h at the two eigenvalues lambda+- = z_N +- tau, regularizer rho (below),
// smoothing k:
//
//   f_N = (g+ + g-) / 2            b = (g+ + g-) / (s+ + s-) = (g- - g+) / (2 tau)
//   f_i = -mu_i b z_i              l = (p(lambda+) + p(lambda-)) / 2
//
// and the Hessian in z: normal-normal and radial-radial (a+ + a-)/2, normal-radial (a+ - a-)/2,
// transverse b. This is the scalar function g applied spectrally on the second-order cone (Jordan
// algebra); f minimizes 1/2 f'R f + f'y + k barrier(cone), R_N = rho, R_i = rho / mu_i^2. Nothing
// is divided by tau or by mu: without friction the normal row is the unilateral law.
//
// Exact Coulomb friction (`coulomb`, coulomb.h): the normal impulse is that of the normal velocity
// alone, f_N = g(y_N), and friction the clamp of -z_T / rho to it, smoothed. It has no potential:
// G has a column of f_T by y_N and no row of f_N by y_T.

/// With `lean` the cone stands on an inclined base: f_T lies within mu f_N of -lean f_N. All of the
/// solver works with the upright cone; only what it gives to the bodies leans (lean_impulse).

/// f(y) [N s], `law.rows` long. y [m/s] includes the bias. Works for every law and friction model;
/// This is the whole inverse of one constraint.
Rows impulse(const Law& law, const Rows& y);

/// The same on plain arrays of `law.rows` numbers, for inner loops.
void impulse(const Law& law, const double* y, double* f);

struct Evaluation {
  double potential = 0.0;  ///< l [J], grad l = -f; NaN for `coulomb`, which has none
  Rows impulse;            ///< f [N s]
  RowsSquare hessian;      ///< G = -df/dy [kg]; symmetric positive semidefinite unless `coulomb`
};

/// l, f and G at y.
Evaluation evaluate(const Law& law, const Rows& y);

/// f and G = -df/dy on plain arrays; G is rows x rows, row by row.
void evaluate(const Law& law, const double* y, double* f, double* hessian);

/// l(y) [J]; NaN for `coulomb`.
double potential(const Law& law, const double* y);

struct Slope {
  double first = 0.0;   ///< -f . d
  double second = 0.0;  ///< d' G d
};
/// First and second derivative of l along d at y (`coulomb`: of the power -f . d).
Slope slope(const Law& law, const double* y, const double* d);

/// |z_T| = |(mu_1 y_1, mu_2 y_2, ...)| [m/s]: what De Saxce's form of exact Coulomb friction adds
/// to the normal velocity, and what a lagged bias takes from the last velocity.
double de_saxce_shift(const Law& law, const double* y);

/// Contacts and limits: their first row pushes, and never pulls.
inline bool is_one_sided(LawType type) {
  return type == LawType::kFrictionCone || type == LawType::kUnilateral;
}

/// Rows, regularizer, smoothing, friction and bound make sense for the type: a law one can solve.
bool is_valid(const Law& law);
/// No NaN and no infinity in it.
bool is_finite(const Law& law);
inline bool leans(const Law& law) { return law.lean[0] != 0.0 || law.lean[1] != 0.0; }
/// Of f, law.rows numbers, the impulse of the upright cone; or of any other impulse, linearly.
inline void lean_impulse(const Law& law, double* f) {
  for (int i = 0; leans(law) && i < 2; ++i) f[i + 1] -= law.lean[i] * f[0];
}

/// How much softer than its own a law is.
struct Softness {
  double factor = 1.0;  ///< of the regularizer
  bool convex = false;  ///< friction is the convex law's
  bool any() const { return factor != 1.0 || convex; }
  bool operator==(const Softness&) const = default;
};
/// The law, softer; that of a motor, which is dry friction without smoothing, stays as it is. A
/// convex one does not push apart either, neither what bounces nor what overlaps: its f'(y - b) is
/// then at most the smoothing's, so that a step gains no energy, whereas mu |v_T| <= y_N, asked of
/// what turns about a point close by, would make any speed of parting as large as one likes.
Law soften(const Law& law, const Softness& softness);

/// Friction coefficients below this no longer harden the normal row.
inline constexpr double kMinRegularizingFriction = 0.1;
/// rho [1/kg], the normal regularizer of a cone: mu^2 r with mu = max(friction[0], 0.1), so that
/// R_T = r sets the creep; a smaller mu would drive the normal row below what round-off can
/// resolve.
double normal_regularizer(const Law& law);
/// v of a Coulomb cone in the coordinates of coulomb.h: mu slip_speed, mu the first of `friction`.
double scaled_slip_speed(const Law& law);

}  // namespace counterpoint::contact
