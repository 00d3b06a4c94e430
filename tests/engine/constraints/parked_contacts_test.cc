// Contacts that cannot act in a step have no rows. A body thrown against them gets rows in the same
// step, and the inverse tells their forces from the applied ones.
#include "counterpoint/engine/constraints/parked_contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "support/allocation_guard.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::parked_contacts_test {
namespace {

/// The solver's relative residual (1e-10), as in inverse_test.cc.
constexpr double kRecovered = 1e-8;
constexpr double kStep = 0.01;

/// A box above the ground: its corners are candidates at any height below the margin of 10 mm.
Scene box_at(double height, double smoothing = 1e-13) {
  Scene scene = test::box_on_plane({.height = height});
  scene.options.time_step = kStep;
  scene.options.contact.smoothing = smoothing;
  return scene;
}

TEST(ParkedContacts, HaveNoRowsWhereTheyStayOpen) {
  Simulator sim(box_at(8e-3));
  const double gap = parking_gap(sim.options().contact, kStep);
  ASSERT_LT(gap, 4e-3);
  const StepReport report = sim.step();
  ASSERT_TRUE(report.succeeded());
  EXPECT_EQ(report.constraint_rows, 0);
  EXPECT_EQ(report.newton_iterations, 0);
  // Near contacts have none either until a step closes them; then all four corners have.
  Simulator near(box_at(0.5 * gap));
  EXPECT_EQ(near.step().constraint_rows, 0);
  StepReport last;
  for (int i = 0; i < 20 && last.constraint_rows == 0; ++i) last = near.step();
  EXPECT_EQ(last.constraint_rows, 12);
}

/// A box on an edge, its other two lower corners 1 mm above the ground.
Scene box_on_edge() {
  constexpr double kTilt = 5e-3, kHalf = 0.1;  // [rad], [m]
  Scene scene = box_at(0.0);
  scene.q[2] = kHalf * (std::cos(kTilt) + std::sin(kTilt));
  scene.q.segment<4>(3) << std::cos(0.5 * kTilt), 0.0, std::sin(0.5 * kTilt), 0.0;
  return scene;
}

// The law gives the corners in the air at most 1e-10 of the weight (kOpenWeight). The inverse has
// rows for all four: the step without them is recovered as exactly as any other.
TEST(InactiveContacts, OfABoxOnItsEdgeChangeNoForce) {
  Simulator sim(box_on_edge());
  const State before = sim.state();
  const StepReport report = sim.step();
  ASSERT_TRUE(report.succeeded());
  EXPECT_EQ(report.constraint_rows, 6);
  const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
  ASSERT_EQ(inverse.contacts.size(), 4U);
  const double weight = 9.81;  // [N], of 1 kg
  int open = 0;
  for (const ContactForce& contact : inverse.contacts)
    open += contact.force.norm() < 1e-10 * weight;
  EXPECT_EQ(open, 2);
  EXPECT_LE(inverse.applied_force.lpNorm<Eigen::Infinity>(), 1e-9 * inverse.force_scale);
}

// Pushed down, the corners in the air reach the ground within the step: it holds them.
TEST(InactiveContacts, GetRowsWhereTheStepClosesThem) {
  Simulator sim(box_on_edge());
  sim.input().applied_force[4] = -20.0;
  const StepReport report = sim.step();
  ASSERT_TRUE(report.succeeded());
  EXPECT_EQ(report.constraint_rows, 12);
  ASSERT_TRUE(sim.step().succeeded());
  EXPECT_LE(sim.step().max_penetration, 1e-6);
}

// A softened law acts at a distance: then all near contacts have rows, in the inverse as well.
TEST(InactiveContacts, AreNoneInASoftenedStep) {
  Simulator sim(box_on_edge());
  const State before = sim.state();
  sim.input().softening.factor = 100.0;
  const StepReport report = sim.step();
  ASSERT_TRUE(report.succeeded());
  EXPECT_EQ(report.constraint_rows, 12);
  const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
  EXPECT_LE(inverse.applied_force.lpNorm<Eigen::Infinity>(), 1e-9 * inverse.force_scale);
}

// Smoothing that acts at a distance: k / gap, 1e-3 m of the weight over 8e-3 m and more.
TEST(ParkedContacts, AreNoneWhereSmoothingActsAcrossTheGap) {
  EXPECT_EQ(Simulator(box_at(8e-3, 1e-3)).step().constraint_rows, 12);
}

TEST(ParkedContacts, HoldWhatIsThrownAgainstThemInOneStepAndAreInverted) {
  for (const double height : {3e-3, 6e-3, 9e-3}) {
    for (const double way : {0.5, 0.95, 1.05, 2.0, 100.0}) {
      Simulator sim(box_at(height));
      const State before = sim.state();
      sim.input().applied_force[2] = -way * height / (kStep * kStep);
      sim.input().applied_force[0] = 20.0;
      sim.input().applied_force[4] = 0.3;
      ASSERT_TRUE(sim.step().succeeded());
      const double yields =
          kStep * sim.options().contact.compliance * std::abs(sim.input().applied_force[2]);
      if (way > 1.5) {
        EXPECT_NEAR(sim.state().q[2] - before.q[2], -height, 1e-4 + yields);
      }
      const Inverse& inverse = sim.inverse(before.q, before.v, sim.state().v);
      const VectorX error = inverse.applied_force - sim.input().applied_force;
      EXPECT_LE(error.cwiseAbs().maxCoeff(), kRecovered * inverse.force_scale)
          << "height " << height << " way " << way;
    }
  }
}

// A box thrown down while it tilts: no corner may end below the ground.
TEST(ParkedContacts, NoCornerIsPassedOver) {
  for (int i = 0; i < 40; ++i) {
    Scene scene = box_at(9e-3);
    Simulator sim(std::move(scene));
    sim.input().applied_force[2] = -20.0 * i;
    sim.input().applied_force[3] = 0.4 * (i % 7 - 3);
    sim.input().applied_force[4] = 0.4 * (i % 5 - 2);
    ASSERT_TRUE(sim.step().succeeded());
    sim.input().applied_force.setZero();
    const StepReport report = sim.step();
    ASSERT_TRUE(report.succeeded());
    // The only error allowed is from rotation within a step, (h w)^2 / 2 of the half length.
    const double angle = kStep * sim.state().v.segment<3>(3).norm();
    EXPECT_LE(report.max_penetration, 0.1 * angle * angle + 1e-6) << i;
  }
}

/// A crowded scene, and its constraints at velocities of choice.
struct Crowd {
  explicit Crowd(Scene s)
      : scene(std::move(s)),
        data(scene.model),
        finder(scene.model, compute_inverse_weights(scene.model, data)),
        effects(active_effects(called_for(scene.model, finder.collider()), scene.options.effects)) {
  }
  const Model& model() const { return scene.model; }
  StepContext at(const VectorX& v) const { return {model(), scene.options, effects, scene.q, v}; }
  void find(const VectorX& v) {
    compute_poses(model(), scene.q, data);
    compute_velocities(model(), v, data);
    finder.find(at(v), data, found, counts);
  }
  /// Returns the contacts of `pairs` as parked contacts with the gaps and friction of their laws.
  std::vector<ParkedContact> contacts_of(const std::vector<FarPair>& pairs) {
    ConstraintSet all = found;
    std::vector<ParkedContact> out;
    finder.contacts().unpark_all(at(scene.v), data, all);
    for (size_t i = 0; i < all.contacts.size(); ++i) {
      const std::pair pair(all.contacts[i].geometry_a, all.contacts[i].geometry_b);
      if (std::any_of(pairs.begin(), pairs.end(),
                      [&](const FarPair& far) { return far.geometries == pair; }))
        out.push_back(parked(all.contacts[i], all.pairs[i]));
    }
    return out;
  }
  ParkedContact parked(const collision::Candidate& candidate, const PairConstraint& pair) const {
    ParkedContact out{candidate, pair.body_a, pair.body_b};
    out.velocity = relative_velocity_at(pair.position, pair.body_a, pair.body_b, data, data.V);
    return by_law(out, pair, scene.options.time_step);
  }

  Scene scene;
  Data data;
  ConstraintFinder finder;
  EffectSet effects;
  EffectCounts counts;
  ConstraintSet found;
};

/// Random velocities of up to `speed` [m/s, rad/s], most of them small.
VectorX random_velocity(std::mt19937_64& generator, Eigen::Index size, double speed) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  VectorX v(size);
  for (double& x : v) x = speed * std::pow(uniform(generator), 5);
  return v;
}

class FarPairs : public testing::TestWithParam<const char*> {
 protected:
  Crowd crowd() const {
    return Crowd(load_scene(test::source_dir() + "/data/scenes/" + GetParam() + ".yaml"));
  }
};

// If is_far holds for a pair, none of its contacts is near enough for rows, so that skipping the
// pair loses nothing.
TEST_P(FarPairs, HaveNoContactThatWouldHaveRows) {
  Crowd c = crowd();
  const SimulationOptions& options = c.scene.options;
  const double h = options.time_step, near = parking_gap(options.contact, h);
  std::mt19937_64 generator(1);
  size_t seen = 0;
  for (int i = 0; i < 60; ++i) {
    c.find(random_velocity(generator, c.model().nv(), 1.0 + i));
    for (const ParkedContact& parked : c.contacts_of(c.found.far)) {
      ++seen;
      EXPECT_FALSE(is_near(parked, near, h));
    }
  }
  EXPECT_GT(seen, 100u);
}

// The same for stays_far, with the velocity after the step.
TEST_P(FarPairs, ThatStayFarHaveNoContactThatIsRunInto) {
  Crowd c = crowd();
  const SimulationOptions& options = c.scene.options;
  const double h = options.time_step;
  std::mt19937_64 generator(2);
  std::vector<Motion> V(static_cast<size_t>(c.model().num_bodies()));
  size_t seen = 0, left = 0;
  for (int i = 0; i < 60; ++i) {
    const VectorX v = random_velocity(generator, c.model().nv(), 1.0 + i);
    const VectorX w = v + random_velocity(generator, c.model().nv(), 1.0 + i);
    c.find(v);
    ConstraintSet after = c.found;
    c.finder.find_overrun(c.at(v), {w}, c.data, after);
    left += c.found.far.size() - after.far.size();
    compute_body_velocities(c.model(), w, c.data, V);
    for (const ParkedContact& parked : c.contacts_of(after.far)) {
      ++seen;
      EXPECT_FALSE(is_reached(parked, options.contact, h, V, c.data));
    }
  }
  EXPECT_GT(seen, 50u);
  EXPECT_GT(left, 10u);
}

// A parked contact has at most the gap and at least the slip of its law, and gets rows no later.
TEST_P(FarPairs, ParkedContactsKnowNoMoreThanTheirGap) {
  Crowd c = crowd();
  std::mt19937_64 generator(3);
  size_t seen = 0;
  for (int i = 0; i < 60; ++i) {
    c.find(random_velocity(generator, c.model().nv(), 1.0 + i));
    const std::vector<ParkedContact> parked = c.found.parked;
    const size_t with_rows = c.found.contacts.size();
    c.found.far.clear();
    c.finder.contacts().unpark_all(c.at(c.scene.v), c.data, c.found);
    ASSERT_EQ(c.found.contacts.size(), with_rows + parked.size());
    for (size_t k = 0; k < parked.size(); ++k) {
      const ParkedContact exact =
          c.parked(c.found.contacts[with_rows + k], c.found.pairs[with_rows + k]);
      ++seen;
      EXPECT_LE(parked[k].gap, exact.gap + 1e-15);  // rounding
      EXPECT_GE(parked[k].slip, exact.slip);
      EXPECT_GE(parked[k].spin, exact.spin);
      EXPECT_EQ(parked[k].velocity, exact.velocity);
    }
  }
  EXPECT_GT(seen, 100u);
}

INSTANTIATE_TEST_SUITE_P(Scenes, FarPairs,
                         testing::Values("piles/pile_16", "piles/chain_into_pile",
                                         "piles/pile_64_overlap"));

TEST(ParkedContacts, StepsThatAreSolvedAgainDoNotAllocate) {
  if (!test::counts_allocations()) GTEST_SKIP() << "AddressSanitizer owns malloc";
  Simulator sim(box_at(9e-3));
  const State start = sim.state();
  sim.input().applied_force[2] = -300.0;
  for (int i = 0; i < 3; ++i) {
    sim.set_state(start);
    const std::size_t before = test::allocation_count();
    const StepReport report = sim.step();
    const std::size_t after = test::allocation_count();
    ASSERT_TRUE(report.succeeded());
    EXPECT_EQ(report.constraint_rows, 12);
    if (i > 1) {  // once both states have been seen
      EXPECT_EQ(after, before);
    }
  }
}

}  // namespace
}  // namespace counterpoint::parked_contacts_test
