#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/simulator.h"

namespace counterpoint {
namespace {

/// Number of checks within closing_time.
constexpr double kLooks = 20.0;
/// Fraction of the recovery speed at which a constraint counts as closing.
constexpr double kProgress = 0.1;

}  // namespace

StalledClosureDetector::StalledClosureDetector(const Model& model)
    : closures_(model.closures().size()),
      mimics_(model.mimics().size()),
      data_(closures_.empty() ? nullptr : std::make_unique<Data>(model)) {}

StalledClosureDetector::~StalledClosureDetector() = default;
StalledClosureDetector::StalledClosureDetector(StalledClosureDetector&&) noexcept = default;
StalledClosureDetector& StalledClosureDetector::operator=(StalledClosureDetector&&) noexcept =
    default;

void StalledClosureDetector::restart() {
  next_look_ = std::numeric_limits<double>::quiet_NaN();
  std::fill(closures_.begin(), closures_.end(), Stall());
  std::fill(mimics_.begin(), mimics_.end(), Stall());
}

bool StalledClosureDetector::stalls(const SimulationOptions& options, double time, double error,
                                    Stall& stall) {
  const double speed = options.contact.max_recovery_speed;
  if (options.contact.stabilization * error < options.time_step * speed) {
    stall = Stall();
    return false;
  }
  if (!(error > stall.error - kProgress * speed * (time - stall.since))) stall = {time, error};
  return time - stall.since >= options.closing_time;
}

Fault StalledClosureDetector::look(const Model& model, const SimulationOptions& options,
                                   const State& state) {
  Fault fault;
  const ContactOptions& contact = options.contact;
  if (state.time < next_look_ || (closures_.empty() && mimics_.empty())) return fault;
  const double interval = options.closing_time / kLooks;
  if (std::isnan(next_look_)) {
    // Callers that set a state before every step do not pay for the checks.
    next_look_ = state.time + interval;
    return fault;
  }
  if (!(contact.stabilization > 0.0 && contact.max_recovery_speed > 0.0)) return fault;
  // Keeps the one that is open farthest.
  const auto judge = [&](ConstraintKind kind, int index, int body, int other_body, double error,
                         Stall& stall) {
    if (!stalls(options, state.time, error, stall) || error < fault.value) return;
    fault.kind = FaultKind::kStaysOpen;
    fault.constraint = kind;
    fault.body = body;
    fault.other_body = other_body;
    fault.index = index;
    fault.value = error;
    fault.bound = options.closing_time;
  };
  if (options.effects.has(Effect::kClosures) && !closures_.empty()) {
    compute_poses(model, state.q, *data_);
    const VectorX& z = given_z(model, state.z);
    for (size_t i = 0; i < closures_.size(); ++i) {
      const Closure& closure = model.closures()[i];
      const double error = closure_gap(closure, data_->X_WB, z).largest();
      judge(ConstraintKind::kClosure, static_cast<int>(i), closure.body_b, closure.body_a, error,
            closures_[i]);
    }
  }
  if (options.effects.has(Effect::kMimics)) {
    for (size_t i = 0; i < mimics_.size(); ++i) {
      const Mimic& mimic = model.mimics()[i];
      const double error = std::abs(mimic_error(model, mimic, state.q));
      judge(ConstraintKind::kMimic, -1, mimic.joint + 1, mimic.master + 1, error, mimics_[i]);
    }
  }
  // After a fault the next step is checked too: it may be a retry of a failed step.
  if (!fault.any()) next_look_ = state.time + interval;
  return fault;
}

}  // namespace counterpoint
