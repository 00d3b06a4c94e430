// Curves with their bounds, as an SVG picture that needs no library to draw and none to read. In a
// page (html_page.h) a script makes it answer to a pointer (chart_script.h).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace counterpoint::apps {

struct Curve {
  std::string name;  ///< in the legend, if there are several curves
  std::vector<double> x, y;
  bool marks = false;  ///< a dot at every point; then all are drawn
  bool line = true;
  /// What a reader who points at a dot is told, by point; or empty.
  std::vector<std::string> remarks = {};
  /// Half the height of a band around the curve, by point; or empty.
  std::vector<double> band = {};
  void add(double at, double value) {
    x.push_back(at);
    y.push_back(value);
  }
};

/// A horizontal line: a bound or a known answer.
struct Level {
  std::string name;
  double y = 0.0;
};

struct Chart {
  std::string title;
  std::string x_label = "t [s]";
  std::string y_label;
  bool log_x = false;
  bool log_y = false;          ///< of |y|; what is below 1e-18 is drawn there
  bool legend_beside = false;  ///< to the right of the plot, not in it
  std::vector<Curve> curves;
  std::vector<Level> levels;
  bool empty() const;
};

/// `text` as it may stand in HTML, SVG and XML, in attributes too.
std::string escape_markup(const std::string& text);

/// The picture, 720 x 360, wider by the legend where that stands beside. Values that are not finite
/// are left out; of many points of a curve without marks the lowest and the highest in each of 300
/// parts of the axis are drawn, of its band the widest extent there.
std::string svg(const Chart& chart);

}  // namespace counterpoint::apps
