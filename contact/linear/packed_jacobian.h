// The Jacobians of an island's constraints without their zeros, and the products with them.
#pragma once

#include <vector>

namespace counterpoint::contact {

/// A constraint touches strips: runs of velocities inside one group, a part of a velocity block
/// that the factorization has as a block of its own.
class PackedJacobian {
 public:
  struct Strip {
    int velocity;  ///< first, in the island
    int size;
    int group;

    bool operator==(const Strip&) const = default;
  };
  struct Constraint {
    int rows, row;  ///< number of rows, first row
    int first_strip, end_strip;
    int num_columns;
    int leading;    ///< num_columns in whole fours
    int by_column;  ///< start in the values column by column, each with room for lanes(rows)
    int by_row;     ///< start in the values row by row, each `leading` long
  };
  /// Part of a velocity block.
  struct Group {
    int velocity, size;
  };

  void clear();
  /// Starts a constraint.
  void begin_constraint(int rows);
  /// Appends the columns of a side that are not zero. `jacobian`, and `other` if not null, which is
  /// added to it, are row-major and as wide as the block. first_group: number of the first group.
  void add_side(const double* jacobian, const double* other, int width, const Group* groups,
                int num_groups, int first_group);
  void end_constraint();

  int num_rows() const { return num_rows_; }
  const std::vector<Constraint>& constraints() const { return constraints_; }
  const std::vector<Strip>& strips() const { return strips_; }
  /// True if two constraints have columns of the same velocities.
  bool touch_the_same(const Constraint& a, const Constraint& b) const;
  /// J of a constraint row by row.
  const double* by_row(const Constraint& c) const { return by_row_.data() + c.by_row; }
  /// Sum of squares of the first row, weighted by velocity.
  double first_row_square(const Constraint& c, const double* weight) const;

  /// out = J x, column by column as the inverse does it.
  void multiply(const double* x, double* out) const;
  /// out = J_c x of one constraint, to the same bits.
  void multiply(const Constraint& c, const double* x, double* out) const;
  /// out += J' f; returns the sum over constraints of |J_c' f_c|^2 weighted by velocity.
  double add_transposed(const double* f, const double* weight, double* out) const;
  /// out += |J| |x|.
  void add_absolute(const double* x, double* out) const;
  /// out += |J|' e, e >= 0 by rows.
  void add_absolute_transposed(const double* e, double* out) const;

 private:
  int num_rows_ = 0;
  std::vector<Constraint> constraints_;
  std::vector<Strip> strips_;
  // Grown only, and filled as far as the last constraint ends: nothing is cleared to be written.
  std::vector<double> by_column_, by_row_;
  int column_end_ = 0, row_end_ = 0;
  std::vector<double> side_;   // the sum of both Jacobians of a side
  std::vector<double> sizes_;  // of its columns
};

}  // namespace counterpoint::contact
