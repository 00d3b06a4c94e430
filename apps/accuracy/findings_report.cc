// Findings as files: CSV, pictures, HTML page, JSON.
#include <fmt/format.h>

#include <cmath>
#include <set>

#include "findings.h"
#include "report/chart.h"

namespace counterpoint::apps::accuracy {
namespace {

namespace fs = std::filesystem;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
std::string cell(double value) { return std::isfinite(value) ? fmt::format("{:.9g}", value) : ""; }

// ---- CSV ----------------------------------------------------------------------------------------

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string csv_row(const Findings& findings, const Place& place) {
  const Family& family = findings.measured[place.family].family;
  const Point& p = findings.at(place);
  std::string out = fmt::format("{},{},{},{:.9g}", family.vary, quoted(family.name),
                                family.parameter, p.setting.parameter);
  for (const double value :
       {p.error.all, p.error.length, p.error.angle, p.worst, p.cost, p.cost_low, p.cost_high})
    out.append(1, ',').append(cell(value));
  out += fmt::format(",{},{},{}", p.steps, p.failed, findings.on_front(place) ? 1 : 0);
  for (const PhysicsColumn& column : physics_columns()) {
    const auto value = p.physics ? column.value(*p.physics) : std::nullopt;
    out.append(1, ',').append(value ? cell(*value) : "");
  }
  return out + "\n";
}

std::string csv(const Findings& findings) {
  std::string out =
      "vary,family,parameter,value,error,error_m,error_rad,error_worst_piece,cost_s_per_s,"
      "cost_least_s_per_s,cost_most_s_per_s,steps,failed_pieces,front";
  for (const PhysicsColumn& column : physics_columns()) out += fmt::format(",{}", column.key);
  out += "\n";
  for (size_t f = 0; f < findings.measured.size(); ++f)
    for (size_t i = 0; i < findings.measured[f].points.size(); ++i)
      out += csv_row(findings, {f, i});
  return out;
}

// ---- pictures -----------------------------------------------------------------------------------

std::string remark(const Point& p) {
  return fmt::format("{}: error {:.3g}, {} a simulated second", p.setting.label, p.error.all,
                     seconds_text(p.cost));
}

/// Smallest error drawn: below it round-off decides, and log axes need a limit.
constexpr double kLeastDrawn = 1e-16;

void add_curve(const MeasuredFamily& m, bool over_step, Chart& chart) {
  Curve curve{.name = m.family.name, .x = {}, .y = {}, .marks = true};
  for (const Point& p : m.points) {
    if (!p.measured()) continue;
    curve.add(over_step ? p.setting.parameter : p.cost, std::max(p.error.all, kLeastDrawn));
    curve.remarks.push_back(remark(p));
  }
  if (!curve.x.empty()) chart.curves.push_back(curve);
}

Chart log_chart(const std::string& title, const std::string& x_label) {
  return {.title = title,
          .x_label = x_label,
          .y_label = "position error [m, rad]",
          .log_x = true,
          .log_y = true,
          .legend_beside = true,
          .curves = {},
          .levels = {}};
}

void add_reference(const Findings& findings, Chart& chart) {
  if (findings.reference.error > kLeastDrawn && findings.reference.kind == "fine")
    chart.levels.push_back({"the reference's own error", findings.reference.error});
}

/// Error against computing time, for one item or (if empty) for all, with the Pareto front.
Chart precision_chart(const Findings& findings, const std::string& item) {
  Chart chart =
      log_chart(findings.scene.name + (item.empty() ? ": accuracy against time" : ": " + item),
                "processor time per simulated second [s]");
  for (const MeasuredFamily& m : findings.measured) {
    if (item.empty() ? !m.same_as.empty() : m.family.vary != item) continue;
    add_curve(m, false, chart);
  }
  Curve front{.name = "Pareto front", .x = {}, .y = {}, .marks = true, .line = false};
  for (const Place& place : findings.front) {
    if (!item.empty() && findings.measured[place.family].family.vary != item) continue;
    const Point& p = findings.at(place);
    front.add(p.cost, std::max(p.error.all, kLeastDrawn));
    front.remarks.push_back(remark(p));
  }
  if (!chart.curves.empty() && !front.x.empty()) chart.curves.push_back(front);
  add_reference(findings, chart);
  return chart;
}

Chart step_chart(const Findings& findings) {
  Chart chart = log_chart(findings.scene.name + ": error over the time step", "time step [s]");
  for (const MeasuredFamily& m : findings.measured)
    if (m.same_as.empty() && m.family.over_time_step()) add_curve(m, true, chart);
  add_reference(findings, chart);
  return chart;
}

std::vector<std::string> items(const Findings& findings) {
  std::vector<std::string> out;
  std::set<std::string> seen;
  for (const MeasuredFamily& m : findings.measured)
    if (!m.points.empty() && seen.insert(m.family.vary).second) out.push_back(m.family.vary);
  return out;
}

// ---- the page -----------------------------------------------------------------------------------

std::string page(const Findings& findings) {
  HtmlPage page("What accuracy costs: " + findings.scene.name);
  page.paragraph(fmt::format(
      "{} pieces of {}, each begun anew from the reference. Error: mean over the pieces of the "
      "deviation of the configuration at their ends, root of the mean square over all coordinates "
      "(lengths in metres, angles in radians). Time: processor time per simulated second, median "
      "of "
      "{} runs of all pieces.",
      findings.reference.pieces.size(), seconds_text(findings.plan.length), findings.repeats));
  page.paragraph("Reference: " + reference_words(findings) + ".");
  if (!findings.reference.warning.empty()) page.paragraph("Warning: " + findings.reference.warning);
  page.heading("Recommendation");
  std::vector<std::string> words;
  for (const Recommendation& r : findings.recommendations) words.push_back(r.words);
  page.list(words);
  if (!findings.replay.empty())
    page.links({{"The motion at the recommended setting, to play; others as its ghosts",
                 findings.replay}});
  page.heading("Accuracy against time");
  page.paragraph(
      "Rings mark the Pareto front: no other setting is both cheaper and more accurate.");
  page.picture(svg(precision_chart(findings, "")));
  if (const Chart steps = step_chart(findings); !steps.empty()) page.picture(svg(steps));
  page.heading("Slopes of the error over the time step");
  page.list(order_lines(findings));
  for (const std::string& item : items(findings)) {
    page.heading("Varied: " + item);
    if (item != "timestep") page.picture(svg(precision_chart(findings, item)));
    for (const MeasuredFamily& m : findings.measured) {
      if (m.family.vary != item || m.points.empty()) continue;
      page.paragraph(m.family.name + (m.same_as.empty() ? "" : ", the same as " + m.same_as));
      if (m.same_as.empty()) page.table(work_precision_table(findings, m));
    }
  }
  page.heading("Physics");
  page.paragraph(
      "primal, dual, complementarity: against rigid Coulomb contact, the largest of all contacts "
      "and steps. creep: of a block held on a slope; hover: of a sliding block; rest: height of a "
      "resting block. inverse: largest force recovered where none acts, over the largest at work. "
      "energy: off that of the reference at the ends of pieces.");
  for (const MeasuredFamily& m : findings.measured)
    if (const PageTable table = physics_table(m); m.same_as.empty() && !table.rows.empty())
      page.table(table);
  page.heading("Failures and omissions");
  const std::vector<std::string> omissions = omission_lines(findings);
  if (omissions.empty()) page.paragraph("None.");
  page.list(omissions);
  return page.text();
}

// ---- JSON ---------------------------------------------------------------------------------------

Json json_physics(const Physics& p) {
  Json out;
  for (const PhysicsColumn& column : physics_columns())
    if (const auto value = column.value(p)) out[column.key] = number(*value);
  return out;
}

Json json_point(const Findings& findings, const Point& p, bool on_front) {
  Json out = {{"setting", p.setting.label},
              {"value", p.setting.parameter},
              {"status", p.measured() ? "ok" : "failed"}};
  if (!p.measured()) {
    out["message"] = p.failure;
    out["failed_pieces"] = p.failed;
    return out;
  }
  out["error"] = number(p.error.all);
  out["error_m"] = number(p.error.length);
  out["error_rad"] = number(p.error.angle);
  out["error_worst_piece"] = number(p.worst);
  out["above_reference"] = p.error.all >= kAboveReference * findings.reference.error;
  out["cost_s_per_s"] = number(p.cost);
  out["cost_least_s_per_s"] = number(p.cost_low);
  out["cost_most_s_per_s"] = number(p.cost_high);
  out["steps"] = p.steps;
  out["front"] = on_front;
  if (p.physics) out["physics"] = json_physics(*p.physics);
  return out;
}

Json json_family(const Findings& findings, size_t family) {
  const MeasuredFamily& m = findings.measured[family];
  Json out = {{"vary", m.family.vary},
              {"name", m.family.name},
              {"parameter", m.family.parameter},
              {"status", m.refused.empty() ? "ok" : "not run"}};
  if (!m.refused.empty()) out["message"] = m.refused;
  if (!m.same_as.empty()) out["same_as"] = m.same_as;
  if (m.family.other_engine) out["other_engine"] = true;
  if (m.own_apart) {
    out["own_reference_apart"] = number(*m.own_apart);
    out["own_reference_error"] = number(*m.own_error);
  }
  if (const auto order = fit_order(m, findings.reference.error)) {
    out["order"] = order->slope;
    out["order_from_s"] = order->from;
    out["order_to_s"] = order->to;
  }
  if (m.family.over_time_step()) out["order_of_pieces"] = piece_orders(m, findings.reference);
  out["points"] = Json::array();
  for (size_t i = 0; i < m.points.size(); ++i)
    out["points"].push_back(json_point(findings, m.points[i], findings.on_front({family, i})));
  return out;
}

Json json_reference(const Reference& r) {
  Json out = {{"kind", r.kind},
              {"description", r.description},
              {"integrator", integrator_name(r.integrator)},
              {"time_step_s", r.time_step},
              {"error", number(r.error)},
              {"error_of_pieces", r.piece_errors}};
  if (r.kind == "analytic") {
    out["fine_deviation"] = number(r.fine_deviation);
    out["fine_error"] = number(r.fine_error);
  }
  if (!r.warning.empty()) out["warning"] = r.warning;
  return out;
}

Json json_comparison(const Findings& findings, const Comparison& row) {
  Json out = {{"error", row.error}};
  const auto add = [&](const char* whose, const std::optional<Place>& place) {
    if (!place) return;
    const Point& p = findings.at(*place);
    out[whose] = {{"setting", p.setting.label},
                  {"error", number(p.error.all)},
                  {"cost_s_per_s", number(p.cost)}};
  };
  add("ours", row.ours);
  add("other", row.theirs);
  return out;
}

}  // namespace

void write_report(const fs::path& folder, const Findings& findings) {
  make_report_folder(folder);
  write_file(folder / "accuracy.csv", csv(findings));
  write_file(folder / "accuracy.html", page(findings));
  const auto draw = [&](const std::string& name, const Chart& chart) {
    if (!chart.empty()) write_file(folder / (name + ".svg"), svg(chart));
  };
  draw("accuracy", precision_chart(findings, ""));
  draw("accuracy_steps", step_chart(findings));
  for (const std::string& item : items(findings))
    draw("accuracy_" + item, precision_chart(findings, item));
}

void add_to(Report& report, const Findings& findings) {
  report["pieces"] = findings.reference.pieces.size();
  report["piece_seconds"] = findings.plan.length;
  report["time_step_s"] = findings.plan.time_step;
  report["repeats"] = findings.repeats;
  report["reference"] = json_reference(findings.reference);
  Json families = Json::array();
  for (size_t f = 0; f < findings.measured.size(); ++f)
    families.push_back(json_family(findings, f));
  report["families"] = families;
  report["left_out"] = findings.left_out;
  Json comparisons = Json::array();
  for (const Comparison& row : compare_engines(findings.measured, findings.reference.error))
    comparisons.push_back(json_comparison(findings, row));
  if (!comparisons.empty()) report["comparisons"] = comparisons;
  Json recommendations = Json::array();
  for (size_t i = 0; i < findings.wants.size(); ++i) {
    const Recommendation& r = findings.recommendations[i];
    Json entry = {{"want", findings.wants[i]}, {"met", r.met}, {"words", r.words}};
    if (r.place) {
      entry["setting"] = findings.at(*r.place).setting.label;
      entry["family"] = findings.measured[r.place->family].family.name;
      entry["value"] = findings.at(*r.place).setting.parameter;
    }
    recommendations.push_back(entry);
  }
  report["recommendations"] = recommendations;
}

}  // namespace counterpoint::apps::accuracy
