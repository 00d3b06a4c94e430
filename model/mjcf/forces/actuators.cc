#include "counterpoint/model/mjcf/forces/actuators.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "counterpoint/model/mjcf/forces/actuator_law.h"
#include "counterpoint/model/mjcf/forces/commanded.h"
#include "counterpoint/model/mjcf/forces/damping_ratio.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::mjcf {
namespace {

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
                         "plugin",     "instance",    "nsample",   "interp",        "delay",
                         "tausmooth",  "range",       "force",     "scale",         "lmin",
                         "lmax",       "vmax",        "fpmax",     "fvmax",         "area",
                         "diameter",   "bias"});
    const std::vector<const Element*> levels = law_levels(defaults_, e);
    const Law law = read_law(document_, levels);
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
    if (lacks.empty() && needs_command(e, law)) {
      read_commanded({document_, bodies_, e, levels, law, length, tendon}, actuator, model_);
    } else if (!lacks.empty()) {
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
    for (const Element* level : law_levels(defaults_, e))
      group = Values(document_, *level).integer("group", group);
    return switches_.off.count("actuation") > 0 || switches_.groups_off.count(group) > 0;
  }

  /// Returns the feature that the engine lacks for this actuator, or "" with the length of the
  /// transmission in joint coordinates, or with the tendon.
  std::string what_lacks(const Element& e, const Law& law, Couplings::Reduced& length,
                         TendonSpec*& on) const {
    const Values v(document_, e);
    if (!law.unsupported.empty()) return law.unsupported;
    if (v.has("refsite")) return "refsite";
    const bool plugin = e.Attribute("plugin") || e.Attribute("instance");
    if (plugin && !is_pid_plugin(document_, e)) return "a plugin other than mujoco.pid";
    if (!law.is_muscle()) {
      if (law.dynamics != "none" && !law.is_filtered() && !law.integrates())
        return "dyntype=\"" + law.dynamics + "\"";
      if (!law.has_affine_gain()) return "gaintype=\"" + law.gain_type + "\"";
      if (!law.has_affine_bias()) return "biastype=\"" + law.bias_type + "\"";
    }
    if (v.has("site") || v.has("body")) return "";
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
      return "a transmission of this kind";
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
    if (!is_limited(document_, e, law.control_limited, range)) return;
    if (!(range->first <= range->second))
      document_.fail(e, "ctrlrange: the first number must be less");
    actuator.least = range->first;
    actuator.most = range->second;
  }

  /// The actuator's length is gear times that of the tendon, its force on the tendon gear times its
  /// own.
  void place_on_tendon(const Element& e, const Law& law, TendonSpec& tendon,
                       MjcfModel::Actuator& actuator) {
    const double g = law.gear[0];
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
    if (is_limited(document_, e, law.force_limited, law.force_range))
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
    const double c = law.gear[0] * length.sum[0].second, constant = law.gear[0] * length.constant;
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
    if (ratio > 0.0) {
      const char* name = e.Attribute("joint");
      if (!name) name = e.Attribute("jointinparent");
      const int driven = name ? bodies_.joints[bodies_.joint_names.at(name)].spec : joint;
      ratios_.push_back({static_cast<int>(model_.actuators.size()), joint, driven, ratio,
                         -law.bias[1], c, name ? law.gear[0] : c});
    }
    bound_effort(e, law, c, joint, actuator, stiffness > 0.0 || damping > 0.0 || ratio > 0.0);
  }

  void bound_effort(const Element& e, const Law& law, double c, int joint,
                    const MjcfModel::Actuator& actuator, bool servo) {
    double limit = kInfinity;
    if (is_limited(document_, e, law.force_limited, law.force_range)) {
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
