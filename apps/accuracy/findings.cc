#include "findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace counterpoint::apps::accuracy {
namespace {

std::string metric(double value) {
  return std::isfinite(value) ? fmt::format("{:.3g}", value) : "-";
}

std::string parameter_text(const Family& family, double value) {
  return family.over_time_step() ? seconds_text(value) : fmt::format("{:g}", value);
}

/// Prints a table with columns padded to their widest cell; all but the first are aligned right.
void print_table(std::FILE* out, const PageTable& table) {
  std::vector<size_t> width;
  for (size_t c = 0; c < table.header.size(); ++c) {
    width.push_back(table.header[c].size());
    for (const auto& row : table.rows) width[c] = std::max(width[c], row[c].size());
  }
  const auto line = [&](const std::vector<std::string>& row) {
    std::string text = " ";
    for (size_t c = 0; c < row.size(); ++c)
      text += c == 0 ? fmt::format(" {:<{}}", row[c], width[c])
                     : fmt::format("  {:>{}}", row[c], width[c]);
    fmt::print(out, "{}\n", text.substr(0, text.find_last_not_of(' ') + 1));
  };
  line(table.header);
  for (const auto& row : table.rows) line(row);
}

/// Adds the settings whose physics was measured.
void add_physics_rows(const MeasuredFamily& measured, PageTable& table) {
  for (const Point& p : measured.points) {
    if (!p.physics) continue;
    std::vector<std::string>& row = table.rows.emplace_back();
    row.push_back(p.setting.label);
    for (const PhysicsColumn& column : physics_columns()) {
      const auto value = column.value(*p.physics);
      row.push_back(value ? metric(column.scale * *value) : "-");
    }
  }
}

PageTable empty_physics_table() {
  PageTable table{{"setting"}, {}};
  for (const PhysicsColumn& column : physics_columns()) table.header.emplace_back(column.heading);
  return table;
}

}  // namespace

bool Findings::on_front(const Place& place) const {
  return std::find(front.begin(), front.end(), place) != front.end();
}

std::string reference_words(const Findings& findings) {
  const Reference& r = findings.reference;
  if (r.kind == "analytic") {
    return fmt::format(
        "{}; checked against the engine's run by {} at {}, which is {:.2g} off it and {:.2g} off "
        "the run at twice that step",
        r.description, integrator_name(r.integrator), seconds_text(r.time_step), r.fine_deviation,
        r.fine_error);
  }
  return fmt::format("{}; the run at twice that step ends {:.2g} off it: so far may it be wrong",
                     r.description, r.error);
}

std::vector<std::string> order_lines(const Findings& findings) {
  std::vector<std::string> lines;
  for (const MeasuredFamily& m : findings.measured) {
    if (!m.family.over_time_step() || !m.refused.empty() || !m.same_as.empty()) continue;
    std::string line = m.family.name;
    if (const auto order = fit_order(m, findings.reference.error)) {
      line += fmt::format(": order {:.2f}, over {} steps from {} to {}", order->slope,
                          order->points, seconds_text(order->from), seconds_text(order->to));
    } else {
      line += fmt::format(
          ": no order: fewer than three errors stand above ten times the reference's, {:.2g}",
          findings.reference.error);
    }
    if (const auto each = piece_orders(m, findings.reference); !each.empty()) {
      line += fmt::format("; of {} single pieces {:.2f} to {:.2f}, median {:.2f}", each.size(),
                          each.front(), each.back(), each[each.size() / 2]);
    }
    lines.push_back(line);
  }
  return lines;
}

std::vector<std::string> omission_lines(const Findings& findings) {
  std::vector<std::string> lines;
  for (const MeasuredFamily& m : findings.measured) {
    if (!m.refused.empty())
      lines.push_back(fmt::format("{} was not run: {}", m.family.name, m.refused));
    if (!m.same_as.empty()) continue;
    for (const Point& p : m.points) {
      if (p.measured()) continue;
      lines.push_back(fmt::format("{} failed in {} of {} pieces: {}", p.setting.label, p.failed,
                                  findings.reference.pieces.size(), p.failure));
    }
  }
  for (const std::string& item : findings.left_out) lines.push_back("not varied: " + item);
  return lines;
}

std::vector<std::string> comparison_lines(const Findings& findings) {
  std::vector<std::string> lines;
  const auto words = [&](const std::optional<Place>& place) {
    if (!place) return std::string("none");
    const Point& p = findings.at(*place);
    return fmt::format("{} / s, error {:.2g} ({})", seconds_text(p.cost), p.error.all,
                       p.setting.label);
  };
  for (const Comparison& c : compare_engines(findings.measured, findings.reference.error)) {
    std::string line =
        fmt::format("{:.0e}: ours {}; other {}", c.error, words(c.ours), words(c.theirs));
    if (c.ours && c.theirs) {
      line += fmt::format("; ours takes {:.3g} of its time",
                          findings.at(*c.ours).cost / findings.at(*c.theirs).cost);
    }
    lines.push_back(line);
  }
  for (const MeasuredFamily& m : findings.measured) {
    if (!m.own_apart) continue;
    lines.push_back(
        fmt::format("{} is measured against its own fine run, which is {:.2g} from the reference "
                    "and may be off by {:.2g}",
                    m.family.name, *m.own_apart, *m.own_error));
  }
  return lines;
}

PageTable work_precision_table(const Findings& findings, const MeasuredFamily& measured) {
  PageTable table{
      {measured.family.over_time_step() ? "time step" : measured.family.vary, "error",
       "lengths [m]", "angles [rad]", "worst piece", "time / s", "spread", "x real time", ""},
      {}};
  const auto family = static_cast<size_t>(&measured - findings.measured.data());
  for (size_t i = 0; i < measured.points.size(); ++i) {
    const Point& p = measured.points[i];
    const std::string name = parameter_text(measured.family, p.setting.parameter);
    if (!p.measured()) {
      table.rows.push_back(
          {name, "-", "-", "-", "-", "-", "-", "-",
           fmt::format("failed in {} of {} pieces", p.failed, findings.reference.pieces.size())});
      continue;
    }
    std::string remark = findings.on_front({family, i}) ? "front" : "";
    if (p.error.all < kAboveReference * findings.reference.error)
      remark += remark.empty() ? "at the reference's own error" : ", at the reference's own error";
    table.rows.push_back({name, metric(p.error.all), metric(p.error.length), metric(p.error.angle),
                          metric(p.worst), seconds_text(p.cost),
                          fmt::format("{:.0f} %", 100.0 * (p.cost_high - p.cost_low) / p.cost),
                          metric(1.0 / p.cost), remark});
  }
  return table;
}

PageTable physics_table(const MeasuredFamily& measured) {
  PageTable table = empty_physics_table();
  add_physics_rows(measured, table);
  return table;
}

void print(std::FILE* out, const Findings& findings) {
  fmt::print(out, "{}: {} pieces of {}; reference: {}\n", findings.scene.name,
             findings.reference.pieces.size(), seconds_text(findings.plan.length),
             reference_words(findings));
  if (!findings.reference.warning.empty())
    fmt::print(out, "warning: {}\n", findings.reference.warning);
  PageTable physics = empty_physics_table();
  for (const MeasuredFamily& m : findings.measured) {
    if (!m.refused.empty()) continue;
    if (!m.same_as.empty()) {
      fmt::print(out, "\n{} ({}): the same as {}\n", m.family.name, m.family.vary, m.same_as);
      continue;
    }
    fmt::print(out, "\n{} ({})\n", m.family.name, m.family.vary);
    print_table(out, work_precision_table(findings, m));
    add_physics_rows(m, physics);
  }
  fmt::print(out, "\nslopes of the error over the time step\n");
  for (const std::string& line : order_lines(findings)) fmt::print(out, "  {}\n", line);
  if (!physics.rows.empty()) {
    fmt::print(out, "\nphysics, at the scene's time step and of what is recommended\n");
    print_table(out, physics);
  }
  const std::vector<std::string> comparisons = comparison_lines(findings);
  if (!comparisons.empty()) fmt::print(out, "\nthe cheapest setting for an error\n");
  for (const std::string& line : comparisons) fmt::print(out, "  {}\n", line);
  const std::vector<std::string> omissions = omission_lines(findings);
  if (!omissions.empty()) fmt::print(out, "\nfailures and omissions\n");
  for (const std::string& line : omissions) fmt::print(out, "  {}\n", line);
  fmt::print(out, "\n");
  for (const Recommendation& r : findings.recommendations)
    fmt::print(out, "recommended {}\n", r.words);
}

}  // namespace counterpoint::apps::accuracy
