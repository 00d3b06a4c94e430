#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/identifiability.h"

namespace counterpoint::estimation {
namespace {

/// A column counts as dependent if this share of it, or less, is not explained by others: files
/// round pi to a few figures.
constexpr double kDependent = 1e-4;
/// States for each body.
constexpr int kStates = 8;
/// Terms of a name; coefficients below the second figure are not named.
constexpr int kTerms = 6;
constexpr double kNamed = 1e-4;

constexpr const char* kNames[] = {"m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz"};

/// Rows of the regressor at random states.
MatrixX regressor_rows(const Model& model) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-2.0, 2.0);
  const int states = kStates * model.num_bodies();
  MatrixX out(states * model.nv(), 10 * (model.num_bodies() - 1)), Y;
  Dynamics dynamics(model);
  VectorX q(model.nq()), step(model.nv()), v(model.nv()), a(model.nv());
  for (int state = 0; state < states; ++state) {
    for (VectorX* x : {&step, &v, &a})
      for (double& value : *x) value = uniform(generator);
    integrate_configuration(model, model.default_q(), step, 1.0, q);
    dynamics.set_state(q, v);
    dynamics.inertia_regressor(a, Y);
    out.middleRows(static_cast<Eigen::Index>(state) * model.nv(), model.nv()) = Y;
  }
  return out;
}

std::string name_of(const Model& model, const Eigen::RowVectorXd& combination, Eigen::Index own) {
  const auto term = [&](Eigen::Index i) {
    return fmt::format("{}({})", kNames[i % 10], model.joint(static_cast<int>(i / 10)).link);
  };
  std::string out = term(own);
  int named = 1, more = 0;
  for (Eigen::Index i = 0; i < combination.size(); ++i) {
    const double share = combination[i];
    if (i == own || std::abs(share) < kNamed) continue;
    if (++named > kTerms) {
      ++more;
      continue;
    }
    const bool plain = std::abs(std::abs(share) - 1.0) < kNamed;
    out += fmt::format(" {} {}{}", share < 0.0 ? '-' : '+',
                       plain ? "" : fmt::format("{:.4g} ", std::abs(share)), term(i));
  }
  return more > 0 ? fmt::format("{} and {} more", out, more) : out;
}

}  // namespace

BaseParameters base_parameters(const Model& model) {
  const MatrixX W = regressor_rows(model);
  MatrixX basis(W.rows(), W.cols()), chosen(W.rows(), W.cols());
  MatrixX shares = MatrixX::Zero(W.cols(), W.cols());  // shares of the chosen columns
  const double longest = W.colwise().norm().maxCoeff();
  std::vector<Eigen::Index> own;
  for (Eigen::Index i = 0; i < W.cols(); ++i) {
    const auto count = static_cast<Eigen::Index>(own.size());
    const double length = W.col(i).norm();
    if (length <= kDependent * longest) continue;
    VectorX rest = W.col(i) / length;
    for (int twice = 0; twice < 2; ++twice)
      rest -= basis.leftCols(count) * (basis.leftCols(count).transpose() * rest);
    if (rest.norm() > kDependent) {
      basis.col(count) = rest.normalized();
      chosen.col(count) = W.col(i);
      shares(count, i) = 1.0;
      own.push_back(i);
    } else {
      shares.col(i).head(count) = chosen.leftCols(count).householderQr().solve(W.col(i));
    }
  }
  BaseParameters out;
  out.combinations = shares.topRows(static_cast<Eigen::Index>(own.size()));
  for (std::size_t k = 0; k < own.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const double largest = out.combinations.row(row).cwiseAbs().maxCoeff();
    for (double& share : out.combinations.row(row))
      if (std::abs(share) < kDependent * largest) share = 0.0;
    out.names.push_back(name_of(model, out.combinations.row(row), own[k]));
  }
  return out;
}

}  // namespace counterpoint::estimation
