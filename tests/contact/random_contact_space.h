// Random contact problems without bodies: A, c and laws, from a seed.
#pragma once

#include <cmath>
#include <vector>

#include "contact/random_problem.h"
#include "counterpoint/contact/contact_space.h"
#include "counterpoint/contact/kinetic_energy/kinetic_energy.h"

namespace counterpoint::contact::testing {

/// A = root root' of random rank (one in two is deficient), rows of each part scaled as for masses
/// between 1 and mass_ratio; `scale` gets the inverse mass of each part.
inline MatrixX random_matrix(Random& random, const std::vector<int>& rows, double mass_ratio,
                             std::vector<double>& scale) {
  int n = 0;
  for (const int r : rows) n += r;
  MatrixX root(n, random.coin() ? n : random.integer(1, n));
  for (int i = 0; i < root.size(); ++i) root.data()[i] = random.signed_unit();
  scale.clear();
  int row = 0;
  for (const int r : rows) {
    const double factor = random.log_uniform(1.0 / std::sqrt(mass_ratio), 1.0);
    root.middleRows(row, r) *= factor;
    scale.push_back(factor * factor);
    row += r;
  }
  return root * root.transpose();
}

inline ContactSpaceProblem random_contact_space(Random& random, double mass_ratio,
                                                double max_friction) {
  const int n = random.integer(1, 6);
  ContactSpaceProblem problem;
  std::vector<double> scale;
  problem.A = random_matrix(random, std::vector<int>(n, 3), mass_ratio, scale);
  problem.c.resize(3 * n);
  for (int i = 0; i < 3 * n; ++i) problem.c[i] = random.signed_unit() * std::sqrt(scale[i / 3]);
  for (int i = 0; i < n; ++i) {
    problem.mu.push_back(random.integer(0, 9) == 0 ? 0.0 : random.uniform(0.0, max_friction));
  }
  return problem;
}

struct RandomKineticEnergyOptions {
  double mass_ratio = 1e6;
  double min_friction = 0.0, max_friction = 10.0;
  double compliance_low = 1e-8, compliance_high = 1e-2;
  double smoothing_low = 1e-8, smoothing_high = 1e-2;  ///< k and k_q relative to m v^2
  bool only_cones = false;                             ///< with friction, and k > 0
};

struct KineticEnergyCase {
  KineticEnergyProblem problem;
  VectorX c;
};

/// Laws of every type and dimension, penetrating and separated, approaching and separating.
inline KineticEnergyCase random_kinetic_energy(Random& random,
                                               const RandomKineticEnergyOptions& options) {
  KineticEnergyCase out;
  KineticEnergyProblem& problem = out.problem;
  RandomOptions law_options;
  law_options.max_friction = options.max_friction;
  std::vector<int> rows;
  const int n = random.integer(1, 6);
  for (int i = 0; i < n; ++i) {
    constexpr LawType kTypes[] = {LawType::kFrictionCone, LawType::kFrictionCone,
                                  LawType::kFrictionCone, LawType::kUnilateral,
                                  LawType::kEquality,     LawType::kDryFriction};
    const LawType type = options.only_cones ? LawType::kFrictionCone : kTypes[random.integer(0, 5)];
    problem.laws.push_back(random_law(random, law_options, type));
    Law& law = problem.laws.back();
    for (int r = 0; r < law.rows - 1; ++r) {
      law.friction[r] = std::max(law.friction[r], options.min_friction);
    }
    law.bias.fill(0.0);
    if (!options.only_cones && random.coin()) law.bias[0] = random.uniform(0.0, 1.0);  // `lagged`
    rows.push_back(law.rows);
  }
  std::vector<double> scale;
  problem.A = random_matrix(random, rows, options.mass_ratio, scale);
  out.c.resize(problem.A.rows());
  for (int i = 0; i < out.c.size(); ++i) out.c[i] = random.signed_unit();
  const double k = random.log_uniform(options.smoothing_low, options.smoothing_high);
  double lightest = 0.0;
  for (int i = 0; i < n; ++i) {
    Law& law = problem.laws[i];
    const double gap_speed = random.uniform(-0.2, 0.5);
    problem.gap_speed.push_back(gap_speed);
    const double eps = random.log_uniform(options.compliance_low, options.compliance_high);
    law.regularizer = scale[i] * distant_regularizer(eps, gap_speed, 0.2);
    law.smoothing = options.only_cones || random.coin() ? k / scale[i] : 0.0;
    law.bound = random.uniform(0.0, 1.0) / scale[i];
    lightest = std::max(lightest, scale[i]);
  }
  // At rest v_N is about sqrt(a k_q): the bound is the logarithm there, and quadratic where pushed.
  problem.velocity_smoothing = k / lightest;
  problem.continuation_speed = 0.1 * std::sqrt(k);
  return out;
}

}  // namespace counterpoint::contact::testing
