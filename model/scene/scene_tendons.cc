#include "counterpoint/model/scene/scene_tendons.h"

#include "counterpoint/model/scene/scene_shapes.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

using Place = TendonSpec::Place;

Place read_place(const YamlValue& in) {
  in.expect_map(
      {"point", "sphere", "cylinder", "pulley", "link", "position", "rpy", "quaternion", "side"});
  Place place;
  int kinds = 0;
  const auto is = [&](const char* key, Place::Kind kind) {
    if (!in.has(key)) return false;
    ++kinds;
    place.kind = kind;
    return true;
  };
  if (is("point", Place::Kind::kPoint)) place.X_LG.translation = in.at("point").vector3();
  if (is("sphere", Place::Kind::kSphere)) place.radius = in.at("sphere").positive();
  if (is("cylinder", Place::Kind::kCylinder)) place.radius = in.at("cylinder").positive();
  if (is("pulley", Place::Kind::kPulley)) place.divisor = in.at("pulley").positive();
  if (kinds != 1) in.fail("one of point, sphere, cylinder, pulley is expected");
  if (place.kind == Place::Kind::kPulley) return place;
  place.link = in.at("link").text();
  if (place.kind == Place::Kind::kPoint) return place;
  place.X_LG = read_pose(in);
  if (in.has("side")) place.side = place.X_LG.inverse() * in.at("side").vector3();
  return place;
}

void read_servo(const YamlValue& in, TendonSpec& tendon) {
  in.expect_map({"stiffness", "damping", "target", "speed", "force"});
  TendonServo& servo = tendon.servo;
  if (in.has("stiffness")) servo.stiffness = in.at("stiffness").number(0.0, kInfinity);
  if (in.has("damping")) servo.damping = in.at("damping").number(0.0, kInfinity);
  if (in.has("target")) tendon.servo_target = in.at("target").number();
  if (in.has("speed")) servo.speed = in.at("speed").number();
  if (in.has("force")) std::tie(servo.least, servo.most) = read_range(in.at("force"), false);
}

}  // namespace

TendonSpec read_tendon(const YamlValue& in) {
  in.expect_map({"name", "joints", "path", "stiffness", "damping", "rest_length", "dry_friction",
                 "limits", "servo"});
  TendonSpec tendon;
  tendon.where = in.where();
  if (in.has("name")) tendon.name = in.at("name").text();
  if (in.has("joints"))
    for (const auto& [name, coefficient] : in.at("joints").entries())
      tendon.joints.emplace_back(name, coefficient.number());
  if (in.has("path"))
    for (const YamlValue& place : in.at("path").list()) tendon.path.push_back(read_place(place));
  if (in.has("stiffness")) tendon.stiffness = in.at("stiffness").number(0.0, kInfinity);
  if (in.has("damping")) tendon.damping = in.at("damping").number(0.0, kInfinity);
  if (in.has("dry_friction")) tendon.dry_friction = in.at("dry_friction").number(0.0, kInfinity);
  if (in.has("rest_length")) {
    const YamlValue rest = in.at("rest_length");
    tendon.rest =
        rest.is_list() ? read_range(rest, false) : std::pair(rest.number(), rest.number());
  }
  if (in.has("limits")) std::tie(tendon.lower, tendon.upper) = read_range(in.at("limits"), true);
  if (in.has("servo")) read_servo(in.at("servo"), tendon);
  return tendon;
}

}  // namespace counterpoint
