// Charts of curves and bounds as SVG pictures, drawn without a library and readable anywhere. In a
// page (html_page.h) a script adds zooming and reading of values (chart_script.h).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace counterpoint::apps {

struct Curve {
  std::string name;  ///< shown in the legend if there are several curves
  std::vector<double> x, y;
  bool marks = false;  ///< draws a dot at every point, without thinning
  bool line = true;
  /// Text shown when the reader points at a dot, by point; may be empty.
  std::vector<std::string> remarks = {};
  /// Half the height of a band around the curve, by point; may be empty.
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
  bool log_y = false;          ///< logarithm of |y|, with |y| below 1e-18 drawn at 1e-18
  bool legend_beside = false;  ///< legend to the right of the plot instead of inside it
  std::vector<Curve> curves;
  std::vector<Level> levels;
  bool empty() const;
};

/// Escapes text for HTML, SVG and XML, attributes included.
std::string escape_markup(const std::string& text);

/// Returns the picture, 720 x 360, wider by the legend if that stands beside the plot. Points that
/// are not finite are left out. A long curve without marks is thinned: in each of 300 parts of the
/// x axis only its lowest and highest points are drawn, and for its band the widest extent.
std::string svg(const Chart& chart);

}  // namespace counterpoint::apps
