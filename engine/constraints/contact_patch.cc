#include "counterpoint/engine/constraints/contact_patch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

using Vector2 = Eigen::Vector2d;

/// Speed that counts as rest, as a fraction of max_recovery_speed.
constexpr double kAtRest = 1e-4;
/// Value of s below which there is no spin.
constexpr double kNoSpin = 1e-6;
/// A patch excludes contacts with a gap of at least kOpen times the size of the smaller body, or
/// kReach h^2, the distance covered in a step at this acceleration [m/s^2].
constexpr double kOpen = 1e-3, kReach = 500.0;
/// Largest 1 - cosine between normals of one plane.
constexpr double kOnePlane = 1e-9;
/// (|difference| / sum of the second moments)^kSlender is nearly 1 for a line and nearly 0 for a
/// face.
constexpr int kSlender = 64;

/// Whether the patch is the end face of a cylinder that stands on its rim, around its axis.
bool is_round_face(const Model& model, const Kinematics& data, const collision::Candidate& contact,
                   const ContactPatch& patch) {
  for (const int index : {contact.geometry_a, contact.geometry_b}) {
    const Geometry& g = model.geometries()[static_cast<size_t>(index)];
    if (g.shape.type != ShapeType::kCylinder) continue;
    const Pose X = data.X_WB[g.body] * g.X_BG;
    const Vector3 axis = X.rotation.col(2);
    if (std::abs(axis.dot(patch.normal)) < 1.0 - kOpen * kOpen) continue;
    const double radius = g.shape.size[0];
    bool on_rim = true;
    Vector3 sum = Vector3::Zero();
    for (int k = 0; k < patch.size; ++k) {
      const Vector3 arm = patch.place[k] - X.translation, from_axis = arm - axis.dot(arm) * axis;
      on_rim = on_rim && std::abs(from_axis.norm() - radius) < kOpen * radius;
      sum += from_axis;
    }
    if (on_rim && sum.norm() < kOpen * radius) return true;
  }
  return false;
}

/// Whether no spin share of a patch can be positive: it turns about its normal too slowly for any
/// radius that its contacts span.
bool turns_too_slowly(const ContactPatch& patch) {
  double square = 0.0;
  for (int k = 1; k < patch.size; ++k)
    square = std::max(square, (patch.place[k] - patch.place[0]).squaredNorm());
  const double turn = patch.normal.dot(patch.motion.angular);
  return 4.0 * square * turn * turn < kNoSpin * patch.at_rest * patch.at_rest;
}

/// Spin fraction sigma of a patch; radius: mean distance of its contacts from its middle [m].
double spin_share(const ContactPatch& patch, const Vector3& middle, double radius) {
  const Vector3& n = patch.normal;
  const double rim = n.dot(patch.motion.angular) * radius;
  Vector3 v = patch.motion.at(middle);
  v -= n.dot(v) * n;
  const double slides = v.squaredNorm() + patch.at_rest * patch.at_rest;
  const double spins = rim * rim - kNoSpin * slides;
  return spins > 0.0 ? spins / (spins + slides) : 0.0;
}

}  // namespace

size_t find_patch(const StepContext& at, const Kinematics& data, const ConstraintSet& set,
                  std::span<const double> radii, size_t first, ContactPatch& out) {
  const PairConstraint& one = set.pairs[first];
  const collision::Candidate& pair_of = set.contacts[first];
  out.size = 0;
  out.normal = one.frame.col(0);
  double size = std::numeric_limits<double>::infinity();
  for (const int body : {one.body_a, one.body_b})
    if (body != 0) size = std::min(size, 2.0 * radii[static_cast<size_t>(body)]);
  // Independent of the search margin of contacts (ContactOptions::reach_acceleration).
  out.reach = std::min(kOpen * size, kReach * at.h() * at.h());
  out.at_rest = kAtRest * at.options.contact.max_recovery_speed;
  bool is_one = true;
  out.spread = true;
  size_t last = first;
  for (; last < set.contacts.size(); ++last) {
    const collision::Candidate& c = set.contacts[last];
    if (c.geometry_a != pair_of.geometry_a || c.geometry_b != pair_of.geometry_b) break;
    if (!(c.gap < out.reach)) continue;
    const PairConstraint& pair = set.pairs[last];
    out.spread = out.spread && c.area > 0.0;
    is_one = is_one && out.size < ContactPatch::kMost && pair.law.rows >= 3 &&
             !contact::leans(pair.law) && pair.frame.col(0).dot(out.normal) > 1.0 - kOnePlane;
    if (!is_one) continue;
    out.contact[out.size] = last;
    out.place[out.size] = pair.position;
    out.gap[out.size++] = c.gap;
  }
  if (!is_one || out.size < 2) {
    out.size = 0;
    return last;
  }
  const auto of_body = [&](int body) {
    if (body == 0) return Motion{};
    const Motion& V = data.V[body];
    return Motion{V.angular, V.at(-data.X_WB[body].translation)};
  };
  out.motion = of_body(one.body_b) - of_body(one.body_a);
  out.motion.linear += one.law.bias[1] * one.frame.col(1) + one.law.bias[2] * one.frame.col(2);
  out.round = is_round_face(at.model, data, pair_of, out);
  return last;
}

bool find_friction(const ContactPatch& patch, PatchFriction& out) {
  if (turns_too_slowly(patch)) return false;
  std::array<double, ContactPatch::kMost> weight;
  double sum = 0.0;
  int touching = 0;
  Vector3 middle = Vector3::Zero();
  for (int k = 0; k < patch.size; ++k) {
    const double share = std::max(patch.gap[k], 0.0) / patch.reach;
    const double left = share < 1.0 ? 1.0 - share * share : 0.0;
    weight[k] = left * left;
    touching += weight[k] > 0.0;
    sum += weight[k];
    middle += weight[k] * patch.place[k];
  }
  if (touching < 2) return false;
  middle /= sum;
  const Eigen::Matrix<double, 2, 3> plane =
      frame_from_normal(patch.normal).leftCols<2>().transpose();
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  double radius = 0.0;
  // A contact that fades out moves to the middle, where it adds nothing to the face.
  std::array<Vector2, ContactPatch::kMost> corners;
  for (int k = 0; k < patch.size; ++k) {
    const Vector2 place = plane * (patch.place[k] - middle);
    moments += weight[k] * place * place.transpose();
    radius += weight[k] / sum * place.norm();
    corners[k] = weight[k] * place;
  }
  const double trace = moments.trace();
  if (!(trace > 0.0)) return false;
  const double sigma = spin_share(patch, middle, radius);
  if (!(sigma > 0.0)) return false;
  const double apart = std::hypot(moments(0, 0) - moments(1, 1), 2.0 * moments(0, 1));
  const double slender = std::pow(apart / trace, kSlender);
  const double even =
      patch.spread ? radius
                   : mean_distance({corners.data(), static_cast<size_t>(patch.size)}, patch.round);
  const double less = (1.0 - slender) * std::max(0.0, 1.0 - even / radius) * sigma;
  const Vector3& n = patch.normal;
  for (int k = 0; k < patch.size; ++k) {
    const Vector3 arm = patch.place[k] - middle, along = arm - n.dot(arm) * n;
    out.strength[k] = 1.0 - weight[k] * less;
    out.friction_point[k] = weight[k] * sigma * slender * (0.5 * n.cross(along) - along);
  }
  return true;
}

double mean_distance(std::span<const Eigen::Vector2d> corners, bool round) {
  // The mean distance within the triangle of the origin and an edge is two thirds of that along the
  // edge, which Simpson's rule on kParts parts gives to 1e-4.
  std::array<Vector2, ContactPatch::kMost> p;
  const size_t count = corners.size();
  std::copy(corners.begin(), corners.end(), p.begin());
  const auto angle = [](const Vector2& corner) { return std::atan2(corner.y(), corner.x()); };
  for (size_t i = 1; i < count; ++i)
    for (size_t j = i; j > 0 && angle(p[j]) < angle(p[j - 1]); --j) std::swap(p[j], p[j - 1]);
  double area = 0.0, moment = 0.0, longest = 0.0;
  for (size_t k = 0; k < count; ++k) longest = std::max(longest, p[k].norm());
  if (round) return 2.0 / 3.0 * longest;
  for (size_t k = 0; k < count; ++k) {
    const Vector2 &a = p[k], &b = p[(k + 1) % count];
    const double triangle = 0.5 * std::abs(a.x() * b.y() - a.y() * b.x());
    constexpr int kParts = 8;
    double along = 0.0;
    for (int j = 0; j <= kParts; ++j) {
      const double share = double(j) / kParts, of = j == 0 || j == kParts ? 1.0 : j % 2 ? 4.0 : 2.0;
      along += of / (3.0 * kParts) * ((1.0 - share) * a + share * b).norm();
    }
    area += triangle;
    moment += 2.0 / 3.0 * along * triangle;
  }
  return area > 1e-12 * longest * longest ? moment / area : 0.5 * longest;
}

void spread_friction(const StepContext& at, const Kinematics& data, std::span<const double> radii,
                     ConstraintSet& out) {
  ContactPatch patch;
  PatchFriction friction;
  for (size_t first = 0; first < out.contacts.size();) {
    first = find_patch(at, data, out, radii, first, patch);
    if (patch.size == 0 || !find_friction(patch, friction)) continue;
    for (int k = 0; k < patch.size; ++k) {
      PairConstraint& pair = out.pairs[patch.contact[k]];
      pair.friction_point = friction.friction_point[k];
      pair.strength = friction.strength[k];
      for (size_t i = 0; i < 2; ++i) pair.law.friction[i] *= pair.strength;
      pair.spins = true;
    }
  }
}

}  // namespace counterpoint
