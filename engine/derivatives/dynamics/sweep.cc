#include "counterpoint/engine/derivatives/dynamics/sweep.h"

#include <algorithm>

#include "counterpoint/contact/lanes/vector_lanes.h"
#include "counterpoint/engine/dynamics/gravity_compensation.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

using contact::Four;

// Components of the columns on a path, each a row of `stride` numbers.
enum Field { kS = 0, kD = 6, kP = 12, kPP = 15, kPNext = 21, kPStart = 27, kFields = 33 };
// Rows of the products of all columns on a path with the vectors of one column.
enum Product { kMass, kDown, kDownV, kUp, kUpV, kNext, kNextUp, kProducts };

/// Adds to sum, for four columns, the products of `size` components with x.
template <int size>
COUNTERPOINT_INTO_EACH void add_dot(const double* rows, int stride, const double* x, Four& sum) {
  COUNTERPOINT_UNROLL
  for (int i = 0; i < size; ++i) {
    Four row;
    contact::load(rows + i * stride, row);
    sum += row * x[i];
  }
}

/// Force vectors of one column, to be multiplied with all columns on its path.
struct ColumnForces {
  double mass[6];  ///< I S
  double v[6];     ///< product with S_j: dtau_j/dv
  double q[6];     ///< product with S_j: dtau_j/dq
  double b[3];     ///< angular part of S' 2 B
  double b_v[3];   ///< b times the velocity factor, for dtau/dv
};

COUNTERPOINT_WIDE void multiply_path(const double* path, int stride, int count,
                                     const ColumnForces& x, double* out) {
  for (int s = 0; s < count; s += 4) {
    const double* at = path + s;
    Four mass{}, up{}, up_v{}, down{}, down_v{};
    add_dot<6>(at + kS * stride, stride, x.mass, mass);
    add_dot<6>(at + kS * stride, stride, x.v, up_v);
    add_dot<6>(at + kS * stride, stride, x.q, up);
    add_dot<6>(at + kD * stride, stride, x.mass, down_v);
    add_dot<3>(at + kS * stride, stride, x.b_v, down_v);
    add_dot<6>(at + kPP * stride, stride, x.mass, down);
    add_dot<3>(at + kP * stride, stride, x.b, down);
    contact::store(mass, out + kMass * stride + s);
    contact::store(up, out + kUp * stride + s);
    contact::store(up_v, out + kUpV * stride + s);
    contact::store(down, out + kDown * stride + s);
    contact::store(down_v, out + kDownV * stride + s);
  }
}

/// Products of a response K with one column S.
struct ResponseForces {
  double q[6], next[6], v[6];  ///< S' K
  double next_up[6];           ///< K S
};

COUNTERPOINT_WIDE void multiply_responses(const double* path, int stride, int count, bool by_v,
                                          const ResponseForces& x, double* out) {
  for (int s = 0; s < count; s += 4) {
    const double* at = path + s;
    Four next{}, next_up{}, down, down_v;
    add_dot<6>(at + kS * stride, stride, x.next, next);
    add_dot<6>(at + kS * stride, stride, x.next_up, next_up);
    contact::load(out + kDown * stride + s, down);
    add_dot<6>(at + kS * stride, stride, x.q, down);
    add_dot<6>(at + kPNext * stride, stride, x.next, down);
    if (by_v) {
      contact::load(out + kDownV * stride + s, down_v);
      add_dot<6>(at + kPStart * stride, stride, x.v, down);
      add_dot<6>(at + kS * stride, stride, x.v, down_v);
      contact::store(down_v, out + kDownV * stride + s);
    }
    contact::store(next, out + kNext * stride + s);
    contact::store(next_up, out + kNextUp * stride + s);
    contact::store(down, out + kDown * stride + s);
  }
}

void put(const Force& f, double* out) {
  for (int i = 0; i < 3; ++i) out[i] = f.torque[i];
  for (int i = 0; i < 3; ++i) out[3 + i] = f.force[i];
}

void add(const Vector6& f, double* out) {
  for (int i = 0; i < 6; ++i) out[i] += f[i];
}

void put(const Motion& m, int stride, double* out) {
  for (int i = 0; i < 3; ++i) out[i * stride] = m.angular[i];
  for (int i = 0; i < 3; ++i) out[(3 + i) * stride] = m.linear[i];
}

}  // namespace

void BodyResponse::move(const Vector3& p) {
  // X' K X with X = (1, 0; -[p], 1), which maps twists at the new point to twists at the old one.
  const Matrix3 s = skew(p);
  for (Matrix6* K : {&q, &next, &v}) {
    K->leftCols<3>() -= K->rightCols<3>() * s;
    K->topRows<3>() += s * K->bottomRows<3>();
  }
}

TreeSweep::TreeSweep(const Model& model)
    : columns_(model.nv()),
      composites_(model.num_bodies()),
      moving_(model.num_bodies()),
      responses_(model.num_bodies()),
      responds_(model.num_bodies(), 0),
      first_slot_(model.num_bodies(), 0) {
  int longest = 0;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (body.parent != 0)
      first_slot_[i] = first_slot_[body.parent] + joint_nv(model.body(body.parent).joint_type);
    longest = std::max(longest, first_slot_[i] + joint_nv(body.joint_type));
  }
  stride_ = (longest + 3) / 4 * 4;
  path_.assign(static_cast<size_t>(kFields * stride_), 0.0);
  path_column_.assign(static_cast<size_t>(stride_), 0);
  path_body_.assign(static_cast<size_t>(stride_), 0);
  own_.assign(static_cast<size_t>(2 * stride_), 0);
  rows_.reserve(static_cast<size_t>(model.nv()));
  carries_.assign(static_cast<size_t>(model.nv()), 0);
  along_.assign(static_cast<size_t>(model.nv()), 0.0);
  products_.assign(static_cast<size_t>(kProducts * stride_), 0.0);
}

/// Adds columns along axes of the parent, which turn with the parent.
void TreeSweep::add_translations(const Body& body, int first, int count, const Kinematics& data,
                                 const SweepInput& in, Moving& moving) {
  const Vector3 omega = moving.V.angular, alpha = moving.A.angular;
  for (int j = 0; j < count; ++j) {
    const int k = body.v_index + first + j;
    const Vector3& e = data.axis[k].linear;
    Column& column = columns_[k];
    column.group = body.v_index + first;
    const Vector3 turned = omega.cross(e);
    column.S = {Vector3::Zero(), e};
    column.P = {Vector3::Zero(), turned};
    column.D = {Vector3::Zero(), 2.0 * turned};
    column.PP = {Vector3::Zero(), alpha.cross(e) + omega.cross(turned)};
    moving.V.linear += in.v[k] * e;
    moving.A.linear += in.a[k] * e + in.v[k] * turned;
  }
}

/// Adds columns about axes through the body's origin, which is at `origin` from the reference. If
/// there are several, their axes are fixed in the body.
void TreeSweep::add_rotations(const Body& body, int first, int count, const Vector3& origin,
                              const Kinematics& data, const SweepInput& in, Moving& moving) {
  const Motion V = moving.V, A = moving.A;
  Motion across, rate;
  const int group = body.v_index + first;
  for (int j = 0; j < count; ++j) {
    const int k = body.v_index + first + j;
    Column& column = columns_[k];
    const Vector3& e = data.axis[k].angular;
    column.group = group;
    column.S = {e, origin.cross(e)};
    column.P = cross(V, column.S);
    column.PP = cross(A, column.S) + cross(V, column.P);
    across += column.S * in.v[k];
    rate += column.S * in.a[k];
  }
  moving.V += across;
  moving.A += rate + cross(V, across);
  for (int j = 0; j < count; ++j) {
    Column& column = columns_[body.v_index + first + j];
    column.D = count == 1 ? column.P * 2.0 : column.P + cross(moving.V, column.S);
  }
}

void TreeSweep::set_composite(int i, const Vector3& origin, const Kinematics& data,
                              const SweepInput& in) {
  Composite& c = composites_[i];
  const Motion& V = moving_[i].V;
  c.I = RigidInertia::about_origin(data.inertia[i]);
  c.I.move(origin);
  const Force momentum = c.I * V;
  c.f = c.I * moving_[i].A + cross(V, momentum);
  if (in.load != nullptr) c.f -= shift(in.load[i], origin);
  c.p = momentum.force;
  // Second moments sum mu r r', from the rotational inertia sum mu (r.r 1 - r r').
  const Matrix3& J = c.I.rotational;
  const Matrix3 second = 0.5 * J.trace() * Matrix3::Identity() - J;
  c.N = -V.linear * c.I.moment.transpose() - cross_columns(V.angular, second);
  c.N.diagonal().array() += c.I.moment.dot(V.linear);
}

/// Outward pass: columns of the joints, motion and inertia of the bodies.
void TreeSweep::go_out(const Model& model, const Tree& tree, const Kinematics& data,
                       const SweepInput& in) {
  const Vector3 reference = TreeSweep::reference(tree, data);
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    const Body& body = model.body(i);
    Moving& moving = moving_[i];
    moving =
        body.parent != 0 ? moving_[body.parent] : Moving{Motion(), {Vector3::Zero(), -in.gravity}};
    const Vector3 origin = data.X_WB[i].translation - reference;
    const int linear = joint_num_linear(body.joint_type);
    const int angular = joint_nv(body.joint_type) - linear;
    if (linear > 0) add_translations(body, 0, linear, data, in, moving);
    if (angular > 0) add_rotations(body, linear, angular, origin, data, in, moving);
    set_composite(i, origin, data, in);
  }
}

/// Copies the columns of a body and its ancestors into the path.
void TreeSweep::enter(const Model& model, int i, const SweepInput& in, bool respond) {
  for (; i != 0; i = model.body(i).parent) {
    const int first = first_slot_[i], nv = joint_nv(model.body(i).joint_type);
    if (path_body_[first] == i) return;
    path_body_[first] = i;
    for (int j = 0; j < nv; ++j) {
      const int k = model.body(i).v_index + j;
      const Column& column = columns_[k];
      double* at = path_.data() + first + j;
      path_column_[first + j] = k;
      put(column.S, stride_, at + kS * stride_);
      put(column.D * in.velocity_factor, stride_, at + kD * stride_);
      for (int c = 0; c < 3; ++c) at[(kP + c) * stride_] = column.P.angular[c];
      put(column.PP, stride_, at + kPP * stride_);
      if (!respond) continue;
      put(column.P_next, stride_, at + kPNext * stride_);
      put(column.P_start, stride_, at + kPStart * stride_);
    }
  }
}

void TreeSweep::write_column(int k, int group_begin, int group_end, const Composite& whole,
                             const BodyResponse* response, const SweepInput& in, SweepOutput& out) {
  const Column& column = columns_[k];
  const Motion &S = column.S, &P = column.P;
  ColumnForces x;
  const Force IS = whole.I * S;
  Force by_v = whole.I * column.D, by_q = whole.I * column.PP;
  by_v += Force{whole.N * S.angular, S.angular.cross(whole.p)} * 2.0;
  by_q += Force{whole.N * P.angular, P.angular.cross(whole.p)} * 2.0;
  by_q += cross(S, whole.f);
  const Vector3 b = 2.0 * (whole.N.transpose() * S.angular + whole.p.cross(S.linear));
  put(IS, x.mass);
  put(by_v * in.velocity_factor, x.v);
  put(by_q, x.q);
  for (int i = 0; i < 3; ++i) {
    x.b[i] = b[i];
    x.b_v[i] = in.velocity_factor * b[i];
  }
  const int count = (group_end + 3) / 4 * 4;
  double* products = products_.data();
  if (response != nullptr) {
    const Vector6 s = stacked(S);
    ResponseForces r;
    add(response->q * s + response->next * stacked(column.P_next), x.q);
    Eigen::Map<Vector6>(r.q) = response->q.transpose() * s;
    Eigen::Map<Vector6>(r.next) = response->next.transpose() * s;
    Eigen::Map<Vector6>(r.next_up) = response->next * s;
    if (in.responds_to_v) {
      add(response->v * stacked(column.P_start), x.q);
      add(response->v * s, x.v);
      Eigen::Map<Vector6>(r.v) = response->v.transpose() * s;
    }
    multiply_path(path_.data(), stride_, count, x, products);
    multiply_responses(path_.data(), stride_, count, in.responds_to_v, r, products);
  } else {
    multiply_path(path_.data(), stride_, count, x, products);
  }
  const auto product = [&](Product row, int s) { return products[row * stride_ + s]; };
  const Eigen::Index nv = out.dq.rows();
  double *dq = out.dq.data(), *dv = out.dv.data(), *dnext = out.dnext.data();
  for (int s = 0; s < group_end; ++s) {
    const Eigen::Index j = path_column_[s], row = j * nv + k, col = k * nv + j;
    const double mass = product(kMass, s);
    const double to_v = in.mass_in_v * mass, to_next = in.mass_in_next * mass;
    dq[row] = product(kDown, s);
    dv[row] = product(kDownV, s) + to_v;
    dnext[row] = to_next + (response != nullptr ? product(kNext, s) : 0.0);
    if (s >= group_begin) continue;
    dq[col] = product(kUp, s);
    dv[col] = product(kUpV, s) + to_v;
    dnext[col] = to_next + (response != nullptr ? product(kNextUp, s) : 0.0);
  }
}

/// Writes the entries of one body's joint with itself and all its ancestors.
void TreeSweep::write_columns(const Model& model, int i, const SweepInput& in, SweepOutput& out) {
  const Body& body = model.body(i);
  const int linear = joint_num_linear(body.joint_type), nv = joint_nv(body.joint_type);
  const BodyResponse* response = responds_[i] ? &responses_[i] : nullptr;
  const int first = first_slot_[i];
  for (int j = 0; j < nv; ++j) {
    const bool turns = j >= linear;
    write_column(body.v_index + j, turns ? first + linear : first,
                 turns ? first + nv : first + linear, composites_[i], response, in, out);
  }
}

bool TreeSweep::add_carried_weight(const Model& model, const Tree& tree, const Kinematics& data,
                                   const Vector3& gravity) {
  if (model.gravity_compensations().empty() || gravity.isZero(0.0)) return false;
  const auto all = compensations_of(model, {tree.body_begin, tree.body_end});
  for (const GravityCompensation& carried : all) {
    const int i = carried.body;
    const Vector3 weight = carried.mass * gravity;
    const Vector3 place =
        data.X_WB[i].translation + arm_of(carried, data) - TreeSweep::reference(tree, data);
    composites_[i].f += Force{place.cross(weight), weight};
    BodyResponse response;  // keeps its axes: cancels the change of being carried along
    response.q.bottomLeftCorner<3, 3>() = skew(weight);
    response.move(place);
    if (responds_[i]) {
      responses_[i] += response;
    } else {
      responses_[i] = response;
      responds_[i] = 1;
    }
  }
  return !all.empty();
}

void TreeSweep::run(const Model& model, const Tree& tree, const Kinematics& data,
                    const SweepInput& in, SweepOutput out) {
  go_out(model, tree, data, in);
  bool respond = false;
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    responds_[i] = in.response != nullptr && in.responds[i];
    if (responds_[i]) responses_[i] = in.response[i];
    respond = respond || responds_[i];
  }
  respond = add_carried_weight(model, tree, data, in.gravity) || respond;
  if (respond && in.v_next != nullptr) find_response_columns(model, tree, in);
  const int size = tree.v_end - tree.v_begin;
  for (MatrixX* m : {&out.dq, &out.dv, &out.dnext}) {
    if (size == m->rows())
      m->setZero();  // one contiguous block
    else
      m->block(tree.v_begin, tree.v_begin, size, size).setZero();
  }
  std::fill(path_body_.begin(), path_body_.end(), 0);
  for (int i = tree.body_end - 1; i >= tree.body_begin; --i) {
    enter(model, i, in, respond);
    write_columns(model, i, in, out);
    const int parent = model.body(i).parent;
    if (parent == 0) continue;
    Composite &to = composites_[parent], &from = composites_[i];
    to.I += from.I;
    to.N += from.N;
    to.p += from.p;
    to.f += from.f;
    if (!responds_[i]) continue;
    if (responds_[parent]) {
      responses_[parent] += responses_[i];
    } else {
      responses_[parent] = responses_[i];
      responds_[parent] = 1;
    }
  }
}

}  // namespace counterpoint
