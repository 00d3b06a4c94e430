#include "counterpoint/engine/constraints/contact_patch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {
namespace {

using Vector2 = Eigen::Vector2d;

/// Slower [m/s] than this, sliding and spinning are one: rest.
constexpr double kAtRest = 1e-4;
/// Below this s there is no spin.
constexpr double kNoSpin = 1e-6;
/// Contacts open by this share of the patch's size and more are none of it.
constexpr double kOpen = 1e-3;
/// Normals of one plane differ by less (1 - cosine).
constexpr double kOnePlane = 1e-9;
/// A line is where the second moments differ by nearly their sum: to this power.
constexpr int kSlender = 64;
/// On a rim, relative to its radius.
constexpr double kOnRim = 1e-6;
constexpr int kMost = 8;

/// Contacts first ... last - 1, of one pair of geometries.
struct Patch {
  std::array<Vector2, kMost> place;  ///< from the middle, in the frame of the first [m]
  std::array<double, kMost> weight;
  int size = 0;
  Vector3 middle = Vector3::Zero();
  double radius = 0.0;   ///< mean distance of its contacts from the middle [m]
  double slender = 0.0;  ///< 1 for a line, about 0 for faces
};

/// False where they are no patch.
bool find_patch(const ContactOptions& options, double h, const ConstraintSet& set, size_t first,
                size_t last, Patch& out) {
  out.size = static_cast<int>(last - first);
  if (out.size < 2 || out.size > kMost) return false;
  const PairConstraint& one = set.pairs[first];
  double size = 0.0;
  for (size_t i = first; i < last; ++i) {
    const PairConstraint& pair = set.pairs[i];
    if (pair.law.rows < 3 || contact::leans(pair.law)) return false;
    if (pair.frame.col(0).dot(one.frame.col(0)) < 1.0 - kOnePlane) return false;
    size = std::max(size, (pair.position - one.position).norm());
  }
  const double reach = std::min(kOpen * size, resting_reach(options, h));
  if (!(reach > 0.0)) return false;
  double sum = 0.0;
  int touching = 0;
  for (size_t i = first; i < last; ++i) {
    const double share = std::max(set.contacts[i].gap, 0.0) / reach;
    const double left = share < 1.0 ? 1.0 - share * share : 0.0;
    const double weight = left * left;
    out.weight[i - first] = weight;
    touching += weight > 0.0;
    sum += weight;
    out.middle += weight * set.pairs[i].position;
  }
  if (touching < 2) return false;
  out.middle /= sum;
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (int k = 0; k < out.size; ++k) {
    out.place[k] = one.frame.rightCols<2>().transpose() *
                   (set.pairs[first + static_cast<size_t>(k)].position - out.middle);
    moments += out.weight[k] * out.place[k] * out.place[k].transpose();
    out.radius += out.weight[k] / sum * out.place[k].norm();
  }
  const double trace = moments.trace(),
               apart = std::hypot(moments(0, 0) - moments(1, 1), 2.0 * moments(0, 1));
  if (!(trace > 0.0)) return false;
  out.slender = std::pow(apart / trace, kSlender);
  return true;
}

/// Of a cylinder that stands on its rim, about whose axis the patch lies: so that it is round.
bool is_round_face(const Model& model, const Data& data, const ConstraintSet& set, size_t first,
                   const Patch& patch) {
  const collision::Candidate& c = set.contacts[first];
  for (const int index : {c.geometry_a, c.geometry_b}) {
    const Geometry& g = model.geometries()[static_cast<size_t>(index)];
    if (g.shape.type != ShapeType::kCylinder) continue;
    const Pose X = data.X_WB[g.body] * g.X_BG;
    const Vector3 axis = X.rotation.col(2), arm = patch.middle - X.translation;
    if (std::abs(axis.dot(set.pairs[first].frame.col(0))) < 1.0 - kOpen * kOpen) continue;
    const double radius = g.shape.size[0];
    if ((arm - axis.dot(arm) * axis).norm() > kOpen * radius) continue;
    bool on_rim = true;
    for (int k = 0; k < patch.size; ++k)
      if (patch.weight[k] > 0.0)
        on_rim = on_rim && std::abs(patch.place[k].norm() - radius) < (kOnRim + kOpen) * radius;
    if (on_rim) return true;
  }
  return false;
}

/// sigma.
double spin_share(const PairConstraint& one, const Patch& patch, const Data& data) {
  const Vector3 n = one.frame.col(0);
  Vector3 spin = Vector3::Zero();
  if (one.body_a != 0) spin -= data.V[one.body_a].angular;
  if (one.body_b != 0) spin += data.V[one.body_b].angular;
  const double rim = n.dot(spin) * patch.radius;
  if (!(rim * rim > kNoSpin * kAtRest * kAtRest)) return 0.0;
  Vector3 v = relative_velocity_at(patch.middle, one.body_a, one.body_b, data, data.V);
  v -= n.dot(v) * n;
  const double s = std::max(0.0, rim * rim / (v.squaredNorm() + kAtRest * kAtRest) - kNoSpin);
  return s / (1.0 + s);
}

void spread(const StepContext& at, const Data& data, size_t first, size_t last,
            ConstraintSet& set) {
  Patch patch;
  if (!find_patch(at.options.contact, at.h(), set, first, last, patch)) return;
  const PairConstraint& one = set.pairs[first];
  const double sigma = spin_share(one, patch, data);
  if (!(sigma > 0.0)) return;
  // What fades goes to the middle, where it is nothing to the face.
  std::array<Vector2, kMost> corners;
  for (int k = 0; k < patch.size; ++k) corners[k] = patch.weight[k] * patch.place[k];
  const bool round = is_round_face(at.model, data, set, first, patch);
  const double even = mean_distance({corners.data(), static_cast<size_t>(patch.size)}, round);
  const double less = (1.0 - patch.slender) * std::max(0.0, 1.0 - even / patch.radius) * sigma;
  const Vector3 n = one.frame.col(0);
  for (size_t i = first; i < last; ++i) {
    PairConstraint& pair = set.pairs[i];
    const double weight = patch.weight[i - first];
    const Vector3 arm = pair.position - patch.middle, across = n.dot(arm) * n;
    pair.rub = weight * sigma * patch.slender * (0.5 * n.cross(arm) - (arm - across));
    for (int k = 0; k < 2; ++k) pair.law.friction[static_cast<size_t>(k)] *= 1.0 - weight * less;
    pair.spins = true;
  }
}

}  // namespace

double mean_distance(std::span<const Eigen::Vector2d> corners, bool round) {
  // Of the triangle from the origin to an edge two thirds of the edge's mean distance, which
  // Simpson's rule on four parts gives to 1e-4.
  std::array<Vector2, kMost> p;
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

void spread_friction(const StepContext& at, const Data& data, ConstraintSet& out) {
  const auto same = [&](size_t i, size_t j) {
    const collision::Candidate &a = out.contacts[i], &b = out.contacts[j];
    return a.geometry_a == b.geometry_a && a.geometry_b == b.geometry_b;
  };
  for (size_t first = 0, last; first < out.contacts.size(); first = last) {
    for (last = first + 1; last < out.contacts.size() && same(first, last);) ++last;
    if (last - first > 1) spread(at, data, first, last, out);
  }
}

}  // namespace counterpoint
