#include "counterpoint/engine/constraints/assemble.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "counterpoint/engine/dynamics/crba.h"
#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

/// Adds columns of a joint of so many linear and angular coordinates to row n . v of J, v of a
/// place at `arm` [m] from the body's origin.
template <int kLinear, int kAngular>
void add_linear_columns(const Motion* axis, const Vector3& arm, const Vector3& n, double* J) {
  const Vector3 moment = arm.cross(n);
  for (int j = 0; j < kLinear; ++j) J[j] += axis[j].linear.dot(n);
  for (int j = kLinear; j < kLinear + kAngular; ++j) J[j] += axis[j].angular.dot(moment);
}

void add_linear_columns(JointType type, const Motion* axis, const Vector3& arm, const Vector3& n,
                        double* J) {
  switch (type) {
    case JointType::kRevolute:
      return add_linear_columns<0, 1>(axis, arm, n, J);
    case JointType::kPrismatic:
      return add_linear_columns<1, 0>(axis, arm, n, J);
    case JointType::kPlanar:
      return add_linear_columns<2, 1>(axis, arm, n, J);
    case JointType::kSpherical:
      return add_linear_columns<0, 3>(axis, arm, n, J);
    case JointType::kFloating:
      return add_linear_columns<3, 3>(axis, arm, n, J);
  }
}

/// The same of row n . w.
void add_angular_columns(JointType type, const Motion* axis, const Vector3& n, double* J) {
  const int nv = joint_nv(type);
  for (int j = joint_num_linear(type); j < nv; ++j) J[j] += axis[j].angular.dot(n);
}

/// Adds the rows of the constraint, in the axes of `frame`, of one body's joint: rows are `width`
/// apart.
void add_joint_columns(const Model& model, const PairConstraint& pair, int b, const Matrix3& frame,
                       const Data& data, std::ptrdiff_t width, double* columns) {  // Parameters: all it depends on
  const int linear_end = std::min(pair.law.rows, 3 - pair.first);
  const Body& body = model.body(b);
  const Motion* axis = &data.axis[body.v_index];
  const Vector3 arm = pair.position - data.X_WB[b].translation;
  if (body.joint_type == JointType::kRevolute) {
    const Vector3 linear = frame.transpose() * axis->angular.cross(arm);
    for (int i = 0; i < linear_end; ++i) columns[i * width] += linear[pair.first + i];
  } else {
    for (int i = 0; i < linear_end; ++i)
      add_linear_columns(body.joint_type, axis, arm, frame.col(pair.first + i),
                         columns + i * width);
  }
  for (int i = std::max(linear_end, 0); i < pair.law.rows; ++i)
    add_angular_columns(body.joint_type, axis, frame.col(pair.first + i - 3), columns + i * width);
}

/// Adds sign * (rows of the constraint) of one body's chain to J, row by row as wide as its tree.
void fill_pair_jacobian(const Model& model, const PairConstraint& pair, int leaf, double sign,
                        const Data& data, contact::MatrixMap J) {
  const int v_begin = model.trees()[model.body(leaf).tree].v_begin;
  const Matrix3 frame = sign * pair.frame;
  for (int b = leaf; b != 0; b = model.body(b).parent)
    add_joint_columns(model, pair, b, frame, data, J.cols(),
                      J.data() + (model.body(b).v_index - v_begin));
}

/// Sums J v of a pair from the roots of its bodies' chains on, joint by joint.
class PairVelocity {
 public:
  PairVelocity(const Model& model, const PairConstraint& pair, const Data& data, const VectorRef& v)
      : model_(model),
        pair_(pair),
        data_(data),
        v_(v),
        minus_(-1.0 * pair.frame),
        y_(pair.law.rows) {
    y_.setZero();
  }

  /// Of the joints from the world to bodies a and b of one tree, or of one body where the other is
  /// the world (0), by rising index; a parent's is below its child's.
  void add(int a, int b) {
    if (a == 0 && b == 0) return;
    const bool of_a = a >= b, of_b = b >= a;
    add(of_a ? model_.body(a).parent : a, of_b ? model_.body(b).parent : b);
    add_joint(std::max(a, b), of_a, of_b);
  }
  const contact::Rows& sum() const { return y_; }

 private:
  void add_joint(int i, bool of_a, bool of_b) {
    const Body& body = model_.body(i);
    const int nv = joint_nv(body.joint_type);
    double columns[contact::kMaxRows * kMostColumns] = {};
    if (of_a) add_joint_columns(model_, pair_, i, minus_, data_, nv, columns);
    if (of_b) add_joint_columns(model_, pair_, i, pair_.frame, data_, nv, columns);
    for (int j = 0; j < nv; ++j)
      for (int r = 0; r < pair_.law.rows; ++r) y_[r] += columns[r * nv + j] * v_[body.v_index + j];
  }

  static constexpr int kMostColumns = 6;
  const Model& model_;
  const PairConstraint& pair_;
  const Data& data_;
  const VectorRef& v_;
  Matrix3 minus_;
  contact::Rows y_;
};

void add_pair(const Model& model, const PairConstraint& pair, const Data& data,
              const std::vector<int>& block_of_tree, contact::Problem& problem) {
  const int tree_a = model.body(pair.body_a).tree, tree_b = model.body(pair.body_b).tree;
  const int block_a = tree_a < 0 ? -1 : block_of_tree[tree_a];
  const int block_b = tree_b < 0 ? -1 : block_of_tree[tree_b];
  // Both bodies in one tree share one block.
  const int first = block_a >= 0 ? block_a : block_b;
  const int second = block_a >= 0 && block_b != block_a ? block_b : -1;
  const int constraint = problem.add_constraint(pair.law, first, second);
  if (block_a >= 0)
    fill_pair_jacobian(model, pair, pair.body_a, -1.0, data, problem.jacobian(constraint, 0));
  if (block_b >= 0)
    fill_pair_jacobian(model, pair, pair.body_b, 1.0, data,
                       problem.jacobian(constraint, block_b == first ? 0 : 1));
}

void add_joint_row(const Model& model, const JointConstraint& row,
                   const std::vector<int>& block_of_tree, contact::Problem& problem) {
  int tree[2] = {model.tree_of_velocity(row.v_index[0]), -1};
  if (row.v_index[1] >= 0) tree[1] = model.tree_of_velocity(row.v_index[1]);
  const int second = tree[1] >= 0 && tree[1] != tree[0] ? block_of_tree[tree[1]] : -1;
  const int constraint = problem.add_constraint(row.law, block_of_tree[tree[0]], second);
  for (int k = 0; k < 2 && row.v_index[k] >= 0; ++k) {
    const int side = tree[k] == tree[0] ? 0 : 1;
    problem.jacobian(constraint, side)(0, row.v_index[k] - model.trees()[tree[k]].v_begin) +=
        row.coefficient[k];
  }
}

void mark_touched_trees(const Model& model, const ConstraintSet& constraints,
                        std::vector<int>& block_of_tree) {
  block_of_tree.assign(model.num_trees(), -1);
  for_each_constraint(model, constraints, [&](int tree_a, int tree_b) {
    for (const int tree : {tree_a, tree_b})
      if (tree >= 0) block_of_tree[tree] = 0;
  });
}

}  // namespace

void assemble_problem(const Model& model, const ConstraintSet& constraints, const VectorRef& w_free,
                      const VectorRef& mass_diagonal, Data& data, std::vector<int>& block_of_tree,
                      contact::Problem& problem) {
  problem.clear();
  mark_touched_trees(model, constraints, block_of_tree);
  for (int t = 0; t < model.num_trees(); ++t) {
    if (block_of_tree[t] < 0) continue;
    const Tree& tree = model.trees()[t];
    const int size = tree.v_end - tree.v_begin;
    block_of_tree[t] = problem.add_block(size);
    contact::MatrixMap M = problem.mass(block_of_tree[t]);
    crba_tree(model, tree, data, M);
    M.diagonal() += mass_diagonal.segment(tree.v_begin, size);
    problem.free_velocity().segment(problem.block_start(block_of_tree[t]), size) =
        w_free.segment(tree.v_begin, size);
  }
  for (const PairConstraint& pair : constraints.pairs)
    add_pair(model, pair, data, block_of_tree, problem);
  for (const JointConstraint& j : constraints.joints)
    add_joint_row(model, j, block_of_tree, problem);
}

contact::Rows pair_velocity(const Model& model, const PairConstraint& pair, const Data& data,
                            const VectorRef& v) {
  PairVelocity sum(model, pair, data, v);
  if (model.body(pair.body_a).tree == model.body(pair.body_b).tree) {
    sum.add(pair.body_a, pair.body_b);
  } else {
    sum.add(pair.body_a, 0);
    sum.add(0, pair.body_b);
  }
  contact::Rows y = sum.sum();
  for (int row = 0; row < pair.law.rows; ++row) y[row] += pair.law.bias[row];
  return y;
}

double joint_row_velocity(const JointConstraint& row, const VectorRef& v) {
  double y = row.coefficient[0] * v[row.v_index[0]];
  if (row.v_index[1] >= 0) y += row.coefficient[1] * v[row.v_index[1]];
  return y + row.law.bias[0];
}

Force pair_impulse(const PairConstraint& pair, const contact::Rows& impulse) {
  Force out;
  for (int i = 0; i < pair.law.rows; ++i) {
    const int row = pair.first + i;
    if (row < 3) {
      out.force += impulse[i] * pair.frame.col(row);
    } else {
      out.torque += impulse[i] * pair.frame.col(row - 3);
    }
  }
  return out;
}

void add_pair_impulse(const PairConstraint& pair, const Force& impulse, const Data& data,
                      std::vector<Force>& body_impulse) {
  const std::pair<int, double> sides[] = {{pair.body_a, -1.0}, {pair.body_b, 1.0}};
  for (const auto& [body, sign] : sides) {
    if (body == 0) continue;
    const Vector3 arm = pair.position - data.X_WB[body].translation;
    body_impulse[body] +=
        Force{sign * (impulse.torque + arm.cross(impulse.force)), sign * impulse.force};
  }
}

void project_on_joints(const Model& model, const Data& data, std::vector<Force>& body_force,
                       VectorOut tau) {
  for (int i = model.num_bodies() - 1; i > 0; --i) {
    const Body& body = model.body(i);
    add_joint_force(body.joint_type, &data.axis[body.v_index], body_force[i],
                    tau.data() + body.v_index);
    if (body.parent != 0) body_force[body.parent] += shift(body_force[i], data.arm[i]);
  }
}

}  // namespace counterpoint
