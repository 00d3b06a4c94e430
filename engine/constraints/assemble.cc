#include "counterpoint/engine/constraints/assemble.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "counterpoint/contact/lanes/vector_lanes.h"
#include "counterpoint/engine/dynamics/crba.h"
#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

using contact::Four;

/// The axes of a constraint's rows, one per lane; each member is one component in W.
struct FrameLanes {
  Four x, y, z;

  COUNTERPOINT_INTO_EACH FrameLanes(const Matrix3& frame, double sign)
      : x{sign * frame(0, 0), sign * frame(0, 1), sign * frame(0, 2), 0.0},
        y{sign * frame(1, 0), sign * frame(1, 1), sign * frame(1, 2), 0.0},
        z{sign * frame(2, 0), sign * frame(2, 1), sign * frame(2, 2), 0.0} {}
  /// Computes arm x axis for each axis; its product with an angular velocity is the linear velocity
  /// at `arm`. The tangential axes use the lever arm arm + friction.
  COUNTERPOINT_INTO_EACH FrameLanes(const Vector3& arm, const Vector3& friction,
                                    const FrameLanes& axes) {
    const Four a[3] = {Four{arm[0], arm[0] + friction[0], arm[0] + friction[0], 0.0},
                       Four{arm[1], arm[1] + friction[1], arm[1] + friction[1], 0.0},
                       Four{arm[2], arm[2] + friction[2], arm[2] + friction[2], 0.0}};
    x = a[1] * axes.z - a[2] * axes.y;
    y = a[2] * axes.x - a[0] * axes.z;
    z = a[0] * axes.y - a[1] * axes.x;
  }

  COUNTERPOINT_INTO_EACH void dot(const Vector3& v, Four& out) const {
    out = (x * v[0] + y * v[1]) + z * v[2];
  }
};

/// One column of J: the linear velocity at the contact point, and the angular velocity if such rows
/// exist.
struct RowLanes {
  Four linear{}, angular{};
};

/// A pair whose Jacobian is evaluated.
struct PairRows {
  const Model& model;
  const PairConstraint& pair;
  const Kinematics& data;

  /// Whether there are rows of angular velocity.
  bool turning() const { return pair.first + pair.law.rows > 3 || pair.lead != 0.0; }
};

/// Calls visit(index of the coordinate, its column of J) for the joint of body b; frame: axes of
/// the rows.
template <class Visit>
COUNTERPOINT_INTO_EACH void visit_columns(const PairRows& rows, int b, const FrameLanes& frame,
                                          bool turning, const Visit& visit) {
  const Body& body = rows.model.body(b);
  const Motion* axis = &rows.data.axis[body.v_index];
  // Tests for revolute joints first: nearly all are, and a branch is faster than a table.
  const bool revolute = body.joint_type == JointType::kRevolute;
  const int num_linear = revolute ? 0 : joint_num_linear(body.joint_type);
  const int nv = revolute ? 1 : joint_nv(body.joint_type);
  RowLanes column;
  for (int j = 0; j < num_linear; ++j) {
    frame.dot(axis[j].linear, column.linear);
    visit(body.v_index + j, column);
  }
  const FrameLanes moment(rows.pair.position - rows.data.X_WB[b].translation,
                          rows.pair.friction_point, frame);
  for (int j = num_linear; j < nv; ++j) {
    moment.dot(axis[j].angular, column.linear);
    if (turning) frame.dot(axis[j].angular, column.angular);
    visit(body.v_index + j, column);
  }
}

/// Adds sign times the rows of one body's chain to J, which is as wide as the body's tree.
COUNTERPOINT_WIDE void fill_pair_jacobian(const PairRows& of, int leaf, double sign,
                                          contact::MatrixMap J) {
  const Model& model = of.model;
  const PairConstraint& pair = of.pair;
  const FrameLanes frame(pair.frame, sign);
  const bool turning = of.turning();
  const std::ptrdiff_t width = J.cols();
  const int v_begin = model.trees()[model.body(leaf).tree].v_begin;
  const int num_rows = pair.law.rows;
  const auto visit_all = [&](const auto& add) __attribute__((always_inline)) {
    for (int b = leaf; b != 0; b = model.body(b).parent) visit_columns(of, b, frame, turning, add);
  };
  if (pair.first == 0 && num_rows == 3) {  // nearly all constraints
    visit_all([&](int index, const RowLanes& column) __attribute__((always_inline)) {
      double* const to = J.data() + (index - v_begin);
      to[0] += column.linear[0];
      to[width] += column.linear[1];
      to[2 * width] += column.linear[2];
    });
    return;
  }
  visit_all([&](int index, const RowLanes& column) __attribute__((always_inline)) {
    double rows[8];
    contact::store(column.linear, rows);
    contact::store(column.angular, rows + 4);
    for (int r = 0; r < num_rows; ++r) {
      const int row = pair.first + r;
      double value = rows[row < 3 ? row : row + 1];
      if (pair.lead != 0.0) value += pair.lead * rows[row + 4];
      J.data()[index - v_begin + r * width] += value;
    }
  });
}

/// Computes J v of the listed joints, from the last one on, for each body by rising coordinate.
COUNTERPOINT_WIDE void sum_columns(const PairRows& of, const double* v,
                                   const std::vector<PairChain::Link>& links, RowLanes& y) {
  const FrameLanes frame(of.pair.frame, 1.0);
  const bool turning = of.turning();
  RowLanes sum;
  double sign = 1.0;  // sign of the body's rows, applied to v: exact
  const auto add = [&](int index, const RowLanes& column) {
    sum.linear += column.linear * (sign * v[index]);
    if (turning) sum.angular += column.angular * (sign * v[index]);
  };
  for (auto link = links.rbegin(); link != links.rend(); ++link) {
    sign = link->of_b ? 1.0 : -1.0;
    visit_columns(of, link->body, frame, turning, add);
  }
  y = sum;
}

/// Finds the joints from both bodies to their common ancestor, beyond which the columns of J cancel
/// (-c + c). A parent's index is below that of its children.
void find_chain(const Model& model, int a, int b, PairChain& chain) {
  chain.body_a = a;
  chain.body_b = b;
  chain.links.clear();
  const auto follow = [&](int& from, bool of_b) {
    chain.links.push_back({from, of_b});
    from = model.body(from).parent;
  };
  if (model.body(a).tree != model.body(b).tree) {
    while (b != 0) follow(b, true);
    while (a != 0) follow(a, false);
  }
  while (a != b) a > b ? follow(a, false) : follow(b, true);
}

void add_pair(const Model& model, const PairConstraint& pair, const std::vector<int>& block_of_tree,
              contact::Problem& problem) {
  const int tree_a = model.body(pair.body_a).tree, tree_b = model.body(pair.body_b).tree;
  const int block_a = tree_a < 0 ? -1 : block_of_tree[tree_a];
  const int block_b = tree_b < 0 ? -1 : block_of_tree[tree_b];
  // Two bodies of one tree share one block.
  const int first = block_a >= 0 ? block_a : block_b;
  const int second = block_a >= 0 && block_b != block_a ? block_b : -1;
  problem.add_constraint(pair.law, first, second);
}

void fill_pair(const Model& model, const PairConstraint& pair, const Kinematics& data,
               const std::vector<int>& block_of_tree, int constraint, contact::Problem& problem) {
  const int tree_a = model.body(pair.body_a).tree, tree_b = model.body(pair.body_b).tree;
  const PairRows rows{model, pair, data};
  if (tree_a >= 0) fill_pair_jacobian(rows, pair.body_a, -1.0, problem.jacobian(constraint, 0));
  if (tree_b < 0) return;
  const bool first = block_of_tree[tree_b] == problem.block(constraint, 0);
  fill_pair_jacobian(rows, pair.body_b, 1.0, problem.jacobian(constraint, first ? 0 : 1));
}

void add_joint_row(const Model& model, const contact::Law& law, std::span<const RowTerm> terms,
                   const std::vector<int>& block_of_tree, contact::Problem& problem) {
  const auto [first, second] = trees_of(model, terms);
  const int constraint =
      problem.add_constraint(law, block_of_tree[first], second < 0 ? -1 : block_of_tree[second]);
  for (const RowTerm& term : terms) {
    const int tree = model.tree_of_velocity(term.v_index);
    problem.jacobian(constraint, tree == first ? 0 : 1)(
        0, term.v_index - model.trees()[tree].v_begin) += term.coefficient;
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
                      const VectorRef& mass_diagonal, const BodyState& bodies,
                      std::vector<int>& block_of_tree, contact::Problem& problem,
                      contact::ThreadPool* pool) {
  problem.clear();
  mark_touched_trees(model, constraints, block_of_tree);
  for (int t = 0; t < model.num_trees(); ++t) {
    if (block_of_tree[t] < 0) continue;
    const Tree& tree = model.trees()[t];
    block_of_tree[t] = problem.add_block(tree.v_end - tree.v_begin);
  }
  contact::share(pool, model.num_trees(), [&](int t, int) {
    if (block_of_tree[t] < 0) return;
    const Tree& tree = model.trees()[t];
    const int size = tree.v_end - tree.v_begin;
    contact::MatrixMap M = problem.mass(block_of_tree[t]);
    crba_tree(model, tree, bodies, M);
    M.diagonal() += mass_diagonal.segment(tree.v_begin, size);
    problem.free_velocity().segment(problem.block_start(block_of_tree[t]), size) =
        w_free.segment(tree.v_begin, size);
  });
  for (const PairConstraint& pair : constraints.pairs)
    add_pair(model, pair, block_of_tree, problem);
  contact::share(pool, static_cast<int>(constraints.pairs.size()), [&](int i, int) {
    fill_pair(model, constraints.pairs[i], bodies.at, block_of_tree, i, problem);
  });
  for (const JointConstraint& j : constraints.joints)
    add_joint_row(model, j.law, constraints.terms(j), block_of_tree, problem);
}

void pair_velocity(const Model& model, const PairConstraint& pair, const Kinematics& data,
                   const VectorRef& v, PairChain& chain, double* y) {
  if (pair.body_a != chain.body_a || pair.body_b != chain.body_b)
    find_chain(model, pair.body_a, pair.body_b, chain);
  RowLanes sum;
  sum_columns({model, pair, data}, v.data(), chain.links, sum);
  double rows[8];
  contact::store(sum.linear, rows);
  contact::store(sum.angular, rows + 4);
  for (int i = 0; i < pair.law.rows; ++i) {
    const int row = pair.first + i;
    y[i] = rows[row < 3 ? row : row + 1] + pair.law.bias[static_cast<std::size_t>(i)];
    if (pair.lead != 0.0) y[i] += pair.lead * rows[row + 4];
  }
}

Force pair_impulse(const PairConstraint& pair, const double* impulse) {
  Force out;
  for (int i = 0; i < pair.law.rows; ++i) {
    const int row = pair.first + i;
    if (row < 3) {
      out.force += impulse[i] * pair.frame.col(row);
      if (pair.lead != 0.0) out.torque += pair.lead * impulse[i] * pair.frame.col(row);
    } else {
      out.torque += impulse[i] * pair.frame.col(row - 3);
    }
  }
  if (!pair.friction_point.isZero(0.0))
    out.torque += pair.friction_point.cross(out.force - impulse[0] * pair.frame.col(0));
  return out;
}

void add_pair_impulse(const PairConstraint& pair, const Force& impulse, const Kinematics& data,
                      std::vector<Force>& body_impulse) {
  const std::pair<int, double> sides[] = {{pair.body_a, -1.0}, {pair.body_b, 1.0}};
  for (const auto& [body, sign] : sides) {
    if (body == 0) continue;
    const Vector3 arm = pair.position - data.X_WB[body].translation;
    body_impulse[body] +=
        Force{sign * (impulse.torque + arm.cross(impulse.force)), sign * impulse.force};
  }
}

void project_on_joints(const Model& model, const Kinematics& data, std::vector<Force>& body_force,
                       VectorOut tau) {
  for (int i = model.num_bodies() - 1; i > 0; --i) {
    if (body_force[i].force.isZero(0.0) && body_force[i].torque.isZero(0.0)) continue;
    const Body& body = model.body(i);
    add_joint_force(body.joint_type, &data.axis[body.v_index], body_force[i],
                    tau.data() + body.v_index);
    if (body.parent != 0) body_force[body.parent] += shift(body_force[i], data.arm[i]);
  }
}

}  // namespace counterpoint
