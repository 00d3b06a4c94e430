// Closures: the part of ModelBuilder that adds constraints between bodies of finished trees.
#include <fmt/format.h>

#include <cmath>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {
namespace {

/// Initial error [m, rad] above which a closure is noted, and smallest length of a rod.
constexpr double kClosed = 1e-6;

[[noreturn]] void fail(const ClosureSpec& spec, const std::string& what) {
  const std::string message = fmt::format("closure '{}': {}", spec.name, what);
  throw InputError(spec.where.empty() ? message : spec.where + ": " + message);
}

void check(const ClosureSpec& spec) {
  const auto finite = [](const auto& value) { return !value || value->allFinite(); };
  if (!finite(spec.anchor_a) || !finite(spec.anchor_b) || !finite(spec.orientation))
    fail(spec, "anchors and orientation must be finite numbers");
  if (spec.orientation && spec.type != ClosureType::kWeld)
    fail(spec, "an orientation is for a weld only");
  if (!spec.length) return;
  if (spec.type != ClosureType::kDistance) fail(spec, "a length is for a distance only");
  if (!std::isfinite(*spec.length) || *spec.length <= 0.0)
    fail(spec, "the length must be positive; use a ball to join two points");
}

}  // namespace

ModelBuilder::Anchor ModelBuilder::find_anchor(const ClosureSpec& spec,
                                               const std::string& link) const {
  const auto found = frame_names_.find(link);
  if (found != frame_names_.end()) {
    const Frame& frame = model_.frames_[found->second];
    return {found->second, frame.body, frame.X_BF};
  }
  if (link == "world") return {-1, 0, Pose()};
  std::string names = "'world'";
  for (const Frame& frame : model_.frames_) names += ", '" + frame.name + "'";
  fail(spec, fmt::format("there is no link '{}'; links: {}", link, names));
}

void ModelBuilder::add_closure(const ClosureSpec& given) {
  ClosureSpec spec = given;
  if (model_.closures_.size() == limits::kMaxClosures) {
    fail(spec, fmt::format("more than {} closures; make the scene smaller", limits::kMaxClosures));
  }
  if (spec.name.empty()) spec.name = fmt::format("closure{}", model_.closures_.size());
  for (const Closure& other : model_.closures_) {
    if (other.name == spec.name) fail(spec, "there is already a closure of this name");
  }
  check(spec);
  const Anchor a = find_anchor(spec, spec.link_a), b = find_anchor(spec, spec.link_b);
  if (a.body == b.body) {
    fail(spec, fmt::format("'{}' and '{}' are one rigid body (or both fixed to the world); two "
                           "that can move apart are expected",
                           spec.link_a, spec.link_b));
  }
  Closure closure;
  closure.name = spec.name;
  closure.type = spec.type;
  closure.body_a = a.body;
  closure.body_b = b.body;
  closure.frame_a = a.frame;
  closure.frame_b = b.frame;
  model_.closures_.push_back(closure);
  closure_specs_.push_back({spec, a, b});
  if (spec.collide) return;
  // Excludes the collisions of both bodies, like those of neighbours at a joint. On the world side
  // only the shapes of the named link are excluded; the other environment geometry (the ground)
  // still collides.
  const auto belongs = [&](const Geometry& g, const Anchor& side) {
    return side.body == 0 ? side.frame >= 0 && g.frame == side.frame : g.body == side.body;
  };
  const std::vector<Geometry>& geometries = model_.geometries_;
  for (int i = 0; i < static_cast<int>(geometries.size()); ++i) {
    if (!belongs(geometries[i], a)) continue;
    for (int j = 0; j < static_cast<int>(geometries.size()); ++j) {
      if (belongs(geometries[j], b)) add_exclusion(i, j, "tied by closure '" + spec.name + "'");
    }
  }
}

/// Computes the values that the closure specs leave open from the default configuration; it needs
/// the whole model.
void ModelBuilder::place_closures() {
  const std::vector<Pose> X_WB = body_poses(model_, model_.default_q_);
  for (size_t i = 0; i < closure_specs_.size(); ++i) {
    const ClosureSpec& spec = closure_specs_[i].spec;
    const Anchor& a = closure_specs_[i].a;
    const Anchor& b = closure_specs_[i].b;
    Closure& closure = model_.closures_[i];
    const Pose X_WLa = X_WB[a.body] * a.X_BL, X_WLb = X_WB[b.body] * b.X_BL;
    const Pose X_LaLb = X_WLa.inverse() * X_WLb;
    Pose X_LaC, X_LbC;
    const bool distance = spec.type == ClosureType::kDistance;
    X_LaC.translation = spec.anchor_a.value_or(Vector3::Zero());
    const Vector3 opposite = X_LaLb.inverse() * X_LaC.translation;
    X_LbC.translation = spec.anchor_b.value_or(distance ? Vector3::Zero() : opposite);
    X_LbC.rotation = spec.orientation.value_or(X_LaLb.rotation).transpose();
    closure.X_AC = a.X_BL * X_LaC;
    closure.X_BC = b.X_BL * X_LbC;
    if (distance) {
      closure.length = spec.length.value_or(closure_gap(closure, X_WB).distance);
      if (!(closure.length > kClosed))
        fail(spec, "the anchors start at one point; move one or use a ball");
    }
    const ClosureGap gap = closure_gap(closure, X_WB);
    if (gap.largest() < kClosed) continue;
    model_.notes_.push_back(
        {(spec.where.empty() ? "" : spec.where + ": ") + "closure '" + spec.name + "'",
         fmt::format("starts {:.3g} m and {:.3g} rad open; the first steps pull it together",
                     gap.distance, gap.angle)});
  }
}

}  // namespace counterpoint
