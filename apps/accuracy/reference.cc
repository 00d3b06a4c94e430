#include "reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "closed_forms.h"
#include "report/progress.h"

namespace counterpoint::apps::accuracy {
namespace {

/// A closed form and a run agree if they differ by at most this multiple of the run's own error (1
/// for a first-order method) plus the round-off bound kRounding.
constexpr double kDoubt = 5.0;
constexpr double kRounding = 1e-10;

/// Round-off of a closed form evaluated in double precision.
constexpr double kClosedFormError = 1e-14;

EngineSetting fine_setting(const Scene& scene, Integrator integrator, double h) {
  EngineSetting setting{scene.options, {}};
  setting.options.time_step = h;
  setting.options.step_control.reset();
  setting.options.integrator = integrator;
  // All friction models have the same limit; this one is closest to it.
  setting.options.contact.friction_model = FrictionModel::kCoulomb;
  return setting;
}

State advanced(EngineAdapter& adapter, const State& start, double duration) {
  Passage passage = adapter.advance(start, duration);
  if (!passage.failure.empty()) {
    throw InputError(
        fmt::format("the reference could not be computed: {}; a smaller time step (--timestep) or "
                    "a shorter motion (--duration) may do",
                    passage.failure));
  }
  return std::move(passage.end);
}

std::vector<State> ends(const Scene& scene, const Plan& plan, const std::vector<Piece>& pieces,
                        Integrator integrator, double h) {
  const auto adapter = counterpoint_adapter(scene, fine_setting(scene, integrator, h));
  Progress progress("reference", static_cast<int>(pieces.size()));
  std::vector<State> out;
  for (const Piece& piece : pieces) {
    out.push_back(advanced(*adapter, piece.start, plan.length));
    progress.update(static_cast<int>(out.size()));
  }
  return out;
}

/// Computes the whole motion in one run and cuts it into pieces.
std::vector<Piece> trajectory(const Scene& scene, const Plan& plan, Integrator integrator,
                              double h) {
  const auto adapter = counterpoint_adapter(scene, fine_setting(scene, integrator, h));
  Progress progress("reference", static_cast<int>(plan.starts.size()));
  std::vector<Piece> pieces;
  State now{0.0, scene.q, scene.v};
  double time = 0.0;
  for (const double start : plan.starts) {
    if (start > time + 0.5 * h) now = advanced(*adapter, now, start - time);
    pieces.push_back({now, advanced(*adapter, now, plan.length)});
    now = pieces.back().end;
    time = start + plan.length;
    progress.update(static_cast<int>(pieces.size()));
  }
  return pieces;
}

std::vector<double> deviations(const Model& model, const std::vector<State>& a,
                               const std::vector<State>& b) {
  std::vector<double> out;
  for (size_t i = 0; i < a.size(); ++i) out.push_back(deviation(model, a[i].q, b[i].q).all);
  return out;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::vector<State> ends_of(const std::vector<Piece>& pieces) {
  std::vector<State> out;
  for (const Piece& piece : pieces) out.push_back(piece.end);
  return out;
}

/// Ends of given pieces computed by a fine run.
struct FineEnds {
  Integrator integrator = Integrator::kSemiImplicitEuler;
  std::vector<State> ends;
  std::vector<double> piece_errors;  ///< deviation from the ends at twice the step
  double error = 0.0;                ///< mean of piece_errors
};

FineEnds fine_ends(const Scene& scene, const Plan& plan, const std::vector<Piece>& pieces,
                   Integrator integrator, double h, std::optional<std::vector<State>> known = {}) {
  FineEnds out{integrator, known ? *known : ends(scene, plan, pieces, integrator, h), {}, 0.0};
  out.piece_errors =
      deviations(scene.model, out.ends, ends(scene, plan, pieces, integrator, 2.0 * h));
  out.error = mean(out.piece_errors);
  return out;
}

Integrator first_choice(const Scene& scene) {
  return refusal(scene, Integrator::kRungeKutta4).empty() ? Integrator::kRungeKutta4
                                                          : Integrator::kSemiImplicitEuler;
}

/// Chooses the better of two integrators if there are constraints. Sets `warning` where they
/// disagree.
FineEnds best_ends(const Scene& scene, const Plan& plan, const std::vector<Piece>& pieces, double h,
                   std::optional<std::vector<State>> known, std::string& warning) {
  FineEnds first = fine_ends(scene, plan, pieces, first_choice(scene), h, std::move(known));
  if (first.integrator == Integrator::kRungeKutta4 ||
      !refusal(scene, Integrator::kImplicitMidpoint).empty())
    return first;
  FineEnds second = fine_ends(scene, plan, pieces, Integrator::kImplicitMidpoint, h);
  const double apart = mean(deviations(scene.model, first.ends, second.ends));
  if (apart > kDoubt * (first.error + second.error) + kRounding) {
    warning = fmt::format(
        "semi_implicit_euler and implicit_midpoint at {:.4g} s end {:.2g} apart, more than their "
        "own errors, {:.2g} and {:.2g}: one of them has not converged",
        h, apart, first.error, second.error);
  }
  return second.error < first.error ? second : first;
}

std::string description(const FineEnds& fine, double h, int finer) {
  return fmt::format(
      "the engine's own run by {} at {:.6g} s, a step {} times smaller than the "
      "scene's",
      integrator_name(fine.integrator), h, finer);
}

Reference fine_reference(const Scene& scene, const Plan& plan, int finer) {
  const double h = plan.time_step / finer;
  Reference out;
  out.kind = "fine";
  out.time_step = h;
  out.pieces = trajectory(scene, plan, first_choice(scene), h);
  const FineEnds fine = best_ends(scene, plan, out.pieces, h, ends_of(out.pieces), out.warning);
  for (size_t i = 0; i < out.pieces.size(); ++i) out.pieces[i].end = fine.ends[i];
  out.integrator = fine.integrator;
  out.error = fine.error;
  out.piece_errors = fine.piece_errors;
  out.description = description(fine, h, finer);
  return out;
}

}  // namespace

std::string refusal(const Scene& scene, Integrator integrator) {
  EngineSetting setting{scene.options, {}};
  setting.options.integrator = integrator;
  try {
    counterpoint_adapter(scene, setting)
        ->advance({0.0, scene.q, scene.v}, setting.options.time_step);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

Reference analytic_reference(const Scene& scene, const Plan& plan, const ClosedForm& motion,
                             const std::string& what, int finer) {
  Reference out;
  out.kind = "analytic";
  out.time_step = plan.time_step / finer;
  out.error = kClosedFormError;
  for (const double start : plan.starts)
    out.pieces.push_back({motion(start), motion(start + plan.length)});
  out.piece_errors.assign(out.pieces.size(), out.error);
  const FineEnds fine = best_ends(scene, plan, out.pieces, out.time_step, {}, out.warning);
  out.integrator = fine.integrator;
  out.fine_error = fine.error;
  out.fine_deviation = mean(deviations(scene.model, ends_of(out.pieces), fine.ends));
  out.description = what;
  if (out.fine_deviation > kDoubt * out.fine_error + kRounding) {
    out.warning = fmt::format(
        "{} is {:.2g} off it and changes by only {:.2g} when its step is doubled: the closed form "
        "is not what the engine converges to",
        description(fine, out.time_step, finer), out.fine_deviation, out.fine_error);
  }
  return out;
}

Reference make_reference(const Scene& scene, const Plan& plan, ReferenceKind kind, int finer) {
  if (kind != ReferenceKind::kFine) {
    const Recognized known = recognize(scene);
    if (known.motion)
      return analytic_reference(scene, plan, known.motion, known.description, finer);
    if (kind == ReferenceKind::kAnalytic) {
      throw InputError(fmt::format(
          "--reference analytic: no closed form of this motion is known: {}; use --reference fine",
          known.why_not));
    }
  }
  return fine_reference(scene, plan, finer);
}

}  // namespace counterpoint::apps::accuracy
