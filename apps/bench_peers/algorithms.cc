// Recursive algorithms compared with Pinocchio's, each from coordinates to result: kinematics and
// other prerequisites are included on both sides.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/engine/dynamics.h"
#include "measure/turns.h"
#include "peer_robot.h"

namespace counterpoint::apps {
namespace {

using peers::PinocchioAlgorithm;
using peers::PinocchioConvention;
using peers::PinocchioRobot;

/// Our side: computes the result of one algorithm from the coordinates.
class OurAlgorithms {
 public:
  explicit OurAlgorithms(const Model& model)
      : dynamics_(model),
        out_(VectorX::Zero(model.nv())),
        zero_(VectorX::Zero(model.nv())),
        M_(model.nv(), model.nv()) {}

  void run(PinocchioAlgorithm algorithm, const States& states, int evaluations) {
    run_in_turn(evaluations, [&](std::size_t i) { evaluate(algorithm, states, i); });
  }

  void evaluate(PinocchioAlgorithm algorithm, const States& states, std::size_t i) {
    dynamics_.set_state(states.q[i], states.v[i]);
    switch (algorithm) {
      case PinocchioAlgorithm::kKinematics:
        return;
      case PinocchioAlgorithm::kRnea:
        return dynamics_.inverse_dynamics(states.x[i], out_);
      case PinocchioAlgorithm::kAba:
        if (!dynamics_.forward_dynamics(states.x[i], zero_, out_))
          throw std::runtime_error("aba: singular");
        return;
      case PinocchioAlgorithm::kCrba:
        return dynamics_.mass_matrix(M_);
      case PinocchioAlgorithm::kRneaDerivatives:
      case PinocchioAlgorithm::kAbaDerivatives:
        throw std::logic_error("derivatives have a table of their own");
    }
  }

  Vector3 position(int frame) const { return dynamics_.frame_pose(frame).translation; }
  const VectorX& out() const { return out_; }
  const MatrixX& M() const { return M_; }

 private:
  Dynamics dynamics_;
  VectorX out_, zero_;
  MatrixX M_;
};

/// Largest difference of the two results over all states, relative to the largest entry.
double difference(const Model& model, PinocchioAlgorithm algorithm, const States& states,
                  const Pair& pair, OurAlgorithms& ours, PinocchioRobot& peer) {
  const int nv = model.nv();
  double worst = 0.0, scale = 0.0;
  VectorX theirs(std::max(nv * nv, 3 * model.num_bodies()));
  for (int k = 0; k < kStates; ++k) {
    const auto i = static_cast<std::size_t>(k);
    ours.evaluate(algorithm, states, i);
    peer.evaluate(algorithm, k, theirs.data());
    const VectorX& q = states.q[i];
    VectorX mine, other;
    if (algorithm == PinocchioAlgorithm::kKinematics) {
      mine.resize(3 * model.num_joints());
      for (std::size_t f = 0; f < model.frames().size(); ++f) {
        const Frame& frame = model.frames()[f];
        // Compare the frame of the link that a joint moves, whose origin is the joint's, and no
        // frame fixed to it.
        if (frame.body == 0 || !frame.X_BF.translation.isZero()) continue;
        mine.segment<3>(3 * pair.joint(frame.body).index) = ours.position(static_cast<int>(f));
      }
      other = theirs.head(mine.size());
    } else if (algorithm == PinocchioAlgorithm::kCrba) {
      // T' M_theirs T = M_ours, column by column of T.
      MatrixX T(nv, nv);
      for (int j = 0; j < nv; ++j) T.col(j) = pair.mapped(q, VectorX::Unit(nv, j));
      const MatrixX M = T.transpose() * Eigen::Map<MatrixX>(theirs.data(), nv, nv) * T;
      mine = ours.M().reshaped();
      other = M.reshaped();
    } else {
      mine = algorithm == PinocchioAlgorithm::kAba
                 ? pair.mapped_acceleration(q, states.v[i], ours.out())
                 : pair.mapped(q, ours.out());
      other = theirs.head(nv);
    }
    worst = std::max(worst, (mine - other).lpNorm<Eigen::Infinity>());
    scale = std::max(scale, mine.lpNorm<Eigen::Infinity>());
  }
  return worst / scale;
}

void compare_algorithms(const Model& model, const LoadPinocchio& load, const std::string& label,
                        const PeerOptions& options, PeerTable& table) {
  const States states = random_states(model);
  OurAlgorithms ours(model);
  const auto world = load(PinocchioConvention::kWorld), local = load(PinocchioConvention::kLocal);
  Pair pair(model, *world), local_pair(model, *local);
  constexpr std::pair<PinocchioAlgorithm, const char*> kAlgorithms[] = {
      {PinocchioAlgorithm::kKinematics, "kinematics"},
      {PinocchioAlgorithm::kRnea, "rnea"},
      {PinocchioAlgorithm::kAba, "aba"},
      {PinocchioAlgorithm::kCrba, "crba"}};
  for (const auto& [algorithm, name] : kAlgorithms) {
    pair.set_states(states, algorithm == PinocchioAlgorithm::kRnea);
    local_pair.set_states(states, algorithm == PinocchioAlgorithm::kRnea);
    const auto what = algorithm;
    std::vector<Contender> contenders{
        {"counterpoint", [&](int count) { ours.run(what, states, count); }},
        {"pinocchio", [&](int count) { world->run(what, count); }}};
    const bool two_ways =
        algorithm == PinocchioAlgorithm::kAba || algorithm == PinocchioAlgorithm::kCrba;
    if (two_ways) contenders.push_back({"pinocchio", [&](int count) { local->run(what, count); }});
    const Timing timing = take_turns(contenders, options.rounds, options.slice);
    const std::size_t best = two_ways && timing.seconds[2] < timing.seconds[1] ? 2 : 1;
    const double error = difference(model, algorithm, states, best == 2 ? local_pair : pair, ours,
                                    best == 2 ? *local : *world);
    table.add({"algorithms", label, name, "counterpoint", timing.seconds[0], 1.0, "difference",
               error, model.nv(), ""});
    table.add({"algorithms", label, name, "pinocchio", timing.seconds[best],
               1.0 / timing.ratio[best], "difference", error, model.nv(),
               two_ways ? (best == 2 ? "local" : "world") : ""});
  }
}

}  // namespace

void compare_algorithms(const PeerOptions& options, PeerTable& table) {
  for_each_robot("algorithms", options,
                 [&](const Model& model, const LoadPinocchio& load, const std::string& label) {
                   compare_algorithms(model, load, label, options, table);
                 });
}

}  // namespace counterpoint::apps
