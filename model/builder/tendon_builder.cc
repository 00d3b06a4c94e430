// Tendons: the part of ModelBuilder that adds them to finished trees.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "counterpoint/model/builder/tendon_path.h"
#include "counterpoint/model/limits.h"

namespace counterpoint {
namespace {

using Place = TendonSpec::Place;

void check_number(const TendonSpec& spec, const char* what, double value) {
  if (!(value >= 0.0 && std::isfinite(value)))
    fail_tendon(spec, fmt::format("{} must not be negative, it is {}", what, value));
}

void check_forces(const TendonSpec& spec) {
  check_number(spec, "stiffness", spec.stiffness);
  check_number(spec, "damping", spec.damping);
  check_number(spec, "dry_friction", spec.dry_friction);
  check_number(spec, "the servo's stiffness", spec.servo.stiffness);
  check_number(spec, "the servo's damping", spec.servo.damping);
  if (!(spec.lower <= spec.upper))
    fail_tendon(spec, "the lower limit must not exceed the upper one");
  const bool bounded = std::isfinite(spec.servo.least);
  if (!(spec.servo.least <= spec.servo.most) || bounded != std::isfinite(spec.servo.most))
    fail_tendon(
        spec, "two finite bounds of the servo's force are expected, the lower one first, or none");
  if (spec.rest && !(spec.rest->first <= spec.rest->second && std::isfinite(spec.rest->first) &&
                     std::isfinite(spec.rest->second)))
    fail_tendon(spec, "the rest lengths must be finite and ascending");
  if ((spec.servo_target && !std::isfinite(*spec.servo_target)) || !std::isfinite(spec.servo.speed))
    fail_tendon(spec, "the targets of the servo must be finite");
}

void check_place(const TendonSpec& spec, const Place& place) {
  if (place.kind == Place::Kind::kPulley) {
    if (!(place.divisor > 0.0 && std::isfinite(place.divisor)))
      fail_tendon(spec, "the divisor of a pulley must be positive");
    return;
  }
  if (!place.X_LG.translation.allFinite() || !place.X_LG.rotation.allFinite())
    fail_tendon(spec, "positions must be finite numbers");
  if (place.kind == Place::Kind::kPoint) return;
  if (!(place.radius >= limits::kMinLength && place.radius <= limits::kMaxLength))
    fail_tendon(spec, "the radius of a sphere or cylinder must be positive");
  if (!place.side) return;
  Vector3 side = *place.side;
  if (place.kind == Place::Kind::kCylinder) side.z() = 0.0;
  if (!(side.norm() > place.radius))
    fail_tendon(spec,
                fmt::format("the side, {} m from the middle, is inside the radius {} m; paths on "
                            "the inside of a sphere or cylinder are not supported",
                            side.norm(), place.radius));
}

}  // namespace

void ModelBuilder::add_tendon(const TendonSpec& given) {
  TendonSpec spec = given;
  if (model_.tendons_.size() == limits::kMaxTendons)
    fail_tendon(spec,
                fmt::format("more than {} tendons; make the scene smaller", limits::kMaxTendons));
  if (spec.name.empty()) spec.name = fmt::format("tendon{}", model_.tendons_.size());
  if (model_.find_tendon(spec.name) >= 0)
    fail_tendon(spec, "there is already a tendon of this name");
  check_forces(spec);
  Tendon tendon;
  tendon.name = spec.name;
  if (spec.joints.empty() == spec.path.empty())
    fail_tendon(spec, "either joints (a sum) or a path (points) is expected");
  for (const auto& [name, coefficient] : spec.joints) {
    const auto found = joint_names_.find(name);
    if (found == joint_names_.end()) fail_tendon(spec, fmt::format("there is no joint '{}'", name));
    if (joint_nv(model_.bodies_[found->second + 1].joint_type) != 1)
      fail_tendon(spec, fmt::format("joint '{}' has several coordinates; one is expected", name));
    if (!std::isfinite(coefficient)) fail_tendon(spec, "coefficients must be finite");
    tendon.joints.push_back({found->second, coefficient});
  }
  for (const Place& place : spec.path) check_place(spec, place);
  make_tendon_path(
      spec,
      [&](const std::string& link) {
        const auto found = frame_names_.find(link);
        if (found == frame_names_.end() && link != "world")
          fail_tendon(spec, fmt::format("there is no link '{}'", link));
        if (found == frame_names_.end()) return std::pair(0, Pose());
        const Frame& frame = model_.frames_[found->second];
        return std::pair(frame.body, frame.X_BF);
      },
      tendon);
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
    std::set<int> trees, bodies = path_bodies(tendon);
    for (const TendonJoint& term : tendon.joints) bodies.insert(term.joint + 1);
    for (const int body : bodies)
      if (body != 0) trees.insert(model_.bodies_[body].tree);
    const bool moves =
        std::any_of(tendon.path.begin(), tendon.path.end(), [&](const TendonSegment& segment) {
          return segment.from.body != segment.to.body ||
                 segment.from.body != reference_body(tendon, segment);
        });
    if (tendon.is_spatial() && !moves)
      fail_tendon(spec, "every part of it is fixed to one body: its length cannot change");
    if (trees.size() > 2)
      fail_tendon(spec, fmt::format("it acts on {} separate mechanisms; at most two are supported",
                                    trees.size()));
  }
}

}  // namespace counterpoint
