#include "counterpoint/engine/estimate/identifiability.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace counterpoint::estimation {
namespace {

/// Parts of a direction below this share of its largest are left out.
constexpr double kVisible = 0.03;
/// Parameters that a sentence names.
constexpr std::size_t kNamedParts = 4;

VectorX ranges_of(const std::vector<Parameter>& parameters) {
  VectorX out(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    out[static_cast<Eigen::Index>(i)] =
        p.logarithmic ? std::log(p.upper / p.lower) : p.upper - p.lower;
  }
  return out;
}

/// Brings the columns into the form with the fewest parts: each has a parameter of its own, which
/// is 1 in it and 0 in the others (reduced echelon form, largest pivots first).
void make_sparse(MatrixX& columns) {
  std::vector<char> used(static_cast<std::size_t>(columns.rows()), 0);
  for (Eigen::Index c = 0; c < columns.cols(); ++c) {
    Eigen::Index pivot = 0, from = c;
    double most = -1.0;
    for (Eigen::Index k = c; k < columns.cols(); ++k)
      for (Eigen::Index i = 0; i < columns.rows(); ++i)
        if (!used[static_cast<std::size_t>(i)] && std::abs(columns(i, k)) > most) {
          most = std::abs(columns(i, k));
          pivot = i;
          from = k;
        }
    columns.col(c).swap(columns.col(from));
    columns.col(c) /= columns(pivot, c);
    used[static_cast<std::size_t>(pivot)] = 1;
    for (Eigen::Index k = 0; k < columns.cols(); ++k)
      if (k != c) columns.col(k) -= columns(pivot, k) * columns.col(c);
  }
}

std::string words_of(const std::vector<Parameter>& parameters, const VectorX& values,
                     const UntoldDirection& direction) {
  std::vector<std::string> names;
  for (const auto& [i, change] : direction.parts)
    names.push_back(parameters[static_cast<std::size_t>(i)].name);
  if (names.size() == 1) return fmt::format("{}: the recordings hardly depend on it", names[0]);
  if (names.size() == 2) {
    const auto& [a, by_a] = direction.parts[0];
    const auto& [b, by_b] = direction.parts[1];
    const double share = -by_a / by_b;
    const Parameter& first = parameters[static_cast<std::size_t>(a)];
    const bool plain = std::abs(std::abs(share) - 1.0) < 5e-3;
    return fmt::format("{} and {}: only {} {} {}{} is told: {:.4g} {}", names[0], names[1],
                       names[0], share < 0.0 ? '-' : '+',
                       plain ? "" : fmt::format("{:.3g} ", std::abs(share)), names[1],
                       values[a] + share * values[b], first.unit);
  }
  const std::size_t more = names.size() > kNamedParts ? names.size() - kNamedParts : 0;
  names.resize(names.size() - more);
  return fmt::format("{}{}: they trade against each other", fmt::join(names, ", "),
                     more > 0 ? fmt::format(" and {} more", more) : "");
}

}  // namespace

Identifiability identifiability(const std::vector<Parameter>& parameters, const VectorX& values,
                                const MatrixX& information, const MatrixX& by_recording) {
  const VectorX ranges = ranges_of(parameters);
  const MatrixX scaled = ranges.asDiagonal() * information * ranges.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixX> eigen(0.5 * (scaled + scaled.transpose()));
  Identifiability out;
  const Eigen::Index n = scaled.rows();
  out.spectrum = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().reverse();
  Eigen::Index untold = 0;  // eigenvalues ascend
  while (untold < n && !(eigen.eigenvalues()[untold] * kTold * kTold > 1.0)) ++untold;
  MatrixX columns = eigen.eigenvectors().leftCols(untold);
  make_sparse(columns);
  for (Eigen::Index c = 0; c < untold; ++c) {
    UntoldDirection& direction = out.untold.emplace_back();
    const VectorX column = columns.col(c) / columns.col(c).cwiseAbs().maxCoeff();
    direction.deviation = 1.0 / std::sqrt(std::max(column.dot(scaled * column), 1e-30));
    std::vector<Eigen::Index> order;
    for (Eigen::Index i = 0; i < n; ++i)
      if (std::abs(column[i]) >= kVisible) order.push_back(i);
    std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
      return std::abs(column[a]) > std::abs(column[b]);
    });
    for (const Eigen::Index i : order) {
      const bool logarithmic = parameters[static_cast<std::size_t>(i)].logarithmic;
      direction.parts.emplace_back(static_cast<int>(i),
                                   column[i] * ranges[i] * (logarithmic ? values[i] : 1.0));
    }
    direction.words = words_of(parameters, values, direction);
  }
  out.shares = by_recording;
  for (Eigen::Index i = 0; i < n; ++i)
    if (const double sum = by_recording.row(i).sum(); sum > 0.0) out.shares.row(i) /= sum;
  return out;
}

Identifiability identifiability(const std::vector<Parameter>& parameters, const Fit& fit) {
  return identifiability(parameters, fit.values(), fit.information, fit.information_by_recording);
}

}  // namespace counterpoint::estimation
