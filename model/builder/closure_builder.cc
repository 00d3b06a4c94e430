// Closures: the part of ModelBuilder that adds constraints between bodies of finished trees.
#include <fmt/format.h>

#include <cmath>
#include <tuple>

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

bool has_axis(ClosureType type) {
  return type != ClosureType::kBall && type != ClosureType::kWeld && type != ClosureType::kDistance;
}

void check_lengths(const ClosureSpec& spec) {
  const bool distance = spec.type == ClosureType::kDistance,
             screw = spec.type == ClosureType::kScrew;
  if (spec.length && !distance) fail(spec, "a length is for a distance only");
  if (spec.length && (!std::isfinite(*spec.length) || *spec.length <= 0.0))
    fail(spec, "the length must be positive; use a ball to join two points");
  if (spec.rope && !distance) fail(spec, "only a distance can be a rope");
  if (spec.pitch && !screw) fail(spec, "a pitch is for a screw only");
  if (screw && !spec.pitch)
    fail(spec, "a screw needs its pitch, the way along the axis per turn [m]");
  if (spec.pitch && (!std::isfinite(*spec.pitch) || *spec.pitch == 0.0))
    fail(spec, "the pitch must be a number other than zero; use a hinge for none");
}

/// Reads a spring and damper from their numbers along three axes.
ClosureSpring spring_of(const ClosureSpec& spec, const std::optional<Vector3>& stiffness,
                        const std::optional<Vector3>& damping) {
  ClosureSpring spring;
  if (!stiffness && !damping) return spring;
  spring.acts = true;
  spring.stiffness = stiffness.value_or(Vector3::Zero());
  spring.damping = damping.value_or(Vector3::Zero());
  const auto valid = [](const Vector3& x) { return x.allFinite() && (x.array() >= 0.0).all(); };
  if (!valid(spring.stiffness) || !valid(spring.damping))
    fail(spec, "stiffness and damping must be finite and not negative");
  if (spring.stiffness.isZero(0.0) && spring.damping.isZero(0.0))
    fail(spec, "stiffness and damping are zero, so that it holds nothing; give one of them");
  return spring;
}

void set_springs(const ClosureSpec& spec, Closure& closure) {
  closure.linear = spring_of(spec, spec.stiffness, spec.damping);
  closure.angular = spring_of(spec, spec.rotational_stiffness, spec.rotational_damping);
  if (spec.type == ClosureType::kScrew && (closure.linear.acts || closure.angular.acts))
    fail(spec, "a screw is rigid; use a cylindrical closure with springs");
  if (closure.angular.acts && !holds_angles(spec.type))
    fail(spec, fmt::format("a {} holds no angle, so it has no rotational stiffness or damping",
                           closure_type_name(spec.type)));
  const auto uniform = [](const Vector3& x) { return x.isConstant(x[0], 0.0); };
  if (spec.type == ClosureType::kDistance &&
      !(uniform(closure.linear.stiffness) && uniform(closure.linear.damping)))
    fail(spec, "a distance has one stiffness and one damping, not one per axis");
}

void check_switch(const ClosureSpec& spec) {
  const double never = std::numeric_limits<double>::infinity();
  if (!spec.switched && (!spec.attached || spec.in_place || spec.breaking_force != never ||
                         spec.breaking_torque != never))
    fail(spec,
         "attached, in_place and breaking limits are for a switched closure; add switched: true");
  if (spec.in_place && spec.type != ClosureType::kWeld)
    fail(spec, fmt::format("only a weld can hold in place, not a {}; leave out in_place",
                           closure_type_name(spec.type)));
  for (const auto& [limit, name, unit] :
       {std::tuple(spec.breaking_force, "breaking force", "N"),
        std::tuple(spec.breaking_torque, "breaking torque", "N m")})
    if (!(limit > 0.0))
      fail(spec,
           fmt::format("the {} must be a positive number of {}, it is {}", name, unit, limit));
  if (std::isfinite(spec.breaking_torque) && !holds_angles(spec.type))
    fail(spec, fmt::format("a {} carries no torque that could break it; leave out the limit",
                           closure_type_name(spec.type)));
}

void check(const ClosureSpec& spec) {
  const auto finite = [](const auto& value) { return !value || value->allFinite(); };
  if (!finite(spec.anchor_a) || !finite(spec.anchor_b) || !finite(spec.orientation))
    fail(spec, "anchors and orientation must be finite numbers");
  if (spec.orientation && !holds_angles(spec.type))
    fail(spec, fmt::format("an orientation is for a closure that holds angles, not for a {}",
                           closure_type_name(spec.type)));
  if (spec.axis && !has_axis(spec.type))
    fail(spec, fmt::format("a {} has no axis", closure_type_name(spec.type)));
  if (spec.axis && !(spec.axis->allFinite() && spec.axis->norm() > 0.0))
    fail(spec, "the axis must be a finite vector other than zero");
  check_lengths(spec);
  check_switch(spec);
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
  closure.pitch = spec.pitch.value_or(0.0);
  closure.rope = spec.rope;
  set_springs(spec, closure);
  closure.switched = spec.switched;
  closure.attached = spec.attached;
  closure.breaking_force = spec.breaking_force;
  closure.breaking_torque = spec.breaking_torque;
  closure.in_place = spec.in_place;
  model_.closures_.push_back(closure);
  closure_specs_.push_back({spec, a, b});
  if (spec.collide || spec.switched) return;
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
    const bool anywhere = distance || spec.in_place;
    X_LbC.translation = spec.anchor_b.value_or(anywhere ? Vector3::Zero() : opposite);
    if (spec.axis) X_LaC.rotation = frame_from_normal(spec.axis->normalized());
    X_LbC.rotation = spec.orientation.value_or(X_LaLb.rotation).transpose() * X_LaC.rotation;
    closure.X_AC = a.X_BL * X_LaC;
    closure.X_BC = b.X_BL * X_LbC;
    if (distance) {
      closure.length =
          spec.length.value_or((X_LaLb * X_LbC.translation - X_LaC.translation).norm());
      if (!(closure.length > kClosed))
        fail(spec, "the anchors start at one point; move one or use a ball");
    }
    if (spec.in_place || !spec.attached) continue;
    const ClosureGap gap = closure_gap(closure, X_WB);
    if (gap.largest() < kClosed) continue;
    model_.notes_.push_back(
        {(spec.where.empty() ? "" : spec.where + ": ") + "closure '" + spec.name + "'",
         fmt::format("starts {:.3g} m and {:.3g} rad open; the first steps pull it together",
                     gap.distance, gap.angle)});
  }
}

}  // namespace counterpoint
