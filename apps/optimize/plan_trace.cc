#include "optimize/plan_trace.h"

#include <fmt/format.h>

#include <algorithm>

namespace counterpoint::apps {

namespace opt = optimization;

namespace {

const char* unit_of_speed(const Model& model, const std::string& name) {
  const std::size_t dot = name.rfind('.');
  if (name.compare(dot, 2, ".w") == 0) return "rad/s";
  const int joint = name.substr(dot) == ".v" ? model.find_joint(name.substr(0, dot)) : -1;
  const bool turns = joint >= 0 && model.body(joint + 1).joint_type != JointType::kPrismatic;
  return turns ? "rad/s" : "m/s";
}

}  // namespace

void PlanTrace::add(const opt::Planner& planner, const opt::ReplanReport& report, double seconds) {
  const opt::Problem& problem = planner.problem();
  if (plans_.empty()) {
    horizon_ = problem.steps * problem.h();
    for (std::size_t i = 0; i < problem.terms.size(); ++i) {
      const opt::Term& term = problem.terms[i];
      if (term.quantity != opt::Quantity::kVelocity || term.target_at(0).size() == 0) continue;
      for (Eigen::Index v = 0; v < term.target_at(0).size(); ++v)
        if (term.weight[v] > 0.0) speeds_.push_back({i, v});
    }
  }
  std::vector<double> commanded;
  for (const Speed& speed : speeds_)
    commanded.push_back(problem.terms[speed.term].target_at(0)[speed.v]);
  plans_.push_back({planner.time(), report.cost, seconds, commanded});
  for (std::size_t i = 0; i < kShares.size(); ++i) {
    planner.sample(planner.time() + kShares[i] * horizon_, sample_.q, sample_.v, force_);
    ahead_[i].push_back({planner.time(), sample_.q, VectorX()});
  }
}

std::vector<view::Clip> PlanTrace::ghosts() const {
  std::vector<view::Clip> clips(kShares.size());
  for (std::size_t i = 0; i < clips.size(); ++i) {
    clips[i].name = fmt::format("plan, {:.3g} s ahead", kShares[i] * horizon_);
    clips[i].states = ahead_[i];
    clips[i].rows = clips[i].num_frames();
  }
  return clips;
}

template <class Value>
std::vector<double> PlanTrace::over(const view::Clip& clip, Value value) const {
  std::vector<double> out;
  std::size_t plan = 0;
  for (const State& state : clip.states) {
    while (plan + 1 < plans_.size() && plans_[plan + 1].time <= state.time) ++plan;
    out.push_back(value(plans_[plan]));
  }
  return out;
}

std::vector<view::Curve> PlanTrace::curves(const Model& model, const view::Clip& clip) const {
  std::vector<view::Curve> out;
  if (plans_.empty()) return out;
  const std::vector<std::string> names = coordinate_names(model).v;
  for (std::size_t i = 0; i < speeds_.size(); ++i) {
    const auto commanded = [i](const Plan& plan) { return plan.speeds[i]; };
    if (std::none_of(plans_.begin(), plans_.end(), commanded)) continue;  // zero throughout
    const Eigen::Index v = speeds_[i].v;
    const std::string& name = names[static_cast<std::size_t>(v)];
    const std::string group = "commanded speed: " + name;
    const char* unit = unit_of_speed(model, name);
    view::Curve actual{group, "actual", unit, {}};
    for (const State& state : clip.states) actual.values.push_back(state.v[v]);
    out.push_back(actual);
    out.push_back({group, "commanded", unit, over(clip, commanded)});
  }
  out.push_back({"replan time", "replan", "ms",
                 over(clip, [](const Plan& plan) { return 1e3 * plan.seconds; })});
  out.push_back(
      {"replan time", "interval", "ms", std::vector<double>(clip.states.size(), 1e3 * interval_)});
  out.push_back(
      {"cost of the plan", "", "1", over(clip, [](const Plan& plan) { return plan.cost; })});
  return out;
}

}  // namespace counterpoint::apps
