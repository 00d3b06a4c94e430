// Jacobians of an island's constraints without their zero columns, and the products with them.
#pragma once

#include <vector>

namespace counterpoint::contact {

/// Packed Jacobians. A constraint touches strips: runs of velocities inside one group. A group is a
/// part of a velocity block that is one block of the factorization.
class PackedJacobian {
 public:
  struct Strip {
    int velocity;  ///< first velocity, in the island
    int size;
    int group;

    bool operator==(const Strip&) const = default;
  };
  struct Constraint {
    int rows, row;  ///< number of rows, first row
    int first_strip, end_strip;
    int num_columns;
    int leading;    ///< num_columns, rounded up to a multiple of four
    int by_column;  ///< start in the column-major values; a column of three rows takes four doubles
    int by_row;     ///< start in the row-major values; rows are `leading` long
  };
  /// Part of a velocity block that is one block of the factorization.
  struct Group {
    int velocity, size;
  };

  void clear();
  /// Starts a constraint.
  void begin_constraint(int rows);
  /// Appends the nonzero columns of a side. `jacobian`, and `other` if not null, which is added to
  /// it, are row-major and as wide as the velocity block. first_group: number of the first group.
  void add_side(const double* jacobian, const double* other, int width, const Group* groups,
                int num_groups, int first_group);
  void end_constraint();

  int num_rows() const { return num_rows_; }
  const std::vector<Constraint>& constraints() const { return constraints_; }
  const std::vector<Strip>& strips() const { return strips_; }
  /// Returns whether two constraints have columns of the same velocities.
  bool touch_the_same(const Constraint& a, const Constraint& b) const;
  /// J of a constraint, row-major.
  const double* by_row(const Constraint& c) const { return by_row_.data() + c.by_row; }
  /// Returns the sum of squares of the first row, weighted by velocity.
  double first_row_square(const Constraint& c, const double* weight) const;

  /// Computes out = J x, in the order of summation of the inverse.
  void multiply(const double* x, double* out) const;
  /// Computes out = J_c x of one constraint, with the same bits.
  void multiply(const Constraint& c, const double* x, double* out) const;
  /// Adds J' f to out; returns the sum over constraints of |J_c' f_c|^2, weighted by velocity.
  double add_transposed(const double* f, const double* weight, double* out) const;
  /// Adds |J| |x| to out.
  void add_absolute(const double* x, double* out) const;
  /// Adds |J|' e to out, e >= 0 by rows.
  void add_absolute_transposed(const double* e, double* out) const;

 private:
  int num_rows_ = 0;
  std::vector<Constraint> constraints_;
  std::vector<Strip> strips_;
  // Both vectors only grow; they are filled up to the end of the last constraint and never cleared.
  std::vector<double> by_column_, by_row_;
  int column_end_ = 0, row_end_ = 0;
  std::vector<double> side_;   // sum of both Jacobians of a side
  std::vector<double> sizes_;  // sums of the absolute values in its columns
};

}  // namespace counterpoint::contact
