#include "counterpoint/model/mjcf/forces/muscles.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "counterpoint/model/mjcf/bodies/reference_model.h"

namespace counterpoint::mjcf {
namespace {

/// Places of the parameters in gainprm and biasprm.
enum MusclePlace : std::size_t { kLow, kHigh, kForce, kScale, kLmin, kLmax, kVmax, kFpmax, kFvmax };

struct MuscleNumbers {
  std::array<double, 10> dynamics = {1.0}, gain = {1.0}, bias = {};
  bool passive = false;  ///< whether there is a passive force, with the parameters `bias`
  std::optional<std::pair<double, double>> lengths;
};

/// MuJoCo's defaults of <muscle>, in place of those of <general> that are still there.
constexpr std::array<double, 9> kMuscleDefaults = {0.75, 1.05, -1.0, 200.0, 0.5,
                                                   1.6,  1.5,  1.3,  1.2};
constexpr std::array<double, 2> kTimeDefaults = {0.01, 0.04};

void overwrite(const std::vector<double>& from, std::array<double, 10>& to) {
  std::copy(from.begin(), from.end(), to.begin());
}

void apply_muscle_element(const Values& v, MuscleNumbers& p) {
  const std::array<double, 10> untouched = {1.0};
  for (std::size_t i = 0; i < kMuscleDefaults.size(); ++i)
    if (p.gain[i] == untouched[i]) p.gain[i] = kMuscleDefaults[i];
  for (std::size_t i = 0; i < kTimeDefaults.size(); ++i)
    if (p.dynamics[i] == untouched[i]) p.dynamics[i] = kTimeDefaults[i];
  overwrite(v.numbers("timeconst", 2, 2), p.dynamics);
  p.dynamics[2] = v.number("tausmooth", p.dynamics[2]);
  overwrite(v.numbers("range", 2, 2), p.gain);
  const std::array names = {"force", "scale", "lmin", "lmax", "vmax", "fpmax", "fvmax"};
  for (std::size_t i = 0; i < names.size(); ++i)
    p.gain[kForce + i] = v.number(names[i], p.gain[kForce + i]);
  p.bias = p.gain;
  p.passive = true;
}

/// Applies the attributes of an element, or of a default, over those applied before.
void apply_muscle_level(const Document& document, const Element& element, MuscleNumbers& p) {
  const Values v(document, element);
  const std::string tag = element.Name();
  if (tag == "muscle") {
    apply_muscle_element(v, p);
  } else if (tag == "general") {
    overwrite(v.numbers("dynprm", 1, 10), p.dynamics);
    overwrite(v.numbers("gainprm", 1, 10), p.gain);
    overwrite(v.numbers("biasprm", 1, 10), p.bias);
    p.passive = v.text("biastype", p.passive ? "muscle" : "none") == "muscle";
  }
  const std::vector<double> range = v.numbers("lengthrange", 2, 2);
  // MuJoCo takes equal numbers, 0 0 by default, as missing.
  if (!range.empty() && range[0] != range[1]) p.lengths = std::pair(range[0], range[1]);
}

void check_muscle_numbers(const Document& document, const Element& e, const MuscleNumbers& p) {
  const auto expect = [&](bool holds, const char* what) {
    if (!holds) document.fail(e, fmt::format("a muscle needs {}", what));
  };
  for (const auto& list : {p.dynamics, p.gain, p.bias})
    for (const double number : list) expect(std::isfinite(number), "a finite parameter");
  expect(p.dynamics[0] > 0.0 && p.dynamics[1] > 0.0, "two positive numbers as timeconst (dynprm)");
  expect(p.dynamics[2] >= 0.0, "a tausmooth (dynprm) that is not negative");
  expect(p.gain[kLow] < p.gain[kHigh], "two numbers as range (gainprm), the first less");
  expect(p.gain[kForce] != 0.0, "a force (gainprm) that is not 0");
  expect(p.gain[kLmin] < 1.0, "lmin (gainprm) less than 1");
  expect(p.gain[kLmax] > 1.0, "lmax (gainprm) greater than 1");
  expect(p.gain[kVmax] > 0.0, "a positive vmax (gainprm)");
  expect(!p.passive || p.bias[kFpmax] >= 0.0, "an fpmax (biasprm) that is not negative");
  expect(p.gain[kFvmax] > 1.0, "fvmax (gainprm) greater than 1");
  expect(!p.lengths || p.lengths->first < p.lengths->second,
         "two numbers as lengthrange, the first less");
}

/// Whether both forces have the same scale and operating range.
bool one_muscle(const MuscleNumbers& p) {
  if (!p.passive) return true;
  const auto same = [&](MusclePlace i) { return p.gain[i] == p.bias[i]; };
  return same(kLow) && same(kHigh) && same(kForce) && same(kLmax) &&
         (p.gain[kForce] > 0.0 || same(kScale));
}

std::optional<std::pair<double, double>> muscle_limits(const MusclePath& path) {
  const double lower = path.joint ? path.joint->lower : path.tendon->lower;
  const double upper = path.joint ? path.joint->upper : path.tendon->upper;
  if (!std::isfinite(lower) || !std::isfinite(upper) || lower == upper || path.gear == 0.0)
    return std::nullopt;
  return std::minmax({path.gear * lower + path.offset, path.gear * upper + path.offset});
}

/// Size of the acceleration of all coordinates per unit of force of a muscle at a joint, in the
/// reference pose: acc0 of MuJoCo.
double reference_acceleration(const MusclePath& path, const MjcfModel& model) {
  const Model built = reference_model(model);
  const Body& body = built.body(built.find_joint(path.joint->name) + 1);
  const MatrixX mass = reference_mass_matrix(built, body.tree, built.default_q());
  const auto k = body.v_index - built.trees()[static_cast<std::size_t>(body.tree)].v_begin;
  return std::abs(path.gear) * mass.llt().solve(VectorX::Unit(mass.rows(), k)).norm();
}

}  // namespace

std::optional<Muscle> read_muscle(Document& document, const std::vector<const Element*>& levels,
                                  const MusclePath& path, const MjcfModel& model) {
  MuscleNumbers p;
  for (const Element* level : levels) apply_muscle_level(document, *level, p);
  const Element& e = *levels.back();
  check_muscle_numbers(document, e, p);
  const auto refuse = [&](const char* what) {
    document.refuse(e, LeaveOut::kActuators, what);
    return std::nullopt;
  };
  if (!path.joint && !path.tendon)
    return refuse("a muscle pulls at a joint or a tendon; at a site or body it is not supported");
  if (!one_muscle(p))
    return refuse(
        "biasprm gives a muscle of another range, force or lmax than gainprm, which is "
        "not supported");
  if (!p.lengths) p.lengths = muscle_limits(path);
  if (!p.lengths)
    return refuse(
        "lengthrange is missing, and there are no limits to take it from: give the "
        "shortest and longest length (the compiled model of MuJoCo has "
        "actuator_lengthrange)");
  if (p.gain[kForce] < 0.0) {
    if (!path.joint)
      return refuse(
          "a muscle on a tendon needs a positive force: its default, scale over the "
          "acceleration acc0, is supported on joints only (the compiled model of MuJoCo "
          "has actuator_acc0)");
    p.gain[kForce] = p.gain[kScale] / reference_acceleration(path, model);
  }
  Muscle m;
  m.curves = Muscle::Curves::kMujoco;
  m.max_force = p.gain[kForce];
  m.optimal_length = (p.lengths->second - p.lengths->first) / (p.gain[kHigh] - p.gain[kLow]);
  m.slack_length = p.lengths->first - p.gain[kLow] * m.optimal_length - path.offset;
  m.max_speed = p.gain[kVmax];
  m.damping = 0.0;
  m.shortest = p.gain[kLmin];
  m.longest = p.gain[kLmax];
  m.passive_force = p.passive ? p.bias[kFpmax] : 0.0;
  m.eccentric_force = p.gain[kFvmax];
  m.activation_time = p.dynamics[0];
  m.deactivation_time = p.dynamics[1];
  m.activation_smoothing = p.dynamics[2];
  return m;
}

}  // namespace counterpoint::mjcf
