// The reference of the pieces, and its own error.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "adapters/engine_adapter.h"
#include "pieces.h"

namespace counterpoint::apps::accuracy {

/// A piece of the reference: where it starts, and where it must end.
struct Piece {
  State start, end;
};

struct Reference {
  std::string kind;         ///< "analytic" or "fine"
  std::string description;  ///< what it is, in words
  double time_step = 0.0;   ///< [s] of the fine run: the reference itself, or what checks it
  Integrator integrator = Integrator::kSemiImplicitEuler;
  std::vector<Piece> pieces;
  /// Mean over the pieces of the deviation (pieces.h) by which it may be off. Fine: between it and
  /// the run at twice its step. Analytic: rounding.
  double error = 0.0;
  std::vector<double> piece_errors;  ///< the same of each piece
  /// Analytic only: deviation of the engine's fine run from it, and of that run from the one at
  /// twice its step.
  double fine_deviation = 0.0, fine_error = 0.0;
  std::string warning;  ///< why it must not be trusted; empty: nothing speaks against it
};

enum class ReferenceKind { kAutomatic, kAnalytic, kFine };

/// State at a time [s], of a scene whose motion is known in closed form (closed_forms.h).
using ClosedForm = std::function<State(double time)>;

/// `finer`: the fine run's step is the scene's over this, 2 or more. Without constraints it is by
/// runge_kutta_4; else by whichever of the other two integrators changes less when its step is
/// doubled.
/// @throws InputError where an analytic one is asked for and there is none, and where the fine run
/// fails.
Reference make_reference(const Scene& scene, const Plan& plan, ReferenceKind kind, int finer);

/// The same from a closed form. The fine run judges it: where they differ by more than the fine run
/// may be off, there is a warning.
Reference analytic_reference(const Scene& scene, const Plan& plan, const ClosedForm& motion,
                             const std::string& description, int finer);

/// Whether a step of the scene by this integrator is refused; why, or empty.
std::string refusal(const Scene& scene, Integrator integrator);

}  // namespace counterpoint::apps::accuracy
