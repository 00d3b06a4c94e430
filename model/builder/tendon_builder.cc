// Tendons: the part of ModelBuilder that adds them to finished trees.
#include <fmt/format.h>

#include <cmath>
#include <set>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {
namespace {

using Place = TendonSpec::Place;

[[noreturn]] void fail(const TendonSpec& spec, const std::string& what) {
  const std::string message = fmt::format("tendon '{}': {}", spec.name, what);
  throw InputError(spec.where.empty() ? message : spec.where + ": " + message);
}

void check_number(const TendonSpec& spec, const char* what, double value) {
  if (!(value >= 0.0 && std::isfinite(value)))
    fail(spec, fmt::format("{} must not be negative, it is {}", what, value));
}

void check_forces(const TendonSpec& spec) {
  check_number(spec, "stiffness", spec.stiffness);
  check_number(spec, "damping", spec.damping);
  check_number(spec, "dry_friction", spec.dry_friction);
  check_number(spec, "the servo's stiffness", spec.servo.stiffness);
  check_number(spec, "the servo's damping", spec.servo.damping);
  if (!(spec.lower <= spec.upper)) fail(spec, "the lower limit must not exceed the upper one");
  const bool bounded = std::isfinite(spec.servo.least);
  if (!(spec.servo.least <= spec.servo.most) || bounded != std::isfinite(spec.servo.most))
    fail(spec, "two finite bounds of the servo's force are expected, the lower one first, or none");
  if (spec.rest && !(spec.rest->first <= spec.rest->second && std::isfinite(spec.rest->first) &&
                     std::isfinite(spec.rest->second)))
    fail(spec, "the rest lengths must be finite and ascending");
  if ((spec.servo_target && !std::isfinite(*spec.servo_target)) || !std::isfinite(spec.servo.speed))
    fail(spec, "the targets of the servo must be finite");
}

void check_place(const TendonSpec& spec, const Place& place) {
  if (place.kind == Place::Kind::kPulley) {
    if (!(place.divisor > 0.0 && std::isfinite(place.divisor)))
      fail(spec, "the divisor of a pulley must be positive");
    return;
  }
  if (!place.X_LG.translation.allFinite() || !place.X_LG.rotation.allFinite())
    fail(spec, "positions must be finite numbers");
  if (place.kind == Place::Kind::kPoint) return;
  if (!(place.radius >= limits::kMinLength && place.radius <= limits::kMaxLength))
    fail(spec, "the radius of a sphere or cylinder must be positive");
  if (!place.side) return;
  Vector3 side = *place.side;
  if (place.kind == Place::Kind::kCylinder) side.z() = 0.0;
  if (!(side.norm() > place.radius))
    fail(spec, fmt::format("the side, {} m from the middle, is inside the radius {} m; paths on "
                           "the inside of a sphere or cylinder are not supported",
                           side.norm(), place.radius));
}

/// Turns the places of a path into segments.
class PathMaker {
 public:
  PathMaker(const TendonSpec& spec, Tendon& tendon) : spec_(spec), tendon_(tendon) {}

  void add(const Place& place, int body, const Pose& X_BL) {
    switch (place.kind) {
      case Place::Kind::kPulley:
        end_branch();
        share_ = 1.0 / place.divisor;
        return;
      case Place::Kind::kPoint: {
        const TendonPoint point{body, (X_BL * place.X_LG).translation};
        if (last_) tendon_.path.push_back({*last_, point, wrap_, share_});
        ++points_;
        last_ = point;
        wrap_ = -1;
        return;
      }
      default:
        if (!last_ || wrap_ >= 0) fail(spec_, "a sphere or cylinder must stand between two points");
        wrap_ = static_cast<int>(tendon_.wraps.size());
        tendon_.wraps.push_back({body, X_BL * place.X_LG, place.radius,
                                 place.kind == Place::Kind::kCylinder, place.side});
    }
  }
  void end_branch() {
    const bool none_yet = tendon_.path.empty() && points_ == 0;
    if (wrap_ >= 0) fail(spec_, "a sphere or cylinder must stand between two points");
    if (points_ < 2 && !none_yet) fail(spec_, "a path needs at least two points");
    points_ = 0;
    last_.reset();
  }

 private:
  const TendonSpec& spec_;
  Tendon& tendon_;
  std::optional<TendonPoint> last_;
  int wrap_ = -1, points_ = 0;
  double share_ = 1.0;
};

}  // namespace

void ModelBuilder::add_tendon(const TendonSpec& given) {
  TendonSpec spec = given;
  if (model_.tendons_.size() == limits::kMaxTendons)
    fail(spec, fmt::format("more than {} tendons; make the scene smaller", limits::kMaxTendons));
  if (spec.name.empty()) spec.name = fmt::format("tendon{}", model_.tendons_.size());
  if (model_.find_tendon(spec.name) >= 0) fail(spec, "there is already a tendon of this name");
  check_forces(spec);
  Tendon tendon;
  tendon.name = spec.name;
  if (spec.joints.empty() == spec.path.empty())
    fail(spec, "either joints (a sum) or a path (points) is expected");
  for (const auto& [name, coefficient] : spec.joints) {
    const auto found = joint_names_.find(name);
    if (found == joint_names_.end()) fail(spec, fmt::format("there is no joint '{}'", name));
    if (joint_nv(model_.bodies_[found->second + 1].joint_type) != 1)
      fail(spec, fmt::format("joint '{}' has several coordinates; one is expected", name));
    if (!std::isfinite(coefficient)) fail(spec, "coefficients must be finite");
    tendon.joints.push_back({found->second, coefficient});
  }
  PathMaker maker(spec, tendon);
  for (const Place& place : spec.path) {
    check_place(spec, place);
    int body = 0;
    Pose X_BL;
    if (place.kind != Place::Kind::kPulley) {
      const auto found = frame_names_.find(place.link);
      if (found != frame_names_.end()) {
        body = model_.frames_[found->second].body;
        X_BL = model_.frames_[found->second].X_BF;
      } else if (place.link != "world") {
        fail(spec, fmt::format("there is no link '{}'", place.link));
      }
    }
    maker.add(place, body, X_BL);
  }
  if (!spec.path.empty()) maker.end_branch();
  tendon.stiffness = spec.stiffness;
  tendon.damping = spec.damping;
  tendon.dry_friction = spec.dry_friction;
  tendon.lower = spec.lower;
  tendon.upper = spec.upper;
  tendon.servo = spec.servo;
  model_.tendons_.push_back(std::move(tendon));
  tendon_specs_.push_back(std::move(spec));
}

/// Computes the values that the specs leave open from the default configuration, and refuses
/// tendons that move nothing or too much; it needs the whole model.
void ModelBuilder::place_tendons() {
  if (tendon_specs_.empty()) return;
  const std::vector<Pose> X_WB = body_poses(model_, model_.default_q_);
  for (std::size_t i = 0; i < tendon_specs_.size(); ++i) {
    const TendonSpec& spec = tendon_specs_[i];
    Tendon& tendon = model_.tendons_[i];
    const double length = tendon_length(model_, tendon, model_.default_q_, X_WB);
    std::tie(tendon.rest_shortest, tendon.rest_longest) =
        spec.rest.value_or(std::pair(length, length));
    tendon.servo.target = spec.servo_target.value_or(length);
    std::set<int> trees, bodies;
    for (const TendonJoint& term : tendon.joints) bodies.insert(term.joint + 1);
    for (const TendonSegment& segment : tendon.path)
      bodies.insert({segment.from.body, segment.to.body});
    for (const TendonWrap& wrap : tendon.wraps) bodies.insert(wrap.body);
    for (const int body : bodies)
      if (body != 0) trees.insert(model_.bodies_[body].tree);
    if (tendon.is_spatial() && bodies.size() < 2)
      fail(spec, "all its points are fixed to one body: its length cannot change");
    if (trees.size() > 2)
      fail(spec, fmt::format("it acts on {} separate mechanisms; at most two are supported",
                             trees.size()));
  }
}

}  // namespace counterpoint
