#include "identify/search.h"

#include <fmt/format.h>

#include <set>

#include "command_line/interrupt.h"
#include "recordings/page.h"
#include "tasks/fingerprint.h"

namespace counterpoint::apps {
namespace {

std::uint64_t fingerprint(const IdentifyArguments& a, const Experiment& e) {
  tasks::Fingerprint hash;
  hash.add_scene(e.scene);
  hash.add_file(a.map);
  for (const auto* files : {&a.recordings, &a.test}) {
    hash.add(static_cast<std::uint64_t>(files->size()));
    for (const std::string& file : *files) hash.add_file(file);
  }
  for (const std::string* text : {&a.parameters, &a.loss, &a.objective, &a.derivatives})
    hash.add(std::string_view(*text));
  if (a.parameters.starts_with('@')) hash.add_file(a.parameters.substr(1));
  for (const int number : {a.substeps.value_or(0), a.horizon, a.swap ? 1 : 0, a.fit.samples,
                           a.fit.refined, a.fit.bootstrap})
    hash.add(number);
  hash.add(a.train.value_or(-1.0));
  hash.add(a.folds.value_or(0));
  hash.add(a.fit.difference);
  return hash.value();
}

}  // namespace

IdentifySearch::IdentifySearch(IdentifyArguments& arguments, const Experiment& e,
                               const std::vector<Parameter>& parameters, tasks::World& world)
    : arguments_(arguments),
      e_(e),
      parameters_(parameters),
      world_(world),
      start_(parameter_values(parameters, e.scene)),
      series_(arguments.tasks, world, Interrupt::wanted, last_fit_list(arguments.fit)) {}

std::vector<const Recording*> IdentifySearch::chosen(const std::vector<int>& which) const {
  std::vector<const Recording*> out;
  for (const int i : which) out.push_back(&e_.recordings[static_cast<std::size_t>(i)]);
  return out;
}

Found IdentifySearch::find(const std::vector<int>& which, const std::string& fold) {
  Report& report = arguments_.report;
  if (arguments_.objective != "torque")
    return {arguments_.objective == "explain" ? by_motions(which) : by_predictions(which, fold),
            {}};
  arguments_.torques.threads = arguments_.tasks.threads(world_);
  arguments_.torques.stop = Interrupt::wanted;
  report["ranks"] = 1;
  report["threads"] = arguments_.torques.threads;
  const TorqueFit found =
      fit_torques(e_.scene, e_.map, chosen(which), parameters_, arguments_.torques);
  return {found.parameters, found};
}

/// Finds the parameters with the best predictions.
Fit IdentifySearch::by_predictions(const std::vector<int>& which, const std::string& fold) {
  const FitProblem problem = fit_problem(e_, parameters_, which, arguments_.objective == "force");
  FitOptions options = arguments_.fit;
  options.robust = arguments_.loss == "cauchy";
  options.stop = Interrupt::wanted;
  options.run = [&](tasks::TaskList list) {
    list.name = fold + list.name;
    return series_.run(list);
  };
  options.fingerprint = fingerprint(arguments_, e_);
  Fit found = fit(problem, options);
  if (fold.empty())
    series_.finish();
  else  // all ranks go on to the next fold, or none
    found.stopped = tasks::broadcast(world_, found.stopped ? "stopped" : "") == "stopped";
  arguments_.report["ranks"] = series_.last().ranks;
  arguments_.report["threads"] = series_.last().threads;
  return found;
}

/// Finds the parameters and motions that explain the recordings, as one problem.
Fit IdentifySearch::by_motions(const std::vector<int>& which) {
  MotionEstimateOptions options;
  options.threads = arguments_.tasks.threads(world_);
  options.stop = Interrupt::wanted;
  const ParameterEstimate found =
      estimate_parameters(e_.scene, e_.map, chosen(which), parameters_, options);
  Report& report = arguments_.report;
  report["ranks"] = 1;
  report["threads"] = options.threads;
  report["smoothing_m"] = found.smoothing;
  report["cost_ratio"] = std::vector<double>(found.cost_ratio.begin(), found.cost_ratio.end());
  report.print("{} motions explained, {} Newton steps\n", which.size(),
               found.parameters.evaluations);
  fill_constants(found.constants, report);
  return found.parameters;
}

bool IdentifySearch::find_folds(const std::vector<Split>& folds) {
  Report& report = arguments_.report;
  report["folds"] = Json::array();
  bool stopped = false;
  for (std::size_t k = 0; k < folds.size() && !stopped; ++k) {
    const Found found = find(folds[k].train, fmt::format("fold_{}_", k + 1));
    stopped = found.fit.stopped;
    if (stopped || !world_.is_root()) continue;
    std::set<std::string> files;  // a file may hold several recordings
    for (const Recording* one : chosen(folds[k].test)) files.insert(one->file);
    held_.resize(0);
    Json& fold = add_fold(parameters_, {files.begin(), files.end()}, found.fit, report);
    // The next fit, on all ranks, finds that it is to stop, too.
    if (!score(found, folds[k], false, fold)) report["folds"].erase(report["folds"].size() - 1);
  }
  held_.resize(0);
  if (world_.is_root()) fill_fold_parameters(parameters_, report);
  return !stopped;
}

bool IdentifySearch::score(const Found& found, const Split& parts, bool all, Json& out) {
  Report& report = arguments_.report;
  for (const auto& [name, which] :
       {std::pair{"train", &parts.train}, std::pair{"test", &parts.test}}) {
    if (which->empty()) continue;
    Json& part = out[name];
    if (arguments_.objective == "torque")
      score_torques_of(found, *which, part);
    else if (!score_predictions(found, *which, part))
      return false;
    if (!all && which == &parts.train) continue;
    if (arguments_.objective == "torque")
      report.print("{}: {} recordings\n", name, which->size());
    else
      print_score(name, part, report);
    print_coordinates(part["coordinates"], report);
  }
  return true;
}

bool IdentifySearch::score_predictions(const Found& found, const std::vector<int>& which,
                                       Json& out) {
  const Scene after = with_parameters(e_.scene, parameters_, found.fit.values());
  shown_ = roll_out(e_, after, which);
  if (Interrupt::wanted()) return false;
  out = apps::score(shown_, compared(e_.map));
  const auto add = [&](const char* key, const Scene& scene, const std::vector<Prediction>& set) {
    out["coordinates"][key] =
        coordinate_list(arguments_.objective == "force" ? unexplained_metrics(e_, scene, which)
                                                        : velocity_metrics(e_.map, set));
  };
  add("scene", e_.scene, shown_.before);
  add("found", after, shown_.after);
  return !Interrupt::wanted();
}

void IdentifySearch::score_torques_of(const Found& found, const std::vector<int>& which,
                                      Json& out) {
  const VectorX values = found.fit.values();
  const auto recordings = chosen(which);
  const auto scored = [&](const Scene& scene, const VectorX& at) {
    return score_torques(scene, e_.map, recordings, parameters_, at, arguments_.torques, held_);
  };
  const TorqueScore before = scored(e_.scene, start_);
  const TorqueScore now = scored(with_parameters(e_.scene, parameters_, values), values);
  if (held_.size() == 0) held_ = now.held;
  charts_ = force_charts(before, now);
  out = {{"coordinates",
          {{"scene", coordinate_list(before.coordinates)},
           {"found", coordinate_list(now.coordinates)}}},
         {"recordings", which.size()}};
}

}  // namespace counterpoint::apps
