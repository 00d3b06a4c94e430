// Reference solution of the pieces, with its own error.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "adapters/engine_adapter.h"
#include "pieces.h"

namespace counterpoint::apps::accuracy {

/// A piece of the reference: start state, and end state to be reached.
struct Piece {
  State start, end;
};

struct Reference {
  std::string kind;         ///< "analytic" or "fine"
  std::string description;  ///< text about the reference
  double time_step = 0.0;   ///< step of the fine run [s], which is the reference or its check
  Integrator integrator = Integrator::kSemiImplicitEuler;
  std::vector<Piece> pieces;
  /// Mean over the pieces of the reference's possible deviation (pieces.h). Fine: difference to the
  /// run at twice its step. Analytic: round-off.
  double error = 0.0;
  std::vector<double> piece_errors;  ///< the same for each piece
  /// Analytic only: deviation of the engine's fine run from the reference, and from its run at
  /// twice the step.
  double fine_deviation = 0.0, fine_error = 0.0;
  std::string warning;  ///< why it must not be trusted; empty: no objection
};

enum class ReferenceKind { kAutomatic, kAnalytic, kFine };

/// State at a time [s] of a scene whose motion has a closed form (closed_forms.h).
using ClosedForm = std::function<State(double time)>;

/// Computes the reference. The fine run's step is the scene's divided by `finer` (2 or more).
/// Without constraints its integrator is runge_kutta_4; else whichever of the other two integrators
/// changes less when its step is doubled. @throws InputError if an analytic reference is requested
/// and none exists, or if the fine run fails.
Reference make_reference(const Scene& scene, const Plan& plan, ReferenceKind kind, int finer);

/// Builds the reference from a closed form and checks it with a fine run: if they differ by more
/// than the error of the fine run, there is a warning.
Reference analytic_reference(const Scene& scene, const Plan& plan, const ClosedForm& motion,
                             const std::string& description, int finer);

/// Reason why this integrator refuses a step of the scene; empty: it does not.
std::string refusal(const Scene& scene, Integrator integrator);

}  // namespace counterpoint::apps::accuracy
