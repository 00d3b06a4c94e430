// Couplings between bodies in addition to the tree's: columns of one path against those of another.
#include <utility>

#include "counterpoint/engine/derivatives/dynamics/sweep.h"

namespace counterpoint {
namespace {

/// Calls act(k) for every coordinate that carries a body.
template <class Act>
void for_each_coordinate(const Model& model, int body, const Act& act) {
  for (int b = body; b != 0; b = model.body(b).parent) {
    const int first = model.body(b).v_index;
    for (int k = first; k < first + joint_nv(model.body(b).joint_type); ++k) act(k);
  }
}

}  // namespace

/// Computes P of all columns with another velocity (nv).
void TreeSweep::find_columns(const Model& model, const Tree& tree, const double* velocity,
                             Motion Column::*out) {
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    const Body& body = model.body(i);
    Motion V = body.parent != 0 ? moving_[body.parent].V : Motion();
    const int linear = joint_num_linear(body.joint_type), nv = joint_nv(body.joint_type);
    for (const auto& [begin, end] : {std::pair(0, linear), std::pair(linear, nv)}) {
      Motion across;
      for (int k = body.v_index + begin; k < body.v_index + end; ++k) {
        columns_[k].*out = cross(V, columns_[k].S);
        across += columns_[k].S * velocity[k];
      }
      V += across;
    }
    moving_[i].V = V;
  }
}

void TreeSweep::add_coupling(const Model& model, int body, int by, const BodyResponse& response,
                             SweepOutput out) const {
  for_each_coordinate(model, by, [&](int k) {
    const Column& column = columns_[k];
    const Vector6 S = stacked(column.S);
    const Vector6 next = response.next * S, v = response.v * S;
    const Vector6 q = response.q * S + response.next * stacked(column.P_next) +
                      response.v * stacked(column.P_start);
    for_each_coordinate(model, body, [&](int j) {
      const Vector6 along = stacked(columns_[j].S);
      out.dq(j, k) += along.dot(q);
      out.dnext(j, k) += along.dot(next);
      out.dv(j, k) += along.dot(v);
    });
  });
}

void TreeSweep::add_force_rows(const Model& model, const ForceByMotion& force,
                               SweepOutput out) const {
  for_each_coordinate(model, force.by, [&](int k) {
    const Column& column = columns_[k];
    const Vector6 S = stacked(column.S);
    out.dq.col(k).segment<3>(force.row) +=
        force.q * S + force.next * stacked(column.P_next) + force.v * stacked(column.P_start);
    out.dnext.col(k).segment<3>(force.row) += force.next * S;
    out.dv.col(k).segment<3>(force.row) += force.v * S;
  });
}

void TreeSweep::add_by_speed(const Model& model, std::span<const ForceBySpeed> forces,
                             std::span<const SpeedByMotion> motions, SweepOutput out) {
  rows_.clear();
  for (const ForceBySpeed& f : forces) {
    for_each_coordinate(model, f.body, [&](int j) {
      double& along = along_[static_cast<size_t>(j)];
      if (!carries_[static_cast<size_t>(j)]) {
        carries_[static_cast<size_t>(j)] = 1;
        rows_.push_back(j);
        along = 0.0;
      }
      along += f.force.dot(stacked(columns_[j].S));
    });
  }
  for (const SpeedByMotion& m : motions) {
    for_each_coordinate(model, m.body, [&](int k) {
      const Vector6 S = stacked(columns_[k].S);
      const double q = m.q.dot(S) + m.v.dot(stacked(columns_[k].P_start)), v = m.v.dot(S);
      for (const int j : rows_) {
        out.dq(j, k) += along_[static_cast<size_t>(j)] * q;
        out.dv(j, k) += along_[static_cast<size_t>(j)] * v;
      }
    });
  }
  for (const int j : rows_) carries_[static_cast<size_t>(j)] = 0;
}

void TreeSweep::find_response_columns(const Model& model, const Tree& tree, const SweepInput& in) {
  find_columns(model, tree, in.v_next, &Column::P_next);
  if (in.responds_to_v) find_columns(model, tree, in.v_start, &Column::P_start);
}

/// Lists the coordinates that carry a body but not `common`, from the body inwards. Returns their
/// number.
int TreeSweep::list_columns(const Model& model, int body, int common, int* list) const {
  int size = 0;
  for (int b = body; b != common; b = model.body(b).parent)
    for (int k = joint_nv(model.body(b).joint_type); k-- > 0;)
      list[size++] = model.body(b).v_index + k;
  return size;
}

// Let D be the derivative of the wrench W on B by a displacement of B, C that of carrying W along.
// The wrench on a row's body changes with a column's displacement as follows:
// * row and column of B: D, minus C if the row's axis is carried along too (the same joint, or one
// farther out);
// * row and column of A: D, minus C if the row's axis is not carried along;
// * row of B, column of A: C - D;
// * row of A, column of B: -D. Joints that carry both bodies enter only through the velocities at
// the start, on which W depends for each body separately.
void TreeSweep::add_inner_pair(const Model& model, const InnerPair& pair, SweepOutput out) {
  int a = pair.body_a, b = pair.body_b;
  while (a != b) (a > b ? a : b) = model.body(a > b ? a : b).parent;
  const int of_a = list_columns(model, pair.body_a, a, own_.data());
  const int count = of_a + list_columns(model, pair.body_b, a, own_.data() + of_a);
  for (int c = 0; c < count; ++c) {
    const int k = own_[c];
    const bool by_a = c < of_a;
    const Column& column = columns_[k];
    const Vector6 S = stacked(column.S), CS = pair.carried * S;
    const Vector6 next = pair.next * S;
    Vector6 q = pair.displaced * S + pair.next * stacked(column.P_next);
    Vector6 v = Vector6::Zero();
    if (pair.by_v) {
      v = by_a ? Vector6(-(pair.v_a * S)) : Vector6(pair.v_b * S);
      const Vector6 P = stacked(column.P_start);
      q += by_a ? Vector6(-(pair.v_a * P)) : Vector6(pair.v_b * P);
    }
    const int group = column.group;
    for (int r = 0; r < count; ++r) {
      const int j = own_[r];
      const bool of_row_a = r < of_a, same_side = of_row_a == by_a;
      const Vector6 along = stacked(columns_[j].S);
      const double sign = same_side ? -1.0 : 1.0;  // sign in -J'W
      double dq = sign * along.dot(q);
      const bool carried_along = j >= group;
      if (same_side ? carried_along != by_a : by_a) dq += (same_side ? 1.0 : -1.0) * along.dot(CS);
      out.dq(j, k) += dq;
      out.dnext(j, k) += sign * along.dot(next);
      if (pair.by_v) out.dv(j, k) += sign * along.dot(v);
    }
  }
  if (!pair.by_v) return;
  const Matrix6 both = pair.v_a + pair.v_b;
  for_each_coordinate(model, a, [&](int k) {
    const Vector6 q = both * stacked(columns_[k].P_start), v = both * stacked(columns_[k].S);
    for (int r = 0; r < count; ++r) {
      const Vector6 along = stacked(columns_[own_[r]].S) * (r < of_a ? 1.0 : -1.0);
      out.dq(own_[r], k) += along.dot(q);
      out.dv(own_[r], k) += along.dot(v);
    }
  });
}

}  // namespace counterpoint
