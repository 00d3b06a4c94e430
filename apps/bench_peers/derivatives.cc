// Derivatives of inverse and forward dynamics compared with Pinocchio's, from coordinates to all
// three matrices; kinematics are included on both sides.
#include <algorithm>
#include <stdexcept>

#include "counterpoint/engine/dynamics.h"
#include "measure/turns.h"
#include "peer_robot.h"

namespace counterpoint::apps {
namespace {

using peers::PinocchioAlgorithm;
using peers::PinocchioConvention;
using peers::PinocchioRobot;

/// Derivatives of the result with respect to q, v and x, nv x nv each.
struct Matrices {
  MatrixX q, v, x;
};

class OurDerivatives {
 public:
  explicit OurDerivatives(const Model& model)
      : dynamics_(model), zero_(VectorX::Zero(model.nv())) {}

  void run(PinocchioAlgorithm algorithm, const States& states, int evaluations) {
    run_in_turn(evaluations, [&](std::size_t i) { evaluate(algorithm, states, i); });
  }

  void evaluate(PinocchioAlgorithm algorithm, const States& states, std::size_t i) {
    dynamics_.set_state(states.q[i], states.v[i]);
    if (algorithm == PinocchioAlgorithm::kRneaDerivatives)
      return dynamics_.inverse_dynamics_derivatives(states.x[i], of_rnea_);
    if (!dynamics_.forward_dynamics_derivatives(states.x[i], zero_, of_aba_))
      throw std::runtime_error("aba: singular");
  }

  /// Result of the last evaluation.
  Matrices result(PinocchioAlgorithm algorithm) const {
    if (algorithm == PinocchioAlgorithm::kRneaDerivatives)
      return {of_rnea_.dq, of_rnea_.dv, of_rnea_.da};
    return {of_aba_.dq, of_aba_.dv, of_aba_.dtau};
  }

 private:
  Dynamics dynamics_;
  RneaDerivatives of_rnea_;
  AbaDerivatives of_aba_;
  VectorX zero_;
};

/// Pinocchio's derivatives at one state in our coordinates: y_p = T(q) y, and accelerations
/// a_p = T a - (omega x v)_p, where T rotates a free base's linear part by R'.
class Translated {
 public:
  Translated(const Model& model, const Pair& pair, PinocchioRobot& peer)
      : model_(model), pair_(pair), peer_(peer) {}

  Matrices operator()(PinocchioAlgorithm algorithm, const States& states, int state) {
    const auto i = static_cast<std::size_t>(state);
    const int nv = model_.nv();
    const VectorX &q = states.q[i], &v = states.v[i], &x = states.x[i];
    const bool inverse = algorithm == PinocchioAlgorithm::kRneaDerivatives;
    VectorX numbers(3 * nv * nv), result(nv);
    peer_.evaluate(algorithm, state, numbers.data());
    peer_.evaluate(inverse ? PinocchioAlgorithm::kRnea : PinocchioAlgorithm::kAba, state,
                   result.data());
    const Eigen::Map<MatrixX> by_q(numbers.data(), nv, nv), by_v(numbers.data() + nv * nv, nv, nv),
        by_x(numbers.data() + 2 * nv * nv, nv, nv);
    const VectorX v_p = pair_.mapped(q, v);
    if (!inverse) result += spin(v_p, v_p);
    Matrices out{MatrixX(nv, nv), MatrixX(nv, nv), MatrixX(nv, nv)};
    for (int k = 0; k < nv; ++k) {
      const VectorX unit = pair_.mapped(q, VectorX::Unit(nv, k));
      out.x.col(k) = pair_.mapped_back(q, by_x * unit);
      VectorX spun = spin(unit, v_p) + spin(v_p, unit);
      out.v.col(k) = pair_.mapped_back(
          q, inverse ? VectorX(by_v * unit - by_x * spun) : VectorX(by_v * unit + spun));
      const VectorX dv = turned(k, v_p), dx = turned(k, pair_.mapped(q, x));
      spun = spin(dv, v_p) + spin(v_p, dv);
      VectorX by_k = by_q * unit + by_v * dv + by_x * dx;
      by_k += inverse ? VectorX(-(by_x * spun)) : spun;
      out.q.col(k) = pair_.mapped_back(q, by_k - turned(k, result));
    }
    return out;
  }

 private:
  /// omega x v in the linear part of every free base.
  VectorX spin(const VectorX& omega, const VectorX& v) const {
    VectorX out = VectorX::Zero(model_.nv());
    for (int i = 1; i < model_.num_bodies(); ++i) {
      const int to = pair_.joint(i).v_index;
      if (pair_.floating(i)) out.segment<3>(to) = omega.segment<3>(to + 3).cross(v.segment<3>(to));
    }
    return out;
  }

  /// (dT / dq_k) x, computed from x_p = T x.
  VectorX turned(int k, const VectorX& x_p) const {
    VectorX out = VectorX::Zero(model_.nv());
    for (int i = 1; i < model_.num_bodies(); ++i) {
      const int axis = k - model_.body(i).v_index - 3, to = pair_.joint(i).v_index;
      if (pair_.floating(i) && axis >= 0 && axis < 3)
        out.segment<3>(to) = x_p.segment<3>(to).cross(Vector3::Unit(axis));
    }
    return out;
  }

  const Model& model_;
  const Pair& pair_;
  PinocchioRobot& peer_;
};

/// Largest difference of any entry over all states, relative to its matrix's largest entry.
double difference(PinocchioAlgorithm algorithm, const States& states, OurDerivatives& ours,
                  Translated& theirs) {
  double worst = 0.0;
  for (int k = 0; k < kStates; ++k) {
    ours.evaluate(algorithm, states, static_cast<std::size_t>(k));
    const Matrices mine = ours.result(algorithm), other = theirs(algorithm, states, k);
    for (MatrixX Matrices::*m : {&Matrices::q, &Matrices::v, &Matrices::x})
      worst = std::max(worst, (mine.*m - other.*m).lpNorm<Eigen::Infinity>() /
                                  (mine.*m).lpNorm<Eigen::Infinity>());
  }
  return worst;
}

void compare_derivatives_of(const Model& model, const LoadPinocchio& load, const std::string& label,
                            const PeerOptions& options, PeerTable& table) {
  const States states = random_states(model);
  OurDerivatives ours(model);
  const auto peer = load(PinocchioConvention::kLocal);
  Pair pair(model, *peer);
  Translated theirs(model, pair, *peer);
  constexpr std::pair<PinocchioAlgorithm, const char*> kAlgorithms[] = {
      {PinocchioAlgorithm::kRneaDerivatives, "rnea"}, {PinocchioAlgorithm::kAbaDerivatives, "aba"}};
  for (const auto& [algorithm, name] : kAlgorithms) {
    const auto what = algorithm;
    pair.set_states(states, what == PinocchioAlgorithm::kRneaDerivatives);
    const Timing timing =
        take_turns({{"counterpoint", [&](int count) { ours.run(what, states, count); }},
                    {"pinocchio", [&](int count) { peer->run(what, count); }}},
                   options.rounds, options.slice);
    const double error = difference(what, states, ours, theirs);
    table.add({"derivatives", label, name, "counterpoint", timing.seconds[0], 1.0, "difference",
               error, model.nv(), ""});
    table.add({"derivatives", label, name, "pinocchio", timing.seconds[1], 1.0 / timing.ratio[1],
               "difference", error, model.nv(), ""});
  }
}

}  // namespace

void compare_derivatives(const PeerOptions& options, PeerTable& table) {
  for_each_robot("derivatives of algorithms", options,
                 [&](const Model& model, const LoadPinocchio& load, const std::string& label) {
                   compare_derivatives_of(model, load, label, options, table);
                 });
  compare_step_derivatives(options, table);
}

}  // namespace counterpoint::apps
