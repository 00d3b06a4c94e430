// Random problems of the kinetic-energy formulation of 2011, from a seed.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "accuracy/kinetic_energy/kinetic_energy.h"
#include "contact/random_contact_space.h"

namespace counterpoint::contact::testing {

struct RandomKineticEnergyOptions {
  double mass_ratio = 1e6;
  double min_friction = 0.0, max_friction = 10.0;
  double compliance_low = 1e-8, compliance_high = 1e-2;
  double smoothing_low = 1e-8, smoothing_high = 1e-2;  ///< k and k_q relative to m v^2
  bool only_cones = false;                             ///< only laws with friction, and k > 0
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
    if (!options.only_cones && random.coin())
      law.bias[0] = random.uniform(0.0, 1.0);  // bias of the `lagged` law
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
  // At rest v_N is about sqrt(a k_q): the bound is logarithmic there, and quadratic for approaching
  // contacts.
  problem.velocity_smoothing = k / lightest;
  problem.continuation_speed = 0.1 * std::sqrt(k);
  return out;
}

}  // namespace counterpoint::contact::testing
