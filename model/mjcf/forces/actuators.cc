#include "counterpoint/model/mjcf/forces/actuators.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "counterpoint/model/mjcf/forces/damping_ratio.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::mjcf {
namespace {

const std::vector<std::string> kTags = {"general",  "motor",       "position",
                                        "velocity", "intvelocity", "damper",
                                        "cylinder", "muscle",      "adhesion"};

/// Actuator law: force = gain u + bias[0] + bias[1] length + bias[2] velocity.
struct Law {
  std::string unsupported;  ///< feature that has no counterpart here
  bool by_itself = false;   ///< may apply a force without control
  std::string gain_type = "fixed", bias_type = "none", dynamics = "none";
  std::vector<double> gain = {1.0, 0.0, 0.0}, bias = {0.0, 0.0, 0.0};
  double damping_ratio = 0.0;
  double inherited_range = 0.0;
  std::optional<std::pair<double, double>> control_range, force_range;
  std::string control_limited = "auto", force_limited = "auto";
  double gear = 1.0;
  bool further_gears = false;
};

void set_first(const std::vector<double>& from, std::vector<double>& to) {
  if (from.empty()) return;
  to = from;
  to.resize(std::max<std::size_t>(to.size(), 3));
}

std::optional<std::pair<double, double>> range_of(const Values& v, const char* key) {
  const std::vector<double> range = v.numbers(key, 2, 2);
  if (range.empty()) return std::nullopt;
  return std::pair(range[0], range[1]);
}

void apply_common(const Values& v, Law& law) {
  if (const auto r = range_of(v, "ctrlrange")) law.control_range = r;
  if (const auto r = range_of(v, "forcerange")) law.force_range = r;
  law.control_limited = v.text("ctrllimited", law.control_limited);
  law.force_limited = v.text("forcelimited", law.force_limited);
  law.inherited_range = v.number("inheritrange", law.inherited_range);
  const std::vector<double> gear = v.numbers("gear", 1, 6);
  if (gear.empty()) return;
  law.gear = gear[0];
  law.further_gears = std::any_of(gear.begin() + 1, gear.end(), [](double g) { return g != 0.0; });
}

void apply_general(const Values& v, Law& law) {
  law.gain_type = v.text("gaintype", law.gain_type);
  law.bias_type = v.text("biastype", law.bias_type);
  law.dynamics = v.text("dyntype", law.dynamics);
  set_first(v.numbers("gainprm", 1, 10), law.gain);
  set_first(v.numbers("biasprm", 1, 10), law.bias);
}

void apply_position(const Values& v, Law& law) {
  const double kp = v.number("kp", law.gain[0]);
  law.gain = {kp, 0.0, 0.0};
  law.gain_type = "fixed";
  law.bias_type = "affine";
  law.bias[1] = -kp;
  if (const auto kv = v.number("kv")) {
    law.bias[2] = -*kv;
    law.damping_ratio = 0.0;
  }
  if (const auto ratio = v.number("dampratio")) law.damping_ratio = *ratio;
  if (v.number("timeconst", 0.0) > 0.0) law.dynamics = "filterexact";
}

void apply_velocity(const Values& v, Law& law) {
  const double kv = v.number("kv", law.gain[0]);
  law.gain = {kv, 0.0, 0.0};
  law.bias = {0.0, 0.0, -kv};
  law.gain_type = "fixed";
  law.bias_type = "affine";
}

/// Applies the attributes of an element, or of a default class, over those applied before.
void apply(const Document& document, const Element& element, Law& law) {
  const Values v(document, element);
  const std::string tag = element.Name();
  law.unsupported.clear();
  law.by_itself = false;
  if (tag == "general") {
    apply_general(v, law);
  } else if (tag == "motor") {
    law.gain = {1.0, 0.0, 0.0};
    law.gain_type = "fixed";
    law.bias_type = law.dynamics = "none";
  } else if (tag == "position") {
    apply_position(v, law);
  } else if (tag == "velocity") {
    apply_velocity(v, law);
  } else {
    law.unsupported = "<" + tag + ">";
    law.by_itself = tag != "damper" && tag != "adhesion" && tag != "muscle";
  }
  apply_common(v, law);
}

class ActuatorReader {
 public:
  ActuatorReader(Document& document, const Defaults& defaults, const Switches& switches,
                 const Bodies& bodies, const Tendons& tendons, const Couplings& couplings,
                 MjcfModel& model)
      : document_(document),
        defaults_(defaults),
        switches_(switches),
        bodies_(bodies),
        tendons_(tendons),
        couplings_(couplings),
        model_(model) {}

  void read(const Element& e) {
    document_.expect(e, {"name",       "class",       "group",     "ctrllimited",   "forcelimited",
                         "actlimited", "lengthrange", "ctrlrange", "forcerange",    "actrange",
                         "gear",       "cranklength", "joint",     "jointinparent", "tendon",
                         "cranksite",  "slidersite",  "site",      "refsite",       "body",
                         "user",       "actdim",      "dyntype",   "gaintype",      "biastype",
                         "dynprm",     "gainprm",     "biasprm",   "actearly",      "kp",
                         "kv",         "dampratio",   "timeconst", "inheritrange",  "gain",
                         "plugin",     "instance",    "nsample",   "interp",        "delay"});
    Law law;
    for (const Element* level : defaults_.chain(e, "", kTags)) apply(document_, *level, law);
    apply(document_, e, law);
    MjcfModel::Actuator actuator;
    actuator.name = name_of(e);
    actuator.where = document_.where(e);
    if (is_off(e)) {
      document_.note(e, "switched off by <option>: it pulls at nothing");
      model_.actuators.push_back(actuator);
      return;
    }
    Couplings::Reduced length;
    TendonSpec* tendon = nullptr;
    const std::string lacks = what_lacks(e, law, length, tendon);
    bound_control(e, law, actuator);
    if (!lacks.empty()) {
      no_counterpart(e, law, lacks);
    } else if (tendon) {
      place_on_tendon(e, law, *tendon, actuator);
    } else {
      place(e, law, length, actuator);
    }
    model_.actuators.push_back(actuator);
  }

  /// Bounds each joint's effort by the sum of its actuators' limits, then applies the damping
  /// ratios.
  void finish() {
    for (const auto& [joint, sum] : effort_) {
      JointSpec& spec = model_.robot.joints[joint];
      spec.effort_limit = std::min(spec.effort_limit, sum);
    }
    apply_damping_ratios(ratios_, model_);
  }

 private:
  bool is_off(const Element& e) const {
    int group = 0;
    for (const Element* level : defaults_.chain(e, "", kTags))
      group = Values(document_, *level).integer("group", group);
    return switches_.off.count("actuation") > 0 ||
           switches_.groups_off.count(Values(document_, e).integer("group", group)) > 0;
  }

  /// Returns the feature that the engine lacks for this actuator, or "" with the length of the
  /// transmission in joint coordinates, or with the tendon.
  std::string what_lacks(const Element& e, const Law& law, Couplings::Reduced& length,
                         TendonSpec*& on) const {
    const Values v(document_, e);
    if (!law.unsupported.empty()) return law.unsupported;
    if (e.Attribute("plugin")) return "a plugin";
    if (law.dynamics != "none") return "dyntype=\"" + law.dynamics + "\"";
    if (law.gain_type != "fixed") return "gaintype=\"" + law.gain_type + "\"";
    if (law.bias_type != "none" && law.bias_type != "affine")
      return "biastype=\"" + law.bias_type + "\"";
    if (v.has("tendon")) {
      const auto tendon = tendons_.find(v.text("tendon"));
      if (tendon == tendons_.end())
        document_.fail(e, fmt::format("there is no tendon '{}'", v.text("tendon")));
      const auto own = std::find_if(model_.tendons.begin(), model_.tendons.end(),
                                    [&](const TendonSpec& t) { return t.name == tendon->first; });
      if (own != model_.tendons.end()) {
        on = &*own;
        return "";
      }
      length = couplings_.reduce(tendon->second.sum);
    } else if (const char* joint = e.Attribute("joint"); joint || e.Attribute("jointinparent")) {
      const std::string name = joint ? joint : e.Attribute("jointinparent");
      const auto found = bodies_.joint_names.find(name);
      if (found == bodies_.joint_names.end())
        document_.fail(e, fmt::format("there is no joint '{}'", name));
      const int spec = bodies_.joints[found->second].spec;
      if (joint_nv(model_.robot.joints[spec].type) != 1) return "a joint of several coordinates";
      length = couplings_.reduce({{spec, 1.0}});
    } else {
      return "a force at a site or body";
    }
    if (length.sum.size() == 1) return "";
    return "a sum of joints that are not coupled";
  }

  void no_counterpart(const Element& e, const Law& law, const std::string& lacks) {
    const bool by_itself = law.by_itself || law.bias_type != "none" || e.Attribute("plugin");
    if (by_itself)
      return document_.refuse(
          e, LeaveOut::kActuators,
          fmt::format("the actuator pulls by itself, and {} is not supported", lacks));
    document_.note(e,
                   fmt::format("{} is not supported: it is no input here; without control it does "
                               "not pull",
                               lacks));
  }

  void bound_control(const Element& e, const Law& law, MjcfModel::Actuator& actuator) const {
    auto range = law.control_range;
    if (law.inherited_range > 0.0 && e.Attribute("joint")) {
      const auto joint = bodies_.joint_names.find(e.Attribute("joint"));
      if (joint != bodies_.joint_names.end()) {
        const JointSpec& spec = model_.robot.joints[bodies_.joints[joint->second].spec];
        if (std::isfinite(spec.lower) && std::isfinite(spec.upper)) {
          const double middle = 0.5 * (spec.lower + spec.upper);
          const double half = 0.5 * law.inherited_range * (spec.upper - spec.lower);
          range = std::pair(middle - half, middle + half);
        }
      }
    }
    const bool limited = law.control_limited == "true" ||
                         (law.control_limited == "auto" && document_.compiler(e).auto_limits);
    if (!range || !limited) return;
    if (!(range->first <= range->second))
      document_.fail(e, "ctrlrange: the first number must be less");
    actuator.least = range->first;
    actuator.most = range->second;
  }

  /// The actuator's length is gear times that of the tendon, its force on the tendon gear times its
  /// own.
  void place_on_tendon(const Element& e, const Law& law, TendonSpec& tendon,
                       MjcfModel::Actuator& actuator) {
    const double g = law.gear;
    const bool affine = law.bias_type == "affine";
    if (law.damping_ratio > 0.0 || (affine && (law.bias[1] > 0.0 || law.bias[2] > 0.0)))
      return document_.refuse(e, LeaveOut::kActuators,
                              "a damping ratio, or a bias that pushes on, is not supported on a "
                              "tendon: give kv");
    actuator.tendon = tendon.name;
    actuator.gain = g * law.gain[0];
    actuator.bias = affine ? g * law.bias[0] : 0.0;
    actuator.stiffness = affine ? -law.bias[1] * g * g : 0.0;
    actuator.damping = affine ? -law.bias[2] * g * g : 0.0;
    TendonServo& servo = tendon.servo;
    servo.stiffness += actuator.stiffness;
    servo.damping += actuator.damping;
    double least = -kInfinity, most = kInfinity;
    if (limits_force(e, law))
      std::tie(least, most) =
          std::minmax({g * law.force_range->first, g * law.force_range->second});
    if (!affine && actuator.least) {  // a motor's largest force is at a bound of its control
      const auto [low, high] =
          std::minmax({actuator.gain * *actuator.least, actuator.gain * *actuator.most});
      least = std::max(least, low);
      most = std::min(most, high);
    }
    // Several actuators of a tendon pull with the sum of their forces.
    const bool first = pulled_.insert(tendon.name).second;
    servo.least = first ? least : servo.least + least;
    servo.most = first ? most : servo.most + most;
  }

  void place(const Element& e, const Law& law, const Couplings::Reduced& length,
             MjcfModel::Actuator& actuator) {
    // length = c q + constant; the joint force is c times the actuator force.
    const double c = law.gear * length.sum[0].second, constant = law.gear * length.constant;
    const int joint = length.sum[0].first;
    JointSpec& spec = model_.robot.joints[joint];
    const bool affine = law.bias_type == "affine";
    const double stiffness = affine ? -law.bias[1] * c * c : 0.0;
    const double damping = affine ? -std::min(law.bias[2], 0.0) * c * c : 0.0;
    if (stiffness < 0.0)
      return document_.refuse(e, LeaveOut::kActuators,
                              "it pushes away (biasprm: the second number is "
                              "positive), which is not supported");
    actuator.joint = spec.name;
    actuator.gain = c * law.gain[0];
    actuator.bias = affine ? c * (law.bias[0] + law.bias[1] * constant) : 0.0;
    actuator.stiffness = stiffness;
    actuator.damping = damping;
    spec.servo.stiffness += stiffness;
    spec.servo.damping += damping;
    // In a position servo a positive bias[2] is a damping ratio, too.
    double ratio = law.damping_ratio;
    if (affine && law.bias[2] > 0.0 && ratio == 0.0) {
      if (law.gain[0] != -law.bias[1])
        return document_.refuse(e, LeaveOut::kActuators,
                                "it drives motion on (biasprm: the third number "
                                "is positive), which is not supported");
      ratio = law.bias[2];
    }
    if (ratio > 0.0)
      ratios_.push_back({static_cast<int>(model_.actuators.size()), joint, ratio, -law.bias[1], c});
    bound_effort(e, law, c, joint, actuator, stiffness > 0.0 || damping > 0.0 || ratio > 0.0);
  }

  /// Whether the force range is given and in force.
  bool limits_force(const Element& e, const Law& law) const {
    return law.force_range && (law.force_limited == "true" ||
                               (law.force_limited == "auto" && document_.compiler(e).auto_limits));
  }

  void bound_effort(const Element& e, const Law& law, double c, int joint,
                    const MjcfModel::Actuator& actuator, bool servo) {
    double limit = kInfinity;
    if (limits_force(e, law)) {
      const auto [low, high] = *law.force_range;
      const double most = std::max(std::abs(low), std::abs(high));
      limit = std::abs(c) * most;
      if (low != -high)
        document_.note(
            e, fmt::format("forcerange {} ... {}: taken as {} either way", low, high, most));
    }
    if (!servo && actuator.least) {  // a motor's largest force is at a bound of its control
      const double most = std::max(std::abs(*actuator.least), std::abs(*actuator.most));
      limit = std::min(limit, std::abs(actuator.gain) * most + std::abs(actuator.bias));
    }
    const auto [sum, is_first] = effort_.emplace(joint, limit);
    if (!is_first) sum->second += limit;
  }

  Document& document_;
  const Defaults& defaults_;
  const Switches& switches_;
  const Bodies& bodies_;
  const Tendons& tendons_;
  const Couplings& couplings_;
  MjcfModel& model_;
  std::map<int, double> effort_;  // sum of limits [N or N m]; key: joint index
  std::set<std::string> pulled_;  // tendons with actuators
  std::vector<DampingRatio> ratios_;
};

}  // namespace

void read_actuators(Document& document, const Defaults& defaults, const Switches& switches,
                    const Bodies& bodies, const Tendons& tendons, const Couplings& couplings,
                    MjcfModel& model) {
  ActuatorReader reader(document, defaults, switches, bodies, tendons, couplings, model);
  document.each(document.section_children("actuator"), [&](const Element& e) { reader.read(e); });
  reader.finish();
}

}  // namespace counterpoint::mjcf
