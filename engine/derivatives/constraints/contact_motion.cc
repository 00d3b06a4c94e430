#include "counterpoint/engine/derivatives/constraints/contact_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/collision/pairs/corner_contacts.h"
#include "counterpoint/collision/pairs/pair_motion.h"
#include "counterpoint/engine/derivatives/constraints/closed_forms.h"
#include "counterpoint/engine/derivatives/constraints/pair_response.h"
#include "counterpoint/engine/derivatives/dynamics/right_jacobian.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

/// Difference step [m]: kGapShare of the gap, since normals of corners rotate about a radius of the
/// gap; at most kSizeShare of the smallest length of the two shapes, at least kLeastStep.
/// Rotations: this step over that length [rad].
constexpr double kGapShare = 1e-4, kSizeShare = 4e-6, kLeastStep = 1e-8;
/// Largest distance of a neighbouring contact, in difference steps (on rims of cylinders contacts
/// slide fast).
constexpr double kFarthest = 1e3;

double smallest_length(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      return std::numeric_limits<double>::infinity();
    case ShapeType::kConvexMesh:
      return 0.1 * shape.mesh->radius;
    case ShapeType::kSphere:
      return shape.size.x();
    case ShapeType::kCapsule:
    case ShapeType::kCylinder:
      return std::min(shape.size.x(), std::max(shape.size.y(), 0.1 * shape.size.x()));
    case ShapeType::kBox:
      return shape.size.minCoeff();
  }
  return 1.0;
}

/// Returns the contact of `manifold` that corresponds to contact `index` of `here`: the one of that
/// index if both have as many contacts, else the one closest to `expected`; null if it is farther
/// away than `most` [m].
const collision::ContactPoint* like(const collision::Manifold& here, int index,
                                    const collision::Manifold& manifold, const Vector3& expected,
                                    double most) {
  if (manifold.size == here.size &&
      (manifold.points[index].position - expected).squaredNorm() < most * most)
    return &manifold.points[index];
  const collision::ContactPoint* best = nullptr;
  double least = most * most;
  for (int i = 0; i < manifold.size; ++i) {
    const double distance = (manifold.points[i].position - expected).squaredNorm();
    if (distance > least) continue;
    least = distance;
    best = &manifold.points[i];
  }
  return best;
}

/// Returns X moved by `by` along component `column` (0 ... 5: angular, linear) of a twist about a
/// point.
Pose turned_about(const Vector3& at, const Pose& X, int column, double by) {
  if (column >= 3) return {X.rotation, X.translation + by * Vector3::Unit(column - 3)};
  const Matrix3 turn = quaternion_exp(by * Vector3::Unit(column)).toRotationMatrix();
  return {turn * X.rotation, at + turn * (X.translation - at)};
}

/// Converts derivatives of the contact halfway between the surfaces to those of the contact moved
/// towards B, and rotations about one point to rotations about the contact, which is `arm` away.
void finish(const collision::Candidate& contact, double towards_b, const Vector3& arm,
            PlaceMotion& m) {
  if (contact.gap > 0.0) m.point += towards_b * (contact.normal * m.gap + contact.gap * m.normal);
  const Matrix3 lever = skew(arm);
  m.point.leftCols<3>() += m.point.rightCols<3>() * lever;
  m.normal.leftCols<3>() += m.normal.rightCols<3>() * lever;
  m.gap.head<3>() += m.gap.tail<3>() * lever;
}

}  // namespace

void PlaceMotion::set_zero() {
  point.setZero();
  normal.setZero();
  gap.setZero();
}

/// Returns the index of a contact in here_, or -1.
int ContactMotionFinder::index_here(const Pair& pair, const Contact& contact) const {
  const double near = kSamePlace * pair.size;
  int best = -1;
  double least = 3.0 * near;
  for (int i = 0; i < here_.size; ++i) {
    const collision::ContactPoint& p = here_.points[i];
    if (!(p.normal.dot(contact.candidate.normal) > 1.0 - kSamePlace)) continue;
    // Among contacts in the same place the gap decides.
    const double off =
        (p.position - contact.middle).norm() + std::abs(p.gap - contact.candidate.gap);
    if (off >= least) continue;
    least = off;
    best = i;
  }
  return best;
}

/// Finds the contacts of the pair with B in neighbouring poses, rotated about a point.
void ContactMotionFinder::move_pair(const Pair& pair, const Vector3& about, double gap) {
  // A wider margin, so that no contact vanishes at it.
  const collision::PairQuery query(std::abs(gap) + pair.size);
  about_ = about;
  step_ = std::clamp(kGapShare * std::abs(gap), kLeastStep, kSizeShare * pair.size);
  for (int column = 0; column < 6; ++column) {
    const double step = column < 3 ? step_ / pair.size : step_;
    for (const int side : {0, 1})
      collision::pair_contacts(*pair.a, pair.X_WA, *pair.b,
                               turned_about(about_, pair.X_WB, column, side == 0 ? -step : step),
                               query, moved_[column][side]);
  }
}

/// Differentiates a contact of here_ by central differences; rotations are about the point about_.
/// Returns false if a neighbouring pose has no such contact.
bool ContactMotionFinder::difference(const Pair& pair, int index, PlaceMotion& out) const {
  const Vector3& here = here_.points[index].position;
  for (int column = 0; column < 6; ++column) {
    const double step = column < 3 ? step_ / pair.size : step_;
    const collision::ContactPoint* ends[2];
    for (const int side : {0, 1}) {
      ends[side] = like(here_, index, moved_[column][side], here, kFarthest * step_);
      if (ends[side] == nullptr) return false;
    }
    const double inverse = 0.5 / step;
    out.point.col(column) = (ends[1]->position - ends[0]->position) * inverse;
    out.normal.col(column) = (ends[1]->normal - ends[0]->normal) * inverse;
    out.gap[column] = (ends[1]->gap - ends[0]->gap) * inverse;
  }
  return true;
}

/// Differentiates a contact that depends on the poses alone. keep: reuses the contacts in here_ and
/// moved_ if they are of this pair, and leaves them there.
bool ContactMotionFinder::touch(const Pair& pair, const Contact& contact, bool keep,
                                ContactMotion& out) {
  const collision::Candidate& c = contact.candidate;
  if (pair.a->type == ShapeType::kPlane &&
      touches_plane(*pair.b, pair.X_WB, c, contact.towards_b, -1.0, out))
    return true;
  if (pair.b->type == ShapeType::kPlane &&
      touches_plane(*pair.a, pair.X_WA, c, contact.towards_b, 1.0, out))
    return true;
  if (rounds_touch(*pair.a, pair.X_WA, *pair.b, pair.X_WB, c, contact.towards_b, out)) return true;
  const bool known = keep && !ahead_ && c.geometry_a == geometry_a_ && c.geometry_b == geometry_b_;
  int index = known ? index_here(pair, contact) : -1;
  if (index < 0) {
    geometry_a_ = geometry_b_ = -1;
    const collision::PairQuery query(std::abs(c.gap) + pair.size);
    collision::pair_contacts(*pair.a, pair.X_WA, *pair.b, pair.X_WB, query, here_);
    index = index_here(pair, contact);
    if (index < 0) return false;
    move_pair(pair, c.position, c.gap);
    if (keep) {
      geometry_a_ = c.geometry_a;
      geometry_b_ = c.geometry_b;
      ahead_ = false;
    }
  }
  if (!difference(pair, index, out)) return false;
  finish(c, contact.towards_b, c.position - about_, out);
  return true;
}

/// Differentiates contacts of corners taken as points and of balls inside shapes
/// (corner_contacts.h).
bool ContactMotionFinder::touch_stand_ins(const Pair& pair, const Contact& contact,
                                          ContactMotion& out) {
  for (const bool of_a : {true, false}) {
    const Shape& shape = of_a ? *pair.a : *pair.b;
    if (shape.type == ShapeType::kTerrain || shape.type == ShapeType::kPlane) continue;
    const collision::StandIns balls = collision::stand_ins(shape, of_a ? pair.X_WA : pair.X_WB);
    for (int i = 0; i < balls.size; ++i) {
      Pair with_ball = pair;
      (of_a ? with_ball.a : with_ball.b) = &balls.balls[i].shape;
      (of_a ? with_ball.X_WA : with_ball.X_WB) = balls.balls[i].X;
      const bool on_terrain =
          pair.a->type == ShapeType::kTerrain || pair.b->type == ShapeType::kTerrain;
      if (on_terrain ? touch_terrain(with_ball, contact, out)
                     : touch(with_ball, contact, false, out))
        return true;
    }
  }
  return false;
}

// Returns the index of this contact among those that the pair has after its motion, or -1.
int ContactMotionFinder::index_ahead(const Pair& pair, const Pair& after, const Contact& contact,
                                     const collision::PairMotion& motion) {
  const collision::Candidate& c = contact.candidate;
  collision::Manifold taken_back;
  const auto find_index = [&] {
    taken_back = here_;
    for (int i = 0; i < here_.size; ++i) taken_back.points[i] = motion.taken_back(here_.points[i]);
    std::swap(taken_back, here_);
    const int index = index_here(pair, contact);
    std::swap(taken_back, here_);
    return index;
  };
  const bool known = ahead_ && c.geometry_a == geometry_a_ && c.geometry_b == geometry_b_;
  int index = known ? find_index() : -1;
  if (index < 0) {
    geometry_a_ = geometry_b_ = -1;
    const collision::PairQuery query(std::abs(c.gap) + pair.size);
    collision::pair_contacts(*after.a, after.X_WA, *after.b, after.X_WB, query, here_);
    index = find_index();
    if (index < 0) return index;
    move_pair(after, here_.points[index].position, here_.points[index].gap);
    geometry_a_ = c.geometry_a;
    geometry_b_ = c.geometry_b;
    ahead_ = true;
  }
  return index;
}

// Displacements D_A, D_B of the shapes after the motion, caused by a displacement m of B relative
// to A and by changes dV_A, dV_B of the velocities, in axes that move with A:
//
//   D_A = G_A dV_A,    D_B = m + G_B (dV_B - m x V_B)
//
// G dV rotates by h J_l(h omega) d omega, J_l the left Jacobian of the exponential map, about the
// position that the body's origin reaches, and moves this position by h dv. The contact after the
// motion follows D_A and D_B. It is then taken back to the start, linearly in the displacements
// h V of its own place. Long: one chain of derivatives.
bool ContactMotionFinder::touch_ahead(const Pair& pair, const Contact& contact,
                                      const collision::PairMotion& motion, const Motion& V_a,
                                      const Motion& V_b, double h, ContactMotion& out) {
  using Rows18 = Eigen::Matrix<double, 3, 18>;
  using Row18 = Eigen::Matrix<double, 1, 18>;
  using Rows6x18 = Eigen::Matrix<double, 6, 18>;
  const collision::Candidate& c = contact.candidate;
  const Pair after{pair.a, pair.b, motion.a.moved(), motion.b.moved(), pair.size};
  const int index = index_ahead(pair, after, contact, motion);
  if (index < 0) return false;
  PlaceMotion raw;
  if (!difference(after, index, raw)) return false;
  const collision::ContactPoint& p = here_.points[index];
  // Displacements D_A, D_B at about_, by (m, dV_A, dV_B) at the contact.
  Rows6x18 D_a = Rows6x18::Zero(), D_b = Rows6x18::Zero();
  const auto at = [&](const Vector3& point) {  // maps motions at the contact to motions at `point`
    Matrix6 X = Matrix6::Identity();
    X.bottomLeftCorner<3, 3>() = -skew(point - c.position);
    return X;
  };
  const auto follow = [&](const collision::ShapeMotion& shape) {
    const Matrix3 turn = h * right_jacobian(shape.displacement.angular).transpose();
    const Vector3 arrived = shape.origin + shape.displacement.linear;
    Matrix6 G = h * at(shape.origin);
    G.topLeftCorner<3, 3>() = turn;
    G.bottomLeftCorner<3, 3>() -= skew(about_ - arrived) * turn;
    return G;
  };
  const Matrix6 G_b = follow(motion.b);
  D_a.middleCols<6>(6) = follow(motion.a);
  D_b.leftCols<6>() = at(about_) + G_b * motion_cross(V_b);
  D_b.rightCols<6>() = G_b;
  const Rows6x18 apart = D_b - D_a;
  Rows18 point = raw.point * apart, normal = raw.normal * apart;
  const Row18 gap = raw.gap * apart;
  point += D_a.bottomRows<3>() - skew(p.position - about_) * D_a.topRows<3>();
  normal -= skew(p.normal) * D_a.topRows<3>();
  // Back to the start by displacements h V, at a place that moves itself.
  const auto way = [&](const Motion& V, int columns, const Vector3& place, const Rows18& moves) {
    Rows18 by = h * skew(V.angular) * moves;
    by.middleCols<6>(columns) += h * at(place).bottomRows<3>();
    return by;
  };
  const Vector3 n = p.normal;
  const Vector3 k = (0.5 - motion.a.share) * motion.a.way_of(p.position) +
                    (0.5 - motion.b.share) * motion.b.way_of(p.position);
  const Rows18 way_a = way(V_a, 6, p.position, point), way_b = way(V_b, 12, p.position, point);
  const Rows18 carried = motion.a.share * way_a + motion.b.share * way_b;
  const Rows18 by_k = 0.5 * (way_a + way_b) - carried;
  Rows18 place = point - carried - n.dot(k) * normal;
  place -= n * (k.transpose() * normal + n.transpose() * by_k);
  const Vector3 back = contact.middle;
  const Vector3 closing = motion.a.way_of(back) - motion.b.way_of(back);
  const Row18 by_gap = gap + closing.transpose() * normal +
                       n.transpose() * (way(V_a, 6, back, place) - way(V_b, 12, back, place));
  if (c.gap > 0.0) place += contact.towards_b * (n * by_gap + c.gap * normal);
  const auto put = [&](int column, PlaceMotion& to) {
    to.point = place.middleCols<6>(column);
    to.normal = normal.middleCols<6>(column);
    to.gap = by_gap.middleCols<6>(column);
  };
  put(0, out);
  put(6, out.v_a);
  put(12, out.v_b);
  out.by_v = true;
  return true;
}

bool ContactMotionFinder::find(const Model& model, const Kinematics& data,
                               const collision::Collider& collider,
                               const collision::BodyMotions& motions,
                               const collision::Candidate& contact, double towards_b,
                               ContactMotion& out) {
  const Geometry& a = model.geometries()[contact.geometry_a];
  const Geometry& b = model.geometries()[contact.geometry_b];
  const Pair pair{&a.shape, &b.shape, data.X_WB[a.body] * a.X_BG, data.X_WB[b.body] * b.X_BG,
                  std::min(smallest_length(a.shape), smallest_length(b.shape))};
  const Contact at{contact,
                   contact.position - towards_b * std::max(contact.gap, 0.0) * contact.normal,
                   towards_b};
  out.by_v = false;
  if (a.shape.type == ShapeType::kTerrain || b.shape.type == ShapeType::kTerrain)
    return touch_terrain(pair, at, out) || touch_stand_ins(pair, at, out);
  // If one contact of two shapes is taken after their motion, all of them are.
  const auto motion =
      collider.pair_motion(data.X_WB, contact.geometry_a, contact.geometry_b, motions);
  const auto ahead = [&] {
    const auto at_contact = [&](int body) {
      return Motion{data.V[body].angular,
                    data.V[body].at(contact.position - data.X_WB[body].translation)};
    };
    return motion && touch_ahead(pair, at, *motion, at_contact(a.body), at_contact(b.body),
                                 motions.time_step, out);
  };
  const bool first =
      ahead_ && contact.geometry_a == geometry_a_ && contact.geometry_b == geometry_b_;
  if (first && ahead()) return true;
  return touch(pair, at, true, out) || (!first && ahead()) || touch_stand_ins(pair, at, out);
}

}  // namespace counterpoint
