// The law of an actuator of an MJCF file, with its defaults.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/mjcf/document/defaults.h"
#include "counterpoint/model/mjcf/document/document.h"

namespace counterpoint::mjcf {

/// Actuator law: force = (gain[0] + gain[2] velocity) u + bias[0] + bias[1] length + bias[2]
/// velocity; gain[2] counts with gain_type affine alone, and damps.
struct Law {
  std::string unsupported;  ///< feature that has no counterpart here
  bool by_itself = false;   ///< may apply a force without control
  std::string gain_type = "fixed", bias_type = "none", dynamics = "none";
  std::vector<double> gain = {1.0, 0.0, 0.0}, bias = {0.0, 0.0, 0.0};
  std::vector<double> dynamics_numbers = {1.0};
  double damping_ratio = 0.0;
  double inherited_range = 0.0;
  std::optional<std::pair<double, double>> control_range, force_range, activation_range;
  std::string control_limited = "auto", force_limited = "auto", activation_limited = "auto";
  std::vector<double> gear = {1.0};

  bool has_affine_gain() const {
    return gain_type == "fixed" || (gain_type == "affine" && gain[1] == 0.0 && gain[2] <= 0.0);
  }
  bool has_affine_bias() const { return bias_type == "none" || bias_type == "affine"; }
  double command_damping() const { return gain_type == "affine" ? -gain[2] : 0.0; }
  bool integrates() const { return dynamics == "integrator"; }
  bool is_filtered() const { return dynamics == "filter" || dynamics == "filterexact"; }
  bool is_muscle() const { return dynamics == "muscle" && gain_type == "muscle"; }
  double bias_number(std::size_t i) const { return bias_type == "affine" ? bias[i] : 0.0; }
};

/// Returns the elements that set the law of `e`: its default classes, the outermost first, and `e`.
std::vector<const Element*> law_levels(const Defaults& defaults, const Element& e);

/// Returns the law that these elements give together.
Law read_law(const Document& document, const std::vector<const Element*>& levels);

/// Whether a range that is given is in force: `limited` is "true", "false" or "auto".
bool is_limited(const Document& document, const Element& e, const std::string& limited,
                const std::optional<std::pair<double, double>>& range);

}  // namespace counterpoint::mjcf
