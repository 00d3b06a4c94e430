#include "chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace counterpoint::apps {
namespace {

constexpr double kWidth = 720, kHeight = 360;
constexpr double kLeft = 84, kRight = 16, kTop = 34, kBottom = 46;
constexpr double kSmallest = 1e-18;  // lower limit on logarithmic axes
constexpr double kLegendWidth = 250, kLegendLine = 16;
constexpr std::array<const char*, 10> kColors = {"#1f5fa8", "#c0562a", "#3d8a4d", "#7d4aa0",
                                                 "#8a7a2a", "#3a8f94", "#b03a70", "#555555",
                                                 "#6b8fd6", "#a06a3a"};
/// Dash patterns: curves beyond the number of colours reuse the colours, dashed.
constexpr std::array<const char*, 3> kDashes = {"", " stroke-dasharray='7 3'",
                                                " stroke-dasharray='2 3'"};

struct Look {
  const char* color;
  const char* dash;
};

Look look(std::size_t curve) {
  return {kColors[curve % kColors.size()], kDashes[curve / kColors.size() % kDashes.size()]};
}

/// One axis: maps data to pixels and places the ticks.
class Axis {
 public:
  Axis(bool logarithmic, double pixel_low, double pixel_high)
      : log_(logarithmic), pixel_low_(pixel_low), pixel_high_(pixel_high) {}

  void include(double value) {
    if (!std::isfinite(value)) return;
    const double t = transformed(value);
    low_ = std::min(low_, t);
    high_ = std::max(high_, t);
  }

  void finish() {
    if (!(low_ <= high_)) low_ = high_ = 0.0;
    if (log_) {
      low_ = std::floor(low_);
      high_ = std::max(std::ceil(high_), low_ + 1.0);
      return;
    }
    const double scale = std::max({std::abs(low_), std::abs(high_), 1e-300});
    if (high_ - low_ < 1e-9 * scale) {
      low_ -= 0.5 * (low_ == 0.0 ? 1.0 : scale);
      high_ += 0.5 * (high_ == 0.0 ? 1.0 : scale);
    }
    const double room = 0.04 * (high_ - low_);
    low_ -= room;
    high_ += room;
  }

  double pixel(double value) const {
    return pixel_low_ + (transformed(value) - low_) / (high_ - low_) * (pixel_high_ - pixel_low_);
  }

  std::vector<double> ticks() const {
    std::vector<double> out;
    if (log_) {
      const double step = std::max(1.0, std::ceil((high_ - low_) / 7.0));
      for (double t = low_; t <= high_ + 0.5; t += step) out.push_back(std::pow(10.0, t));
      return out;
    }
    const double raw = (high_ - low_) / 6.0;
    const double power = std::pow(10.0, std::floor(std::log10(raw)));
    const double lead = raw / power;
    const double step = power * (lead <= 1.0 ? 1.0 : lead <= 2.0 ? 2.0 : lead <= 5.0 ? 5.0 : 10.0);
    for (double k = std::ceil(low_ / step); k * step <= high_; ++k)
      out.push_back(k * step + 0.0);  // turns -0 into 0
    return out;
  }

  /// Range for the script: both ends (their decimal logarithms on a logarithmic axis), then 1 if
  /// logarithmic.
  std::string words() const { return fmt::format("{:.12g} {:.12g} {}", low_, high_, log_ ? 1 : 0); }

 private:
  double transformed(double value) const {
    return log_ ? std::log10(std::max(std::abs(value), kSmallest)) : value;
  }
  bool log_;
  double pixel_low_, pixel_high_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

/// Number of neighbouring points of a long curve that are drawn as two, their minimum and maximum.
std::size_t points_drawn_as_two(const Curve& curve) {
  constexpr std::size_t kParts = 300;
  const std::size_t n = std::min(curve.x.size(), curve.y.size());
  return n <= 2 * kParts || curve.marks ? 1 : (n + kParts - 1) / kParts;
}

/// Indices of the points to draw.
std::vector<std::size_t> thinned(const Curve& curve) {
  const std::size_t n = std::min(curve.x.size(), curve.y.size());
  const std::size_t part = points_drawn_as_two(curve);
  std::vector<std::size_t> out;
  for (std::size_t begin = 0; begin < n; begin += part) {
    const std::size_t end = std::min(begin + part, n);
    const auto [low, high] =
        std::minmax_element(curve.y.begin() + static_cast<std::ptrdiff_t>(begin),
                            curve.y.begin() + static_cast<std::ptrdiff_t>(end));
    auto first = static_cast<std::size_t>(low - curve.y.begin());
    auto second = static_cast<std::size_t>(high - curve.y.begin());
    if (second < first) std::swap(first, second);
    out.push_back(first);
    if (second != first) out.push_back(second);
  }
  return out;
}

void draw_axes(const Chart& chart, const Axis& x, const Axis& y, std::string& out) {
  const double bottom = kHeight - kBottom, right = kWidth - kRight;
  out += "<g class='grid'>\n";
  for (const double tick : x.ticks()) {
    out += fmt::format(
        "<line x1='{0:.1f}' y1='{1}' x2='{0:.1f}' y2='{2}' stroke='#e4e4e4'/>\n"
        "<text x='{0:.1f}' y='{3}' text-anchor='middle'>{4:.4g}</text>\n",
        x.pixel(tick), kTop, bottom, bottom + 16, tick);
  }
  for (const double tick : y.ticks()) {
    out += fmt::format(
        "<line x1='{0}' y1='{1:.1f}' x2='{2}' y2='{1:.1f}' stroke='#e4e4e4'/>\n"
        "<text x='{3}' y='{4:.1f}' text-anchor='end'>{5:.6g}</text>\n",
        kLeft, y.pixel(tick), right, kLeft - 6, y.pixel(tick) + 4, tick);
  }
  out += "</g>\n";
  out += fmt::format("<path d='M{0} {1}V{2}H{3}' fill='none' stroke='#444'/>\n", kLeft, kTop,
                     bottom, right);
  out += fmt::format("<text x='{}' y='{}' text-anchor='middle'>{}</text>\n", 0.5 * (kLeft + right),
                     kHeight - 10, escape_markup(chart.x_label));
  out +=
      fmt::format("<text transform='translate(16 {}) rotate(-90)' text-anchor='middle'>{}</text>\n",
                  0.5 * (kTop + bottom), escape_markup(chart.y_label));
  out += fmt::format("<text x='{}' y='20' font-size='14'>{}</text>\n", kLeft,
                     escape_markup(chart.title));
}

void draw_marks(const Curve& curve, const char* color, const Axis& x, const Axis& y,
                std::string& out) {
  const std::size_t n = std::min(curve.x.size(), curve.y.size());
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(curve.x[i]) || !std::isfinite(curve.y[i])) continue;
    const std::string shape =
        fmt::format("cx='{:.2f}' cy='{:.2f}' r='{}' fill='{}'", x.pixel(curve.x[i]),
                    y.pixel(curve.y[i]), curve.line ? "3.2" : "6.5", curve.line ? color : "none");
    const std::string rim = curve.line ? "" : fmt::format(" stroke='{}' stroke-width='1.6'", color);
    if (i < curve.remarks.size()) {
      out += fmt::format("<circle {}{}><title>{}</title></circle>\n", shape, rim,
                         escape_markup(curve.remarks[i]));
    } else {
      out += fmt::format("<circle {}{}/>\n", shape, rim);
    }
  }
}

/// Draws the band as a polygon: the upper edge from left to right, then the lower edge back.
void draw_band(const Curve& curve, const char* color, const Axis& x, const Axis& y,
               std::string& out) {
  const std::size_t n = std::min({curve.x.size(), curve.y.size(), curve.band.size()});
  const std::size_t part = points_drawn_as_two(curve);
  std::string upper, lower;
  for (std::size_t begin = 0; begin < n; begin += part) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = begin; i < std::min(begin + part, n); ++i) {
      if (!std::isfinite(curve.y[i]) || !std::isfinite(curve.band[i])) continue;
      low = std::min(low, curve.y[i] - curve.band[i]);
      high = std::max(high, curve.y[i] + curve.band[i]);
    }
    if (!(low <= high)) continue;
    const double at = x.pixel(curve.x[begin]);
    upper += fmt::format("{:.2f},{:.2f} ", at, y.pixel(high));
    lower.insert(0, fmt::format("{:.2f},{:.2f} ", at, y.pixel(low)));
  }
  if (upper.empty()) return;
  lower.pop_back();
  out += fmt::format(
      "<polyline class='band' points='{}' fill='{}' fill-opacity='0.18' stroke='none'/>\n",
      upper + lower, color);
}

void draw_curve(const Curve& curve, const Look& look, const Axis& x, const Axis& y,
                std::string& out) {
  std::string points;
  for (const std::size_t i : thinned(curve)) {
    if (!std::isfinite(curve.x[i]) || !std::isfinite(curve.y[i])) continue;
    points += fmt::format("{:.2f},{:.2f} ", x.pixel(curve.x[i]), y.pixel(curve.y[i]));
  }
  if (!points.empty() && curve.line) {
    points.pop_back();
    out += fmt::format(
        "<polyline points='{}' data-name='{}' fill='none' stroke='{}' stroke-width='1.6'{} "
        "stroke-linejoin='round'/>\n",
        points, escape_markup(curve.name), look.color, look.dash);
  }
  if (curve.marks) draw_marks(curve, look.color, x, y, out);
}

void draw_legend(const Chart& chart, std::string& out) {
  const std::size_t count = chart.curves.size();
  for (std::size_t i = 0; count > 1 && i < count; ++i) {
    const Curve& curve = chart.curves[i];
    const Look how = look(i);
    const std::string name = escape_markup(curve.name);
    if (!chart.legend_beside) {
      out += fmt::format("<text x='{}' y='{}' fill='{}'>{}</text>\n", kLeft + 8, kTop + 14 + 15 * i,
                         how.color, name);
      continue;
    }
    const double at = kTop + 10 + kLegendLine * static_cast<double>(i);
    if (curve.line) {
      out += fmt::format(
          "<line x1='{0}' y1='{1}' x2='{2}' y2='{1}' stroke='{3}' stroke-width='1.6'{4}/>\n",
          kWidth, at - 4, kWidth + 24, how.color, how.dash);
    } else {
      out += fmt::format("<circle cx='{}' cy='{}' r='5' fill='none' stroke='{}'/>\n", kWidth + 12,
                         at - 4, how.color);
    }
    out +=
        fmt::format("<text x='{}' y='{}' fill='{}'>{}</text>\n", kWidth + 30, at, how.color, name);
  }
}

void draw_level(const Level& level, const Axis& y, std::string& out) {
  const double at = y.pixel(level.y);
  out += fmt::format(
      "<g class='level'><line x1='{0}' y1='{1:.1f}' x2='{2}' y2='{1:.1f}' stroke='#b00020' "
      "stroke-dasharray='6 4'/>\n"
      "<text x='{3}' y='{4:.1f}' text-anchor='end' fill='#b00020'>{5}</text></g>\n",
      kLeft, at, kWidth - kRight, kWidth - kRight - 4, at > kTop + 16 ? at - 4 : at + 14,
      escape_markup(level.name));
}

}  // namespace

std::string escape_markup(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '\'':
        out += "&#39;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

bool Chart::empty() const {
  return std::all_of(curves.begin(), curves.end(), [](const Curve& c) { return c.x.empty(); });
}

std::string svg(const Chart& chart) {
  Axis x(chart.log_x, kLeft, kWidth - kRight);
  Axis y(chart.log_y, kHeight - kBottom, kTop);
  for (const Curve& curve : chart.curves) {
    for (const double value : curve.x) x.include(value);
    for (const double value : curve.y) y.include(value);
    for (std::size_t i = 0; i < std::min(curve.y.size(), curve.band.size()); ++i) {
      y.include(curve.y[i] - curve.band[i]);
      y.include(curve.y[i] + curve.band[i]);
    }
  }
  for (const Level& level : chart.levels) y.include(level.y);
  x.finish();
  y.finish();
  std::string out = fmt::format(
      "<svg class='chart' xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1}' "
      "viewBox='0 0 {0} {1}' data-frame='{2} {3} {4} {5}' data-x='{6}' data-y='{7}' "
      "data-x-label='{8}' font-family='sans-serif' font-size='12'>\n"
      "<rect width='{0}' height='{1}' fill='white'/>\n",
      kWidth + (chart.legend_beside ? kLegendWidth : 0.0), kHeight, kLeft, kTop, kWidth - kRight,
      kHeight - kBottom, x.words(), y.words(), escape_markup(chart.x_label));
  draw_axes(chart, x, y, out);
  out += "<g class='plot'>\n";
  for (std::size_t i = 0; i < chart.curves.size(); ++i)
    draw_band(chart.curves[i], look(i).color, x, y, out);
  for (std::size_t i = 0; i < chart.curves.size(); ++i)
    draw_curve(chart.curves[i], look(i), x, y, out);
  for (const Level& level : chart.levels) draw_level(level, y, out);
  out += "</g>\n";
  draw_legend(chart, out);
  return out + "</svg>\n";
}

}  // namespace counterpoint::apps
