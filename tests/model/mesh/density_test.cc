// Mass, centre and inertia of links from the density of their shapes: MJCF `density`, SDF 1.11
// <inertial auto="true"> with <density>.
#include <gtest/gtest.h>

#include <string>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::density_test {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kRoundOff = 1e-12;  ///< relative, of sums of some ten products

/// A solid of density 1 in closed form: volume [m^3] and moments [m^5] about its centre.
struct Solid {
  const char* name;
  const char* sdf;
  const char* mjcf;
  double volume;
  Vector3 moments;
};

double ball_volume(double r) { return 4.0 / 3.0 * kPi * r * r * r; }

/// Capsule of radius r and straight half length l: a cylinder and two half balls, whose centres are
/// 3 / 8 r beyond its ends.
Vector3 capsule_moments(double r, double l) {
  const double straight = 2.0 * kPi * r * r * l, ball = ball_volume(r);
  const double half_ball = 0.4 * r * r - 9.0 / 64.0 * r * r, far = l + 0.375 * r;
  const double across = straight * (r * r / 4.0 + l * l / 3.0) + ball * (half_ball + far * far);
  return {across, across, straight * r * r / 2.0 + ball * 0.4 * r * r};
}

const Solid kSolids[] = {
    {"box", "<box><size>0.2 0.4 0.6</size></box>", "type='box' size='0.1 0.2 0.3'", 0.048,
     0.048 / 12.0 * Vector3(0.16 + 0.36, 0.04 + 0.36, 0.04 + 0.16)},
    {"sphere", "<sphere><radius>0.3</radius></sphere>", "type='sphere' size='0.3'",
     ball_volume(0.3), Vector3::Constant(0.4 * 0.09 * ball_volume(0.3))},
    {"cylinder", "<cylinder><radius>0.2</radius><length>0.6</length></cylinder>",
     "type='cylinder' size='0.2 0.3'", kPi * 0.04 * 0.6,
     kPi * 0.04 * 0.6 * Vector3(0.01 + 0.03, 0.01 + 0.03, 0.02)},
    {"capsule", "<capsule><radius>0.2</radius><length>0.6</length></capsule>",
     "type='capsule' size='0.2 0.3'", kPi * 0.04 * 0.6 + ball_volume(0.2),
     capsule_moments(0.2, 0.3)},
    {"ellipsoid", "<ellipsoid><radii>0.1 0.2 0.3</radii></ellipsoid>",
     "type='ellipsoid' size='0.1 0.2 0.3'", 4.0 / 3.0 * kPi * 0.006,
     4.0 / 15.0 * kPi * 0.006 * Vector3(0.13, 0.1, 0.05)},
};

/// An L of two boxes, 2 x 1 x 1 m and 1 x 2 x 1 m, as OBJ: not convex.
constexpr const char* kL = R"(v 0 0 0
v 2 0 0
v 2 1 0
v 1 1 0
v 1 3 0
v 0 3 0
v 0 0 1
v 2 0 1
v 2 1 1
v 1 1 1
v 1 3 1
v 0 3 1
f 1 3 2
f 1 4 3
f 1 6 4
f 4 6 5
f 7 8 9
f 7 9 10
f 7 10 12
f 10 11 12
f 1 2 8
f 1 8 7
f 2 3 9
f 2 9 8
f 3 4 10
f 3 10 9
f 4 5 11
f 4 11 10
f 5 6 12
f 5 12 11
f 6 1 7
f 6 7 12
)";

SpatialInertia box_at(const Vector3& sides, const Vector3& center) {
  const Vector3 s2 = sides.cwiseAbs2();
  const double mass = sides.prod();
  return {mass, center, (mass / 12.0 * (Vector3::Constant(s2.sum()) - s2)).asDiagonal()};
}

void expect_inertia(const SpatialInertia& found, const SpatialInertia& expected, double density,
                    const std::string& what) {
  EXPECT_NEAR(found.mass, density * expected.mass, kRoundOff * found.mass) << what;
  EXPECT_LT((found.center - expected.center).norm(), kRoundOff) << what;
  EXPECT_LT((found.rotational - density * expected.rotational).norm(),
            kRoundOff * found.rotational.norm())
      << what;
}

class Density : public testing::Test {
 protected:
  /// Inertia of the only link of a file.
  SpatialInertia read(const std::string& name, const std::string& text) {
    folder_.write("l.obj", kL);
    return load_scene(folder_.write(name, text)).model.body(1).inertia;
  }
  SpatialInertia mjcf(const std::string& geom, const std::string& asset = "") {
    return read("m.xml", "<mujoco><asset>" + asset +
                             "</asset><worldbody><body name='b'><freejoint/><geom " + geom +
                             "/></body></worldbody></mujoco>");
  }
  /// `inertial`: what <inertial> contains.
  SpatialInertia sdf(const std::string& collisions, const std::string& inertial = "") {
    return read("m.sdf",
                "<?xml version='1.0'?>\n<sdf version='1.11'><model name='m'><link name='b'>"
                "\n<inertial auto='true'>" +
                    inertial + "</inertial>\n" + collisions + "</link></model></sdf>");
  }
  static std::string collision(const std::string& shape, const std::string& more = "") {
    static int number = 0;
    return "\n<collision name='c" + std::to_string(number++) + "'>" + more + "<geometry>" + shape +
           "</geometry></collision>";
  }
  std::string refusal(const std::string& collisions, const std::string& inertial = "") {
    try {
      sdf(collisions, inertial);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  bool without_sdf() {
    return refusal(collision(kSolids[0].sdf)).find("built without SDF") != std::string::npos;
  }
  test::TempFolder folder_;
};

TEST_F(Density, GeomsOfMjcfHaveTheInertiaOfTheirSolids) {
  for (const Solid& s : kSolids) {
    const SpatialInertia unit{s.volume, Vector3::Zero(), s.moments.asDiagonal()};
    expect_inertia(mjcf(s.mjcf), unit, 1000.0, s.name);
    expect_inertia(mjcf(s.mjcf + std::string(" density='250'")), unit, 250.0, s.name);
  }
}

TEST_F(Density, AMeshThatIsNotConvexHasTheInertiaOfItsOwnVolume) {
  const SpatialInertia l = box_at({2, 1, 1}, {1, 0.5, 0.5}) + box_at({1, 2, 1}, {0.5, 2, 0.5});
  expect_inertia(
      mjcf("type='mesh' mesh='l' density='20'", "<mesh name='l' file='l.obj' inertia='exact'/>"), l,
      20.0, "mjcf");
  if (without_sdf()) GTEST_SKIP() << "no SDF";
  expect_inertia(sdf(collision("<mesh><uri>l.obj</uri></mesh>"), "<density>20</density>"), l, 20.0,
                 "sdf");
}

TEST_F(Density, LinksOfSdfHaveTheInertiaOfTheirCollisions) {
  if (without_sdf()) GTEST_SKIP() << "no SDF";
  for (const Solid& s : kSolids) {
    const SpatialInertia unit{s.volume, Vector3::Zero(), s.moments.asDiagonal()};
    expect_inertia(sdf(collision(s.sdf)), unit, 1000.0, s.name);  // water, as the format says
    expect_inertia(sdf(collision(s.sdf), "<density>250</density>"), unit, 250.0, s.name);
    expect_inertia(sdf(collision(s.sdf, "<density>70</density>"), "<density>250</density>"), unit,
                   70.0, s.name);
    // A mass scales the whole.
    expect_inertia(sdf(collision(s.sdf), "<mass>3</mass>"), unit, 3.0 / s.volume, s.name);
  }
  // Collisions that touch nothing have mass too.
  const std::string box = "<box><size>1 1 1</size></box>";
  const std::string ghost =
      "<pose>2 0 0 0 0 0</pose><surface><contact><collide_without_contact>true"
      "</collide_without_contact></contact></surface>";
  expect_inertia(sdf(collision(box) + collision(box, ghost), "<density>5</density>"),
                 box_at({1, 1, 1}, {0, 0, 0}) + box_at({1, 1, 1}, {2, 0, 0}), 5.0, "two boxes");
}

TEST_F(Density, LinksOfSdfWithoutVolumeAreRefused) {
  if (without_sdf()) GTEST_SKIP() << "no SDF";
  EXPECT_NE(refusal("").find("no <collision> with a volume"), std::string::npos);
  const std::string box = collision("<box><size>1 1 1</size></box>", "<density>-3</density>");
  EXPECT_NE(refusal(box).find("<density> -3 is not positive"), std::string::npos) << refusal(box);
  std::string open = kL;
  open.resize(open.rfind("f "));
  const auto refused = [&] {
    folder_.write("open.obj", open);
    return refusal(collision("<mesh><uri>open.obj</uri></mesh>"));
  }();
  EXPECT_NE(refused.find("is open"), std::string::npos) << refused;
  EXPECT_NE(refused.find("m.sdf:5"), std::string::npos) << refused;
}

}  // namespace
}  // namespace counterpoint::density_test
