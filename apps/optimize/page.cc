#include "optimize/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "recordings/page.h"
#include "report/html_page.h"

namespace counterpoint::apps {

namespace opt = optimization;

MotionMetrics motion_metrics(const opt::ProblemFile& problem, const opt::Result& result) {
  const Model& model = *problem.problem.model;
  const double h = result.options.time_step;
  Workspace workspace(model);
  Inverse inverse;
  MotionMetrics metrics;
  std::map<int, std::vector<double>> by_body;
  const std::size_t steps = result.applied_force.size();
  for (std::size_t t = 0; t < steps; ++t) {
    step_inverse(model, result.options, result.q[t], result.v[t], result.v[t + 1], workspace,
                 inverse);
    metrics.time.push_back(static_cast<double>(t) * h);
    for (const ContactForce& c : inverse.contacts) {
      for (const int geometry : {c.contact.geometry_a, c.contact.geometry_b}) {
        const int body = model.geometries()[static_cast<std::size_t>(geometry)].body;
        if (body == 0) continue;
        auto& forces = by_body[body];
        forces.resize(steps, 0.0);
        forces[t] += c.force.dot(c.contact.normal);
      }
    }
    double effort = 0.0;
    for (int i = 1; i < model.num_bodies(); ++i) {
      const double limit = model.joint(i - 1).effort_limit;
      if (!std::isfinite(limit) || !(limit > 0.0)) continue;
      const Body& body = model.body(i);
      effort =
          std::max(effort, inverse.applied_force.segment(body.v_index, joint_nv(body.joint_type))
                                   .cwiseAbs()
                                   .maxCoeff() /
                               limit);
    }
    metrics.effort.push_back(effort);
  }
  const double least = 1e-3 * opt::scene_weight(model);
  for (auto& [body, forces] : by_body) {
    if (*std::max_element(forces.begin(), forces.end()) < least) continue;
    metrics.links.push_back(model.joint(body - 1).link);
    metrics.force.push_back(std::move(forces));
  }
  return metrics;
}

namespace {

std::vector<Chart> course_charts(const opt::Result& result) {
  const auto chart = [](const char* title, const char* label) {
    Chart out;
    out.title = title;
    out.x_label = "iteration";
    out.y_label = label;
    out.log_y = true;
    return out;
  };
  Chart cost = chart("Cost, conditions included", "cost");
  Chart forces = chart("Force where no motor is", "over the weight");
  Chart smoothing = chart("Smoothing", "m");
  Curve costs{.name = "cost", .x = {}, .y = {}}, largest{.name = "largest", .x = {}, .y = {}},
      mean{.name = "mean", .x = {}, .y = {}}, delta{.name = "smoothing", .x = {}, .y = {}};
  for (const opt::Progress& p : result.history) {
    costs.add(p.iteration, p.cost);
    largest.add(p.iteration, p.unactuated.max);
    mean.add(p.iteration, p.unactuated.mean);
    delta.add(p.iteration, p.smoothing);
  }
  cost.curves = {costs};
  forces.curves = {largest, mean};
  smoothing.curves = {delta};
  return {cost, forces, smoothing};
}

std::vector<Chart> motion_charts(const MotionMetrics& metrics) {
  Chart contact, effort;
  contact.title = "Normal contact force, as it came out";
  contact.y_label = "N";
  effort.title = "Largest share of an effort limit";
  effort.y_label = "1";
  contact.legend_beside = true;
  for (std::size_t i = 0; i < metrics.links.size(); ++i)
    contact.curves.push_back(
        {.name = metrics.links[i], .x = metrics.time, .y = metrics.force[i], .marks = true});
  effort.curves = {{.name = "effort", .x = metrics.time, .y = metrics.effort, .marks = true}};
  return {contact, effort};
}

/// Contact schedule of the links by step: '#' more than kLoaded (5 %) of the weight, '-' less, '.'
/// none.
PageTable schedule(const MotionMetrics& metrics, double weight) {
  PageTable table{{"link", "steps in contact"}, {}};
  for (std::size_t i = 0; i < metrics.links.size(); ++i) {
    std::string marks;
    for (const double f : metrics.force[i])
      marks += f > opt::kLoaded * weight ? '#' : f > 1e-3 * weight ? '-' : '.';
    table.rows.push_back({metrics.links[i], marks});
  }
  return table;
}

PageTable metric_table(const OptimizedStart& start) {
  Json metrics;
  fill_report(start, metrics);
  PageTable table{{"figure", "value"}, {}};
  for (const auto& [key, value] : metrics.items())
    table.rows.push_back({key, value.is_number_float() ? fmt::format("{:.6g}", value.get<double>())
                               : value.is_string()     ? value.get<std::string>()
                                                       : value.dump()});
  return table;
}

PageTable term_table(const opt::Problem& problem, const opt::Result& result) {
  PageTable table{{"term", "cost", "condition"}, {}};
  for (std::size_t i = 0; i < problem.terms.size(); ++i)
    table.rows.push_back({problem.terms[i].name,
                          fmt::format("{:.4g}", result.cost_by_term[static_cast<Eigen::Index>(i)]),
                          problem.terms[i].condition ? "yes" : ""});
  return table;
}

PageTable start_table(const std::vector<OptimizedStart>& starts) {
  PageTable table{{"seed", "outcome", "cost", "iterations", "unactuated", "seconds"}, {}};
  for (const OptimizedStart& s : starts)
    table.rows.push_back({std::to_string(s.seed), opt::outcome_name(s.result.outcome),
                          fmt::format("{:.5g}", s.result.cost), std::to_string(s.result.iterations),
                          fmt::format("{:.2e}", s.verification.unactuated_max),
                          fmt::format("{:.2f}", s.result.seconds)});
  return table;
}

}  // namespace

void write_optimization_page(const std::filesystem::path& folder, const opt::ProblemFile& problem,
                             const std::vector<OptimizedStart>& starts, std::size_t best,
                             const std::string& replay) {
  const opt::Result& result = starts[best].result;
  const MotionMetrics metrics = motion_metrics(problem, result);
  make_report_folder(folder);
  write_iterations((folder / "iterations.csv").string(), result);
  write_motion((folder / "motion.csv").string(), *problem.problem.model, result.options.time_step,
               result);
  HtmlPage page("Motion found: " + problem.name);
  page.paragraph(fmt::format("{} steps of {} s; {} after {} Newton steps in {:.2f} s.",
                             problem.problem.steps, result.options.time_step,
                             opt::outcome_name(result.outcome), result.iterations, result.seconds));
  std::vector<std::pair<std::string, std::string>> links = {{"iterations.csv", "iterations.csv"},
                                                            {"motion.csv", "motion.csv"}};
  if (!replay.empty())
    links.emplace_back("the motion, to play; stages that led to it are its ghosts", replay);
  page.links(links);
  page.table(metric_table(starts[best]));
  if (starts.size() > 1) {
    page.heading("Starts");
    page.table(start_table(starts));
  }
  page.heading("Course");
  for (const Chart& chart : course_charts(result)) page.picture_with_file(svg(chart));
  page.heading("Forces");
  for (const Chart& chart : motion_charts(metrics))
    if (!chart.empty()) page.picture_with_file(svg(chart));
  page.paragraph("Contact schedule: # bears more than 5 % of the weight, - less, . nothing.");
  page.table(schedule(metrics, opt::scene_weight(*problem.problem.model)));
  page.heading("Terms");
  page.table(term_table(problem.problem, result));
  write_page(folder, page);
}

}  // namespace counterpoint::apps
