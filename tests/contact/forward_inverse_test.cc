// Forward-inverse theorem of this library: the inverse returns the input of the forward problem to
// 1e-9 relative, for every law, row type, dimension and friction model; masses from 1 to 1e6,
// friction from 0 to 10, compliance from 1e-8, smoothing from 0, dependent constraints, closing and
// opening contacts.
//
// Forward and inverse evaluate the same function f(w+), so comparing f would prove nothing. The
// tests compare quantities that only the forward problem knows: the external impulse, which
// balances the momentum (problems with bodies), and the free velocity c (problems without). Besides
// 1e-9 every comparison allows the error that the round-off of w+ alone explains (rounding.h); a
// test also bounds how often that is the larger of the two.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <ostream>
#include <string>
#include <tuple>
#include <vector>

#include "contact/random_contact_space.h"
#include "contact/rounding.h"
#include "contact/trials.h"
#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact::forward_inverse_test {
namespace {

using testing::dense_jacobian;
using testing::dense_mass;
using testing::exact_settings;
using testing::for_trials;
using testing::kUnit;
using testing::law_rounding;
using testing::pushed_rounding;
using testing::Random;
using testing::random_contact_space;
using testing::random_problem;
using testing::RandomOptions;

constexpr double kReturned = 1e-9;  // required relative error
// A step that stops at the round-off floor may be this many floors away (kFloorFactor in
// newton.cc).
constexpr double kFloor = 4.0;

// Counts the problems that the solver reported as unsolved, with their trial numbers.
class Unsolved {
 public:
  void add(int trial) {
    ++count_;
    trials_.append(" ").append(std::to_string(trial));
  }
  // All problems should be solved; a caller that allows failures gives the reason.
  void expect_at_most(int allowed) const {
    ::testing::Test::RecordProperty("unsolved", count_);
    EXPECT_LE(count_, allowed) << "trials" << trials_;
  }

 private:
  int count_ = 0;
  std::string trials_;
};

// Bounds how often the round-off term exceeds 1e-9; if it did mostly, the theorem would say little.
void expect_mostly_asked(int floor_dominates, int trials) {
  EXPECT_LT(floor_dominates, trials / 2);
}

enum class Friction { kConvex, kLagged, kCoulomb };

struct Kind {
  const char* name;
  LawType type;
  int rows;  // 0: all kinds of constraints in one problem
  bool anisotropic = false;
};

void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

constexpr Kind kKinds[] = {
    {"unilateral", LawType::kUnilateral, 1},
    {"slide", LawType::kFrictionCone, 3},
    {"slide_anisotropic", LawType::kFrictionCone, 3, true},
    {"planar", LawType::kFrictionCone, 2},
    {"spin", LawType::kFrictionCone, 4},
    {"spin_anisotropic", LawType::kFrictionCone, 4, true},
    {"roll", LawType::kFrictionCone, 6},
    {"roll_anisotropic", LawType::kFrictionCone, 6, true},
    {"equality_1", LawType::kEquality, 1},
    {"equality_2", LawType::kEquality, 2},
    {"equality_3", LawType::kEquality, 3},
    {"equality_4", LawType::kEquality, 4},
    {"equality_5", LawType::kEquality, 5},
    {"equality_6", LawType::kEquality, 6},
    {"spring", LawType::kSpring, 1},
    {"dry_friction", LawType::kDryFriction, 1},
    {"mixed", LawType::kFrictionCone, 0},
};

Problem make_problem(Random& random, const Kind& kind, Friction friction) {
  RandomOptions options;
  options.mass_ratio = 1e6;
  options.max_friction = 10.0;
  options.compliance_low = 1e-8;
  options.coulomb = friction == Friction::kCoulomb;
  options.hard = random.coin();
  if (kind.rows > 0) {
    options.only_type = kind.type;
    options.only_rows = kind.rows;
    options.isotropic = !kind.anisotropic;
  }
  return random_problem(random, options);
}

// The lagged model is the convex law with De Saxce's shift of the last velocity as its bias.
void add_lagged_shift(Problem& problem, const VectorX& before) {
  VectorX y;
  compute_constraint_velocity(problem, before, y);
  for (int c = 0; c < problem.num_constraints(); ++c) {
    Law& law = problem.law(c);
    if (law.type == LawType::kFrictionCone)
      law.bias[0] += de_saxce_shift(law, y.data() + problem.first_row(c));
  }
}

// For independent constraints the momentum balance determines each impulse: least squares in J'.
void expect_impulses_balance(const Problem& problem, const VectorX& w, const VectorX& f,
                             const VectorX& allowed) {
  const MatrixX mass = dense_mass(problem);
  const VectorX weight = mass.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixX push = weight.asDiagonal() * dense_jacobian(problem).transpose();
  if (push.cols() == 0 || push.cols() > push.rows()) return;
  const Eigen::ColPivHouseholderQR<MatrixX> qr(push);
  const double pivot = std::abs(qr.matrixR()(push.cols() - 1, push.cols() - 1));
  if (pivot < 1e-2 * qr.maxPivot()) return;  // J' is nearly rank deficient
  const VectorX momentum = mass * (w - VectorX(problem.free_velocity()));
  const VectorX balanced = qr.solve(weight.cwiseProduct(momentum));
  // The pivot underestimates the condition number by at most the dimension.
  const double amplification = static_cast<double>(push.cols()) / pivot;
  EXPECT_LE((f - balanced).norm(), amplification * weight.cwiseProduct(allowed).norm());
}

using Param = std::tuple<Kind, Friction>;
class ForwardInverse : public ::testing::TestWithParam<Param> {};

TEST_P(ForwardInverse, ReturnsTheAppliedImpulse) {
  const auto& [kind, friction] = GetParam();
  Solver solver;
  constexpr int kTrials = 250;
  int floor_dominates = 0;
  Unsolved unsolved;
  for_trials(1, kTrials, [&, kind = kind, friction = friction](Random& random, int trial) {
    Problem problem = make_problem(random, kind, friction);
    VectorX before(problem.num_velocities());
    for (int i = 0; i < before.size(); ++i) before[i] = random.signed_unit();
    if (friction == Friction::kLagged) add_lagged_shift(problem, before);
    const MatrixX mass = dense_mass(problem);
    const VectorX applied = mass * (VectorX(problem.free_velocity()) - before);

    VectorX w = before, f;
    const Report& report = solver.solve(problem, exact_settings(), w, f);
    if (!succeeded(report.status)) return unsolved.add(trial);
    VectorX inverse, pushed;
    compute_impulse(problem, w, inverse);
    EXPECT_EQ(f, inverse);
    compute_generalized_impulse(problem, inverse, pushed);
    const VectorX momentum = mass * (w - before), returned = momentum - pushed;

    const VectorX size = mass.diagonal().cwiseSqrt().cwiseInverse();
    const Residuals residuals = compute_residuals(problem, w, inverse);
    const double share =
        kMomentumShare * std::hypot(w.cwiseQuotient(size).norm(),
                                    problem.free_velocity().cwiseQuotient(size).norm());
    const double asked = kReturned * (residuals.momentum_scale + share);
    const double additions = static_cast<double>(w.size()) + 2.0;
    const VectorX rounding = kFloor * pushed_rounding(problem, w) +
                             kUnit * additions *
                                 (mass.cwiseAbs() * (w.cwiseAbs() + 2.0 * before.cwiseAbs() +
                                                     problem.free_velocity().cwiseAbs()));
    const double floor = size.cwiseProduct(rounding).norm();
    EXPECT_LE(size.cwiseProduct(returned - applied).norm(), asked + floor)
        << status_name(report.status) << " asked " << asked << " floor " << floor;
    if (floor > asked) ++floor_dominates;
    const VectorX allowed = rounding + asked * size.cwiseInverse();
    expect_impulses_balance(problem, w, inverse, allowed);
  });
  // A solution exists, also with Coulomb friction, so an unsolved problem is a fault of the solver.
  unsolved.expect_at_most(0);
  expect_mostly_asked(floor_dominates, kTrials);
}

std::string name_of(const ::testing::TestParamInfo<Param>& test) {
  constexpr const char* kNames[] = {"convex", "lagged", "coulomb"};
  const auto& [kind, friction] = test.param;
  return std::string(kind.name) + "_" + kNames[static_cast<int>(friction)];
}

std::vector<Param> all_cases() {
  std::vector<Param> cases;
  for (const Kind& kind : kKinds) {
    for (const Friction friction : {Friction::kConvex, Friction::kLagged, Friction::kCoulomb}) {
      if (kind.type == LawType::kFrictionCone || friction == Friction::kConvex) {
        cases.emplace_back(kind, friction);
      }
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(EveryLaw, ForwardInverse, ::testing::ValuesIn(all_cases()), name_of);

class ContactSpaceForwardInverse : public ::testing::TestWithParam<bool> {};

TEST_P(ContactSpaceForwardInverse, ReturnsTheFreeVelocity) {
  constexpr int kTrials = 2000;
  int floor_dominates = 0;
  Unsolved unsolved;
  for_trials(2, kTrials, [&](Random& random, int trial) {
    const ContactSpaceProblem problem = random_contact_space(random, 1e6, 10.0);
    ContactSpaceOptions options;
    options.coulomb = GetParam();
    options.compliance = random.log_uniform(1e-8, 1e-2);
    options.smoothing = random.coin() ? 0.0 : random.log_uniform(1e-12, 1e-2);
    const ContactSpaceSolution forward = solve_contact_space(problem, options, Settings{});
    if (!succeeded(forward.report.status)) return unsolved.add(trial);
    const ContactSpaceInverse inverse = invert_contact_space(problem, forward.v, options);
    EXPECT_EQ(inverse.f, forward.f);
    const MatrixX size = problem.A.cwiseAbs();
    VectorX df(forward.f.size());
    for (int i = 0; i < problem.num_contacts(); ++i) {
      const Rows y = forward.v.segment<3>(3 * i);
      const Rows dy = kUnit * static_cast<double>(df.size() + 2) *
                      (problem.c.cwiseAbs() + size * forward.f.cwiseAbs()).segment<3>(3 * i);
      df.segment<3>(3 * i) = law_rounding(contact_law(problem, options, i), y, dy);
    }
    const double asked = kReturned * (problem.c.norm() + (size * forward.f.cwiseAbs()).norm());
    const double floor = kFloor * (size * df).norm();
    EXPECT_LE((inverse.c - problem.c).norm(), asked + floor) << asked << " " << floor;
    if (floor > asked) ++floor_dominates;
  });
  unsolved.expect_at_most(0);
  expect_mostly_asked(floor_dominates, kTrials);
}

INSTANTIATE_TEST_SUITE_P(Friction, ContactSpaceForwardInverse, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "coulomb" : "convex"; });

}  // namespace
}  // namespace counterpoint::contact::forward_inverse_test
