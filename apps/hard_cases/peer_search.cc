#include "peer_search.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace counterpoint::apps {
namespace {

using peers::MujocoSettings;
using Integrator = MujocoSettings::Integrator;

/// Error of a check over the error that its bounds allow; at most 1 if it passes.
double relative_error(const Check& check) {
  if (check.passed()) return 1.0;
  constexpr double kWorst = 1e12, kLeast = 1e-12;
  double error = kWorst;
  if (std::isfinite(check.lower) && std::isfinite(check.upper)) {
    const double middle = 0.5 * (check.lower + check.upper);
    error = std::abs(check.measured - middle) / std::max(check.upper - middle, kLeast);
  } else {
    const double bound = std::isfinite(check.upper) ? check.upper : check.lower;
    error = 1.0 + std::abs(check.measured - bound) / std::max(std::abs(bound), kLeast);
  }
  return std::isfinite(error) ? std::clamp(error, 1.0, kWorst) : kWorst;
}

long passes(const Run& run) {
  const std::vector<Check>& checks = run.figures.checks;
  return std::count_if(checks.begin(), checks.end(), [](const Check& c) { return c.passed(); });
}

double orders_missed(const Run& run) {
  double orders = 0.0;
  for (const Check& check : run.figures.checks) orders += std::log10(relative_error(check));
  return orders;
}

template <typename Change>
MujocoSettings with(MujocoSettings settings, Change change) {
  change(settings);
  return settings;
}

}  // namespace

std::string words(const MujocoSettings& s) {
  std::vector<std::string> said;
  if (s.integrator == Integrator::kRungeKutta4) said.emplace_back("RK4");
  if (s.integrator == Integrator::kImplicit) said.emplace_back("implicit");
  if (s.elliptic) said.emplace_back("elliptic");
  if (s.impratio != 1.0) said.push_back(fmt::format("impratio {:g}", s.impratio));
  if (s.solref_steps > 0.0) said.push_back(fmt::format("solref {:g} h", s.solref_steps));
  if (s.impedance > 0.0) said.push_back(fmt::format("solimp {:g}", s.impedance));
  if (s.noslip_iterations > 0) said.push_back(fmt::format("noslip {}", s.noslip_iterations));
  if (s.tight) said.emplace_back("tolerance 1e-12");
  if (s.several_points) said.emplace_back("multiccd");
  if (s.exact_diagonal) said.emplace_back("diagexact");
  if (s.substeps > 1) said.push_back(fmt::format("{} substeps", s.substeps));
  return said.empty() ? "defaults" : fmt::format("{}", fmt::join(said, ", "));
}

std::vector<MujocoSettings> coarse_settings() {
  const MujocoSettings& best = MujocoSettings::kBest;
  return {MujocoSettings::kDefault,
          MujocoSettings::kElliptic,
          MujocoSettings::kRungeKutta4,
          with(MujocoSettings::kElliptic, [](auto& s) { s.noslip_iterations = 20; }),
          with(best, [](auto& s) { s.integrator = Integrator::kEuler; }),
          best,
          with(best, [](auto& s) { s.elliptic = false, s.impratio = 1.0; }),
          with(best, [](auto& s) { s.solref_steps = s.impedance = 0.0; }),
          with(best, [](auto& s) { s.impratio = 1.0; }),
          with(best, [](auto& s) { s.exact_diagonal = true; }),
          with(best, [](auto& s) { s.noslip_iterations = 100; }),
          with(best, [](auto& s) { s.integrator = Integrator::kRungeKutta4; })};
}

std::vector<SettingChange> finer_changes() {
  return {[](auto& s) { s.integrator = Integrator::kEuler; },
          [](auto& s) { s.integrator = Integrator::kImplicit; },
          [](auto& s) { s.integrator = Integrator::kRungeKutta4; },
          [](auto& s) { s.solref_steps = 0.0; },
          [](auto& s) { s.solref_steps = 1.0; },
          [](auto& s) { s.solref_steps = 5.0; },
          [](auto& s) { s.impedance = 0.99; },
          [](auto& s) { s.impedance = 0.999999; },
          [](auto& s) { s.impratio = s.elliptic ? 10.0 : s.impratio; },
          [](auto& s) { s.impratio = s.elliptic ? 1e4 : s.impratio; },
          [](auto& s) { s.noslip_iterations = 0; },
          [](auto& s) { s.noslip_iterations = 200; },
          [](auto& s) { s.tight = !s.tight; },
          [](auto& s) { s.exact_diagonal = !s.exact_diagonal; },
          [](auto& s) { s.substeps = 4; },
          [](auto& s) { s.substeps = 16; }};
}

bool better(const Run& a, const Run& b) {
  constexpr double kNoDifference = 1e-6;  // orders of magnitude
  const auto rank = [](const Run& run) { return std::pair(run.reached_end(), passes(run)); };
  if (rank(a) != rank(b)) return rank(a) > rank(b);
  return orders_missed(a) < orders_missed(b) - kNoDifference;
}

Run search_settings(const std::function<Run(const MujocoSettings&)>& run, double seconds) {
  const double start = wall_seconds();
  MujocoSettings chosen;
  Run best = run(chosen);
  int tried = 1;
  const auto consider = [&](const MujocoSettings& settings) {
    if (best.passed() || !best.lacking.empty() || wall_seconds() - start > seconds) return;
    Run next = run(settings);
    ++tried;
    if (!better(next, best)) return;
    best = std::move(next);
    chosen = settings;
  };
  for (const MujocoSettings& settings : coarse_settings())
    if (settings != MujocoSettings::kDefault) consider(settings);
  for (const SettingChange change : finer_changes()) {
    const MujocoSettings next = with(chosen, change);
    if (next != chosen) consider(next);
  }
  best.tried = tried;
  return best;
}

}  // namespace counterpoint::apps
