// Bodies that are not convex, as convex pieces: no seam is felt, hollows hold what lies in them,
// and the inverse gives the forces. The scenes are those of data/scenes/hollow.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/scene.h"
#include "support/paths.h"
#include "support/random_model.h"
#include "support/record_largest.h"
#include "support/recover.h"
#include "support/shape_reference.h"

namespace counterpoint::test::pieces_test {
namespace {

constexpr double kG = kStandardGravity;

Scene hollow(const std::string& name) {
  return load_scene(source_dir() + "/data/scenes/hollow/" + name + ".yaml");
}

/// Runs a scene to its end. No body starts inside another, so that the answers are not those of an
/// overlap that heals; the inverse gives back every step's forces.
template <typename Look>
void run(Simulator& sim, const Scene& scene, Look after_step) {
  // Round-off of the softened steps of the chain, as without pieces (inverse_test.cc).
  constexpr double kInverse = 1e-8;
  EXPECT_EQ(Simulator(scene).step().max_penetration, 0.0);
  Random random(1);
  const int steps = static_cast<int>(std::lround(scene.options.duration / scene.options.time_step));
  const double error = recover(sim, steps, 0.0, random, after_step);
  RecordLargest("recovered")(error);
  EXPECT_LT(error, kInverse);
}
void run(Simulator& sim, const Scene& scene) {
  run(sim, scene, [] {});
}

Material rough(double friction) {
  Material material;
  material.friction = friction;
  return material;
}

/// Sum over the contacts of two bodies of the force on the first [N], in W; `by` -1: of all others.
Vector3 contact_force_on(Simulator& sim, int body, int by = -1) {
  Vector3 sum = Vector3::Zero();
  const auto& geometries = sim.model().geometries();
  for (const auto& contact : sim.last_forces().contacts) {
    const int a = geometries[contact.contact.geometry_a].body;
    const int b = geometries[contact.contact.geometry_b].body;
    if (b == body && (by < 0 || a == by)) sum += contact.force;
    if (a == body && (by < 0 || b == by)) sum -= contact.force;
  }
  return sum;
}

/// A flat slab from x = -1 to 13 m with its top at z = 0, as one box or cut at every metre.
Shape slab(bool cut) {
  const auto box = [](double low, double high) {
    std::vector<Vector3> corners;
    for (const double x : {low, high})
      for (const double y : {-2.0, 2.0})
        for (const double z : {-0.5, 0.0}) corners.emplace_back(x, y, z);
    return make_convex_hull(corners);
  };
  ConvexMesh whole = *box(-1.0, 13.0);
  for (int i = -1; cut && i < 13; ++i) whole.pieces.push_back(box(i, i + 1));
  return {ShapeType::kConvexMesh, Vector3::Zero(),
          std::make_shared<const ConvexMesh>(std::move(whole))};
}

// The pieces of a slab touch as the slab: a body that slides or rolls over the seams moves as on
// one box.
TEST(PiecesOfABody, SeamsAreNotFelt) {
  // Round-off of the contact points, grown over 1000 steps of 2 ms.
  constexpr double kSame = 1e-7;  // [m]
  struct Case {
    Shape shape;
    double height, speed, spin;
  };
  for (const Case& c : {Case{sphere_shape(0.15), 0.15, 2.0, 2.0 / 0.15},
                        Case{box_shape({0.3, 0.2, 0.1}), 0.1, 6.0, 0.0},
                        Case{sphere_shape(0.05), 0.05, 4.0, 0.0}}) {
    const auto start = [&](bool cut) {
      ModelBuilder builder;
      builder.add_environment("slab", slab(cut), Pose(), rough(0.5));
      builder.add_robot(object_of("body", c.shape, 1.0, rough(0.5)), Base::kFloating,
                        {Matrix3::Identity(), Vector3(0.1, 0, c.height)});
      Scene scene = scene_of(builder.build());
      scene.v[0] = c.speed;
      scene.v[4] = c.spin;
      return scene;
    };
    Simulator one(start(false)), many(start(true));
    double apart = 0.0;
    for (int i = 0; i < 1000; ++i) {
      ASSERT_TRUE(one.step().succeeded());
      ASSERT_TRUE(many.step().succeeded());
      apart = std::max(apart, (one.state().q - many.state().q).head<3>().norm());
    }
    RecordLargest("apart_m")(apart);
    EXPECT_LT(apart, kSame);
  }
}

// A ball that rolls in a bowl of radius R swings as a pendulum of length 7 (R - r) / 5.
TEST(PiecesOfABody, ABallRollsInABowlWithThePeriodOfAPendulum) {
  constexpr double kLength = 0.4 - 0.05, kAngle = 0.25, kFace = 0.05;
  // The faces, kFace wide [rad], stand off the ball of radius R by at most R kFace^2 / 8 = 1.1 % of
  // the height from which the ball rolls, so that its kinetic energy is off by that part, and the
  // period by less.
  const double faces = 0.4 * kFace * kFace / 8.0 / (kLength * (1.0 - std::cos(kAngle)));
  // Pieces are tilted by at most tolerance / breadth = 1e-5 / 0.02 against their faces.
  constexpr double kOffPlane = 1e-3;  // [m]
  const Scene scene = hollow("ball_in_bowl");
  Simulator sim(scene);
  std::vector<double> crossings;
  double last = sim.state().q[0], time = 0.0, off_plane = 0.0;
  run(sim, scene, [&] {
    const double x = sim.state().q[0], now = sim.state().time;
    if (last > 0.0 && x <= 0.0) crossings.push_back(time + (now - time) * last / (last - x));
    off_plane = std::max(off_plane, std::abs(sim.state().q[1]));
    last = x;
    time = now;
  });
  ASSERT_EQ(crossings.size(), 2U);
  const double period = crossings[1] - crossings[0];
  const double expected =
      2.0 * M_PI * std::sqrt(1.4 * kLength / kG) * (1.0 + kAngle * kAngle / 16.0);
  RecordLargest("relative_error")(period / expected - 1.0);
  EXPECT_NEAR(period / expected, 1.0, faces);
  RecordLargest("off_plane_m")(off_plane);
  EXPECT_LT(off_plane, kOffPlane);
}

// A ball dropped into a free cup rests on its bottom; the ground carries both.
TEST(PiecesOfABody, ABallRestsInACup) {
  constexpr double kBall = 0.02, kWall = 0.005;
  const Scene scene = hollow("ball_in_cup");
  Simulator sim(scene);
  run(sim, scene);
  const VectorX& q = sim.state().q;
  EXPECT_NEAR(q[9], kWall + kBall, 1e-4);  // the bottom is exact: compliance only
  EXPECT_LT(std::hypot(q[7] - q[0], q[8] - q[1]), 0.05);
  EXPECT_NEAR(contact_force_on(sim, 2).z(), 0.1 * kG, 1e-3 * kG);
  EXPECT_NEAR(contact_force_on(sim, 1).z(), 0.2 * kG, 1e-3 * kG);
}

// Links of a chain hang from each other: each carries the weight below.
TEST(PiecesOfABody, EachLinkOfAChainCarriesWhatIsBelow) {
  constexpr int kLinks = 20;
  constexpr double kMass = 0.05;
  const Scene scene = hollow("chain_20");
  Simulator sim(scene);
  run(sim, scene);
  for (int i = 1; i <= kLinks; ++i) {
    const double carried = contact_force_on(sim, i, i - 1).z();
    const double below = (kLinks + 1 - i) * kMass * kG;
    // The chain still swings a little after 3 s.
    EXPECT_NEAR(carried / below, 1.0, 0.05) << i;
  }
}

// A ring dropped over a peg lies around it on the ground.
TEST(PiecesOfABody, ARingThrownOnAPegStaysThere) {
  const Scene scene = hollow("ring_on_peg");
  Simulator sim(scene);
  run(sim, scene);
  const VectorX& q = sim.state().q;
  EXPECT_LT(std::hypot(q[0], q[1]), 0.08 - 0.015);  // the peg is within the ring
  EXPECT_NEAR(q[2], 0.015, scene.model.geometries().front().shape.mesh->union_standoff);
  EXPECT_NEAR(contact_force_on(sim, 1).z(), 0.3 * kG, 0.01 * kG);
}

// A mug hangs on a hook by its handle, its centre of mass beneath: it stays as it was hung.
TEST(PiecesOfABody, AMugHangsOnAHookByItsHandle) {
  // The mug is hung 1 mm above the rod; each of the meshes stands off its shape by 0.3 mm and its
  // pieces by up to 1 mm.
  constexpr double kMoved = 2e-3;   // [m]
  constexpr double kTilted = 0.01;  // over the 80 mm between centre and rod: kMoved / 2 / 0.08
  const Scene scene = hollow("mug_on_hook");
  Simulator sim(scene);
  double moved = 0.0, tilted = 0.0;
  run(sim, scene, [&] {
    const VectorX change = sim.state().q - scene.q;
    moved = std::max(moved, change.head<3>().norm());
    tilted = std::max(tilted, 2.0 * change.tail<4>().norm());
  });
  RecordLargest("moved_m")(moved);
  RecordLargest("tilted_rad")(tilted);
  EXPECT_LT(moved, kMoved);
  EXPECT_LT(tilted, kTilted);
  // It still rocks a little.
  EXPECT_NEAR(contact_force_on(sim, 1).z() / (0.3 * kG), 1.0, 0.01);
}

// Brackets poured into a bin come to rest in it; ground and walls carry their weight.
TEST(PiecesOfABody, BracketsInABinComeToRest) {
  constexpr int kBrackets = 30;
  const Scene scene = hollow("brackets_in_bin");
  Simulator sim(scene);
  run(sim, scene);
  double carried = 0.0;  // [N]
  for (int i = 1; i <= kBrackets; ++i) {
    carried += contact_force_on(sim, i).z();
    const auto place = sim.state().q.segment<3>(7 * (i - 1));
    EXPECT_LT(place.head<2>().cwiseAbs().maxCoeff(), 0.12) << i;
    EXPECT_GT(place.z(), 0.0) << i;
  }
  const double speed = sim.state().v.cwiseAbs().maxCoeff();
  RecordLargest("speed")(speed);
  EXPECT_LT(speed, 1e-4);  // they creep by compliance only [m/s, rad/s]
  // Forces between brackets cancel in the sum.
  EXPECT_NEAR(carried / (kBrackets * 0.1 * kG), 1.0, 1e-4);
}

// A peg with 0.1 mm of play falls to the floor of its hole. In a tilted hole, from which its centre
// of mass stands out, it touches the mouth on one side and the wall on the other: friction holds it
// from the tilt whose tangent is l / (mu (2 h - l - mu d)) (hollow_machines.py), here to 2 %.
TEST(PiecesOfABody, APegFallsIntoItsHoleAndJamsWhenTilted) {
  constexpr double kDepth = 0.04, kInserted = 0.015, kPlay = 1e-4;
  constexpr double kFall = kDepth - 0.002;
  // Smoothing and compliance of the contacts, and the gap of 0.1 um at the start.
  constexpr double kHeld = 1e-6;  // [m]
  const Scene scene = hollow("peg_in_hole");
  Simulator sim(scene);
  const auto place = [&](int peg) { return Vector3(sim.state().q.segment<3>(7 * peg)); };
  const Vector3 upright = place(0), slides = place(1), jams = place(2);
  double landed = 0.0, moved = 0.0;
  run(sim, scene, [&] {
    if (landed == 0.0 && upright.z() - place(0).z() > kFall - kPlay) landed = sim.state().time;
    moved = std::max(moved, (place(2) - jams).norm());
  });
  // The walls do not brake it; the scheme falls half a step ahead, and it is seen a step late.
  EXPECT_NEAR(landed, std::sqrt(2.0 * kFall / kG), 1.5 * scene.options.time_step);
  EXPECT_NEAR(upright.z() - place(0).z(), kFall, kPlay);
  EXPECT_NEAR(contact_force_on(sim, 1).z(), 0.05 * kG, 1e-6 * kG);
  EXPECT_NEAR((slides - place(1)).norm(), kDepth - kInserted, kPlay);  // on the floor
  RecordLargest("jammed_peg_moved_m")(moved);
  EXPECT_LT(moved, kHeld);
}

// An M8 nut turns down its bolt, whose slope at the pitch radius is 3.17 degrees, with friction
// 0.02 and stays with 0.15. With the radius of gyration k, the radius r of the contact, p = pitch /
// 2 pi and the friction angle f of flanks at 30 degrees, atan(mu / cos(30 degrees)), a nut sinks
// with
//   p g / (p + k^2 / (r tan(atan(p / r) - f))).
TEST(PiecesOfABody, ANutTurnsDownItsBoltBelowTheFrictionAngle) {
  constexpr double kSlope = 0.00125 / (2.0 * M_PI), kInner = 0.0033235, kOuter = 0.004, kMu = 0.02;
  constexpr double kGap = 2e-5;  // between the flanks at the start [m]
  // The seams of the thread take up to 4 % of the speed, less with smaller steps.
  constexpr double kSeams = 0.08;
  const Scene scene = hollow("nut_on_bolt");
  Simulator sim(scene);
  const auto nut = [&](int i) { return Vector3(sim.state().q.segment<3>(7 * i)); };
  const Vector3 turns = nut(0), stays = nut(1);
  run(sim, scene);
  const SpatialInertia& inertia = sim.model().body(1).inertia;
  const auto fall = [&](double r) {
    const double drive = std::tan(std::atan(kSlope / r) - std::atan(kMu / std::cos(M_PI / 6)));
    const double k2 = inertia.rotational(2, 2) / inertia.mass;
    return 0.5 * kSlope * kG / (kSlope + k2 / (r * drive)) * std::pow(sim.state().time, 2);
  };
  const double fallen = turns.z() - nut(0).z();
  RecordLargest("fall_over_that_at_the_crest")(fallen / fall(kOuter));
  EXPECT_GT(fallen, (1.0 - kSeams) * fall(kOuter));
  EXPECT_LT(fallen, fall(kInner) + kGap);
  // It turns as it sinks, but for the play.
  const VectorX& q = sim.state().q;
  const double turned = 2.0 * std::atan2(-q[6], q[3]);  // less than a whole turn, clockwise
  EXPECT_NEAR(fallen, kSlope * turned, kGap);
  EXPECT_LT((nut(1) - stays).norm(), kGap);
}

// A hand closes on the handle of a mug and lifts it until the palm is at its end stop.
TEST(PiecesOfABody, AHandLiftsAMugByItsHandle) {
  constexpr double kGrasped = 0.3;   // when the fingers have closed [s]
  constexpr double kRise = 0.1;      // rise of the palm [m]
  constexpr double kClosing = 2e-3;  // the palm's rise while they close at 0.04 m/s [m]
  // Contacts near their friction limit creep (contact/README.md).
  constexpr double kSlip = 1e-5;  // [m]
  const Scene scene = hollow("hand_on_mug");
  Simulator sim(scene);
  const int mug = sim.model().body(sim.model().num_bodies() - 1).q_index;
  const auto height = [&] { return sim.state().q[mug + 2]; };
  double first = 0.0, slip = 0.0;  // height of the mug in the hand, and its change [m]
  run(sim, scene, [&] {
    const double now = height() - sim.state().q[0];
    if (sim.state().time < kGrasped) first = now;
    slip = std::max(slip, std::abs(now - first));
  });
  RecordLargest("slip_m")(slip);
  EXPECT_LT(slip, kSlip);
  EXPECT_NEAR(height(), kRise, kClosing);
  EXPECT_EQ(contact_force_on(sim, sim.model().num_bodies() - 1, 0).norm(), 0.0);  // off the ground
  // It rests but for the creep.
  const Vector3 held = contact_force_on(sim, sim.model().num_bodies() - 1);
  EXPECT_LT((held - Vector3(0, 0, 0.3 * kG)).norm(), 1e-5 * 0.3 * kG);
}

// A pinion of 12 teeth turns a wheel of 24, which is braked: the angles are as 2 to -1 to within
// the backlash, so no tooth passes another.
TEST(PiecesOfABody, GearsTurnAsTheirTeethAreCounted) {
  constexpr double kBacklash = 2e-4 / 0.03;  // on the pinion's pitch circle [rad]
  const Scene scene = hollow("gears");
  Simulator sim(scene);
  double off = 0.0;
  run(sim, scene, [&] {
    const VectorX turned = sim.state().q - scene.q;
    off = std::max(off, std::abs(turned[0] + 2.0 * turned[1]));
  });
  RecordLargest("off_rad")(off);
  EXPECT_LT(off, kBacklash);
  EXPECT_GT(sim.state().q[0], 5.0 * 2.0 * M_PI);  // over five turns in six seconds
}

// The inverse gives back random forces on bodies in contact as pieces.
TEST(PiecesOfABody, TheInverseFindsAppliedForces) {
  constexpr double kForce = 1e-3;  // turns a link of 50 g by 33 rad/s^2 [N, N m]
  for (const char* name : {"ball_in_cup", "chain_20", "ring_on_peg", "mug_on_hook",
                           "brackets_in_bin", "peg_in_hole", "hand_on_mug", "gears"}) {
    Simulator sim(hollow(name));
    Random random(2);
    const double error = recover(sim, 300, kForce, random);
    RecordLargest record(name);
    record(error);
    EXPECT_LT(error, 1e-8) << name;
  }
}

}  // namespace
}  // namespace counterpoint::test::pieces_test
