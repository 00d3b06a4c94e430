// Derivatives of steps, inverse and forward: closed forms, central differences of our inverse, and
// MuJoCo's mjd_inverseFD and mjd_transitionFD, each engine along its own trajectory.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/simulator.h"
#include "measure/median.h"
#include "measure/turns.h"
#include "peers/mujoco_derivatives.h"
#include "runners.h"

namespace counterpoint::apps {
namespace {

using peers::MujocoMoment;

constexpr int kMoments = 32;  ///< states from the second half of a trajectory, used in turn

/// True for kMoments evenly spaced steps of the second half.
bool is_moment(int step, int steps) {
  const int first = steps / 2, every = std::max(1, (steps - first) / kMoments);
  return step >= first && (step - first) % every == 0;
}

struct OurMoment {
  State start, end;
};

struct Errors {
  std::vector<double> all;
  double worst() const {
    return all.empty() ? std::numeric_limits<double>::quiet_NaN()
                       : *std::max_element(all.begin(), all.end());
  }
  std::string remark() const {
    return all.empty() ? "" : fmt::format("median {:.2g}", median(all));
  }
};

class OurStepDerivatives {
 public:
  OurStepDerivatives(const Scene& scene, int steps) : scene_(scene), workspace_(scene_.model) {
    scene_.options.effects.set(Effect::kSleeping, false);
    Simulator simulator(scene_);
    for (int i = 0; i < steps; ++i) {
      const State start = simulator.state();
      const StepReport report = simulator.step();
      if (!report.succeeded())
        throw std::runtime_error(fmt::format("the step at {:g} s failed", start.time));
      if (!is_moment(i, steps)) continue;
      moments_.push_back({start, simulator.state()});
      contacts_ += report.contacts;
    }
  }

  void inverse(int count) {
    each(count, [&](const OurMoment& m) {
      step_inverse(scene_.model, scene_.options, m.start.q, m.start.v, m.end.v, workspace_, out_);
    });
  }
  void inverse_derivatives(int count, DerivativeMethod method) {
    each(count, [&](const OurMoment& m) { derive(m, method, exact_); });
  }
  void forward_derivatives(int count) {
    each(count, [&](const OurMoment& m) {
      if (!step_forward_derivatives(scene_.model, scene_.options, m.start.q, m.start.v, m.end.v,
                                    Input(), workspace_, out_, exact_, forward_))
        throw std::runtime_error("du/dv+ is singular");
    });
  }

  /// Error of `method` against `reference`, relative to the largest entry of each matrix.
  Errors errors(DerivativeMethod method, DerivativeMethod reference) {
    Errors out;
    for (const OurMoment& m : moments_) {
      derive(m, method, exact_);
      derive(m, reference, reference_);
      double worst = 0.0;
      for (MatrixX InverseDerivatives::*block :
           {&InverseDerivatives::dq, &InverseDerivatives::dv, &InverseDerivatives::dv_next})
        worst = std::max(worst, (exact_.*block - reference_.*block).lpNorm<Eigen::Infinity>() /
                                    (reference_.*block).lpNorm<Eigen::Infinity>());
      out.all.push_back(worst);
    }
    return out;
  }
  std::size_t moments() const { return moments_.size(); }
  double mean_contacts() const { return static_cast<double>(contacts_) / double(moments_.size()); }

 private:
  void derive(const OurMoment& m, DerivativeMethod method, InverseDerivatives& d) {
    step_inverse_derivatives(scene_.model, scene_.options, m.start.q, m.start.v, m.end.v, Input(),
                             workspace_, out_, d, method);
  }
  template <class Do>
  void each(int count, Do&& act) {
    for (int k = 0; k < count; ++k)
      for (const OurMoment& m : moments_) act(m);
  }

  Scene scene_;
  Workspace workspace_;
  std::vector<OurMoment> moments_;
  long contacts_ = 0;
  Inverse out_;
  InverseDerivatives exact_, reference_;
  ForwardDerivatives forward_;
};

class Theirs {
 public:
  Theirs(const Scene& scene, int steps) : mujoco_(scene, peers::MujocoSettings::kDefault) {
    mujoco_.set_state({0.0, scene.q, scene.v});
    for (int i = 0; i < steps; ++i) {
      MujocoMoment moment;
      const std::string failure = mujoco_.step_from(moment);
      if (!failure.empty()) throw std::runtime_error(failure);
      if (is_moment(i, steps)) moments_.push_back(moment);
    }
    derivatives_ = std::make_unique<peers::MujocoDerivatives>(mujoco_);
  }
  template <class Do>
  void each(int count, Do&& act) {
    for (int k = 0; k < count; ++k)
      for (const MujocoMoment& m : moments_) act(*derivatives_, m);
  }
  template <class Error>
  Errors errors(Error&& error) {
    Errors out;
    for (const MujocoMoment& m : moments_) out.all.push_back(error(*derivatives_, m));
    return out;
  }

 private:
  peers::Mujoco mujoco_;
  std::vector<MujocoMoment> moments_;
  std::unique_ptr<peers::MujocoDerivatives> derivatives_;
};

std::unique_ptr<Theirs> try_mujoco(const Scene& scene, int steps) {
  try {
    return std::make_unique<Theirs>(scene, steps);
  } catch (const std::exception& error) {
    fmt::print("Skipped: MuJoCo: {}\n", error.what());
    return nullptr;
  }
}

struct Row {
  const char* quantity;
  const char* engine;
  Errors errors;
  std::function<void(int)> run;
};

void add_mujoco(Theirs& peer, std::vector<Row>& rows) {
  using peers::MujocoDerivatives;
  const auto transition = [&](bool centered) {
    return Row{"forward derivatives", centered ? "mujoco centered" : "mujoco one-sided",
               peer.errors([=](MujocoDerivatives& d, const MujocoMoment& m) {
                 return d.transition_error(m, centered);
               }),
               [&peer, centered](int count) {
                 peer.each(count, [=](MujocoDerivatives& d, const MujocoMoment& m) {
                   d.transition(m, centered);
                 });
               }};
  };
  rows.push_back(
      {"inverse derivatives", "mujoco one-sided",
       peer.errors([](MujocoDerivatives& d, const MujocoMoment& m) { return d.inverse_error(m); }),
       [&peer](int count) {
         peer.each(count, [](MujocoDerivatives& d, const MujocoMoment& m) { d.inverse(m); });
       }});
  rows.push_back(transition(false));
  rows.push_back(transition(true));
}

/// Compares one scene. `label` names the scene and its softness. Differences of our inverse serve
/// as a reference only if the contacts are soft: with hard ones the forces bend within less than a
/// difference can resolve.
void compare_scene(const Scene& scene, const std::string& label, bool soft,
                   const PeerOptions& options, PeerTable& table) {
  const int steps = steps_of(scene, options), nv = scene.model.nv();
  OurStepDerivatives ours(scene, steps);
  const auto theirs = try_mujoco(scene, steps);
  fmt::print("{}: {:.1f} contacts, mean of {} steps of the second half\n", label,
             ours.mean_contacts(), kMoments);
  constexpr DerivativeMethod kExact = DerivativeMethod::kAnalytic;
  constexpr DerivativeMethod kCentral = DerivativeMethod::kCentralDifferences;
  constexpr DerivativeMethod kReference = DerivativeMethod::kExtrapolated;
  std::vector<Row> rows{
      {"inverse derivatives", "counterpoint", soft ? ours.errors(kExact, kReference) : Errors(),
       [&](int count) { ours.inverse_derivatives(count, kExact); }},
      {"inverse derivatives", "counterpoint central",
       soft ? ours.errors(kCentral, kReference) : Errors(),
       [&](int count) { ours.inverse_derivatives(count, kCentral); }},
      {"forward derivatives",
       "counterpoint",
       {},
       [&](int count) { ours.forward_derivatives(count); }},
      {"inverse", "counterpoint", {}, [&](int count) { ours.inverse(count); }}};
  if (theirs) add_mujoco(*theirs, rows);
  std::vector<Contender> contenders;
  for (const Row& row : rows) contenders.push_back({row.engine, row.run});
  constexpr std::size_t kForward = 2;  // row of our engine that the forward rows are compared with
  const Timing timing = take_turns(contenders, options.step_rounds, options.slice);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool forward = rows[i].quantity == std::string("forward derivatives");
    table.add({"derivatives", label, rows[i].quantity, rows[i].engine,
               timing.seconds[i] / static_cast<double>(ours.moments()),
               (forward ? timing.ratio[kForward] : 1.0) / timing.ratio[i], "error",
               rows[i].errors.worst(), nv, rows[i].errors.remark()});
  }
}

/// Compares the scene as it is, and softened as at the start of an optimization.
void compare_both(const Scene& scene, const std::string& label, const PeerOptions& options,
                  PeerTable& table) {
  Scene soft = scene;
  soft.options.contact.smoothing = 1e-3;
  soft.options.contact.compliance = 1e-2;
  compare_scene(scene, label, false, options, table);
  compare_scene(soft, label + " soft", true, options, table);
}

}  // namespace

void compare_step_derivatives(const PeerOptions& options, PeerTable& table) {
  compare_both(load_scene(options.scenes / "humanoid_drop.yaml"), "humanoid_drop", options, table);
  const std::filesystem::path urdf = find_robot(options, "solo12.urdf");
  if (!urdf.empty()) compare_both(dropped(urdf), urdf.stem().string(), options, table);
}

}  // namespace counterpoint::apps
