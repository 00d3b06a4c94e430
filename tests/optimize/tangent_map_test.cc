// Derivatives of configuration differences against central differences, for every joint type.
#include "counterpoint/engine/optimize/terms/tangent_map.h"

#include <gtest/gtest.h>

#include "counterpoint/engine/dynamics.h"
#include "support/random_model.h"

namespace counterpoint::optimization::tangent_map_test {
namespace {

/// Central differences with step 1e-6: error about 1e-16 / 1e-6 plus 1e-12 times third derivatives,
/// which grow towards a rotation by pi.
constexpr double kStep = 1e-6, kTolerance = 1e-7;

MatrixX dense(const TangentMap& map, const std::vector<int>& rotations) {
  MatrixX out = map.diagonal.asDiagonal();
  for (std::size_t i = 0; i < rotations.size(); ++i)
    out.block<3, 3>(rotations[i], rotations[i]) = map.blocks[i];
  return out;
}

TEST(TangentMap, DifferencesOfConfigurationsInEitherOfThem) {
  for (int seed = 0; seed < 10; ++seed) {
    const Model model = test::make_random_model(static_cast<std::uint64_t>(seed));
    const int nv = model.nv();
    const VectorX q = test::random_configuration(model, 7 + static_cast<std::uint64_t>(seed));
    VectorX to = q, d(nv), high(nv), low(nv), moved = q;
    integrate_configuration(model, q, test::random_vector(nv, 3), 1.0, to);
    configuration_difference(model, q, to, d);
    TangentMap by_from, by_to;
    const std::vector<int> rotations = rotation_starts(model);
    differentiate_difference(d, rotations, by_from, by_to);
    MatrixX from_columns(nv, nv), to_columns(nv, nv);
    for (int j = 0; j < nv; ++j) {
      const VectorX unit = VectorX::Unit(nv, j);
      integrate_configuration(model, to, unit, kStep, moved);
      configuration_difference(model, q, moved, high);
      integrate_configuration(model, to, unit, -kStep, moved);
      configuration_difference(model, q, moved, low);
      to_columns.col(j) = (high - low) / (2.0 * kStep);
      integrate_configuration(model, q, unit, kStep, moved);
      configuration_difference(model, moved, to, high);
      integrate_configuration(model, q, unit, -kStep, moved);
      configuration_difference(model, moved, to, low);
      from_columns.col(j) = (high - low) / (2.0 * kStep);
    }
    EXPECT_LT((dense(by_to, rotations) - to_columns).cwiseAbs().maxCoeff(), kTolerance) << seed;
    EXPECT_LT((dense(by_from, rotations) - from_columns).cwiseAbs().maxCoeff(), kTolerance) << seed;
  }
}

TEST(TangentMap, ProductIsThatOfTheDenseMatrix) {
  const Model model = test::make_random_model(1);
  const std::vector<int> rotations = rotation_starts(model);
  TangentMap map, unused;
  differentiate_difference(test::random_vector(model.nv(), 5), rotations, unused, map);
  const MatrixX A = MatrixX::Random(7, model.nv());
  MatrixX out = MatrixX::Zero(7, model.nv());
  add_product(A, map, rotations, out);
  EXPECT_LT((out - A * dense(map, rotations)).cwiseAbs().maxCoeff(), 1e-14);  // round-off
}

}  // namespace
}  // namespace counterpoint::optimization::tangent_map_test
