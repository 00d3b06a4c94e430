#include "counterpoint/model/mjcf/options.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstring>

#include "counterpoint/model/special_values.h"

namespace counterpoint::mjcf {
namespace {

void read_flags(Document& document, const Element& e, MjcfModel& model, Switches& switches) {
  // Flags for MuJoCo's algorithms, without effect on the model.
  static const std::set<std::string> kHarmless = {
      "eulerdamp",   "warmstart", "refsafe",   "sensor", "midphase",
      "nativeccd",   "multiccd",  "island",    "energy", "fwdinv",
      "invdiscrete", "override",  "autoreset", "sleep",  "adaptivegap"};
  static const std::set<std::string> kObeyed = {"constraint", "equality",  "frictionloss", "limit",
                                                "contact",    "passive",   "spring",       "damper",
                                                "gravity",    "clampctrl", "actuation"};
  const Values v(document, e);
  std::string obeyed;
  for (const auto* a = e.FirstAttribute(); a; a = a->Next()) {
    const std::string name = a->Name();
    const bool off = v.word(a->Name(), {"enable", "disable"}, "enable") == "disable";
    if (!off && (name == "override" || name == "diagexact"))
      document.note(e, fmt::format("{} is not obeyed: contacts keep their own parameters", name));
    if (!off || kHarmless.count(name) > 0) continue;
    if (name == "filterparent")
      document.fail(
          e, "filterparent=\"disable\": bodies joined by a joint never touch here; remove it");
    if (kObeyed.count(name) == 0)
      document.fail(e, fmt::format("{}=\"disable\" is not supported; remove it", name));
    obeyed += (obeyed.empty() ? "" : ", ") + name;
    switches.off.insert(name);
  }
  if (switches.off.count("passive") > 0) switches.off.insert({"spring", "damper"});
  if (switches.off.count("gravity") > 0) model.gravity.setZero();
  if (!obeyed.empty()) document.note(e, fmt::format("switched off: {}", obeyed));
}

void read_air_options(Document& document, const Values& v, MjcfModel& model) {
  const double density = v.number("density", model.air_density);
  const double viscosity = v.number("viscosity", model.air_viscosity);
  if (density < 0.0 || viscosity < 0.0)
    document.fail(v.element(), "density and viscosity must not be negative");
  if (v.vector("wind", Vector3::Zero()) != Vector3::Zero() && (density > 0.0 || viscosity > 0.0))
    document.refuse(v.element(), LeaveOut::kFluid, "wind is not supported: the air is still");
  if (document.options().leave_out.count(LeaveOut::kFluid) > 0) {
    if (density > 0.0 || viscosity > 0.0)
      document.note(v.element(), "density and viscosity of the air are left out");
    return;
  }
  model.air_density = density;
  model.air_viscosity = viscosity;
}

std::string counted(const std::map<std::string, int>& counts) {
  std::string list;
  for (const auto& [name, count] : counts)
    list += fmt::format("{}<{}>{}", list.empty() ? "" : ", ", name,
                        count > 1 ? fmt::format(" ({})", count) : "");
  return list;
}

}  // namespace

Switches read_options(Document& document, MjcfModel& model) {
  Switches switches;
  document.each(document.sections("option"), [&](const Element& e) {
    document.expect(e, {"timestep",
                        "apirate",
                        "impratio",
                        "gravity",
                        "wind",
                        "magnetic",
                        "density",
                        "viscosity",
                        "o_margin",
                        "o_solref",
                        "o_solimp",
                        "o_friction",
                        "integrator",
                        "collision",
                        "cone",
                        "jacobian",
                        "solver",
                        "iterations",
                        "tolerance",
                        "ls_iterations",
                        "ls_tolerance",
                        "noslip_iterations",
                        "noslip_tolerance",
                        "mpr_iterations",
                        "mpr_tolerance",
                        "ccd_iterations",
                        "ccd_tolerance",
                        "sdf_iterations",
                        "sdf_initpoints",
                        "sleep_tolerance",
                        "actuatorgroupdisable"});
    const Values v(document, e);
    model.gravity = v.vector("gravity", model.gravity);
    model.time_step = v.number("timestep", model.time_step);
    if (!(model.time_step > 0.0)) document.fail(e, "timestep: a positive number is expected");
    read_air_options(document, v, model);
    const std::string collision = v.word("collision", {"all", "predefined", "dynamic"}, "all");
    switches.pairs_only = collision == "predefined";
    switches.no_pairs = collision == "dynamic";
    switches.elliptic = v.word("cone", {"pyramidal", "elliptic"},
                               switches.elliptic ? "elliptic" : "pyramidal") == "elliptic";
    switches.impratio = v.number("impratio", switches.impratio);
    for (const int group : v.integers("actuatorgroupdisable", 0, 31))
      switches.groups_off.insert(group);
    std::string others;
    for (const char* name :
         {"integrator", "cone", "impratio", "solver", "jacobian", "iterations", "tolerance",
          "noslip_iterations", "o_solref", "o_solimp", "o_friction"})
      if (v.has(name)) others += (others.empty() ? "" : ", ") + std::string(name);
    if (!others.empty())
      document.note(
          e, fmt::format("{}: of MuJoCo's own method; here steps are as the scene says", others));
    for (const Element* flag : document.children(e))
      if (std::strcmp(flag->Name(), "flag") == 0) read_flags(document, *flag, model, switches);
  });
  return switches;
}

void switch_off(const Switches& switches, MjcfModel& model) {
  const auto off = [&](const char* word) { return switches.off.count(word) > 0; };
  for (JointSpec& joint : model.robot.joints) {
    if (switches.constraint_off("limit")) {
      joint.lower = -kInfinity;
      joint.upper = kInfinity;
    }
    if (switches.constraint_off("frictionloss")) joint.dry_friction = 0.0;
    if (off("spring")) joint.stiffness = 0.0;
    if (off("damper")) joint.damping = 0.0;
  }
  for (TendonSpec& tendon : model.tendons) {
    if (switches.constraint_off("limit")) {
      tendon.lower = -kInfinity;
      tendon.upper = kInfinity;
    }
    if (switches.constraint_off("frictionloss")) tendon.dry_friction = 0.0;
    if (off("spring")) tendon.stiffness = 0.0;
    if (off("damper")) tendon.damping = 0.0;
  }
  for (MjcfModel::Actuator& a : model.actuators)
    if (off("clampctrl")) a.least = a.most = std::nullopt;
  for (ActuatorSpec& spec : model.commanded)
    if (off("clampctrl") && spec.actuator.law != ActuatorLaw::kMuscle) {
      spec.actuator.least_command = -kInfinity;
      spec.actuator.most_command = kInfinity;
    }
  if (!off("spring") || !off("damper")) return;
  // With springs and dampers off MuJoCo has no passive forces (XML Reference, "flag/spring").
  for (LinkSpec& link : model.robot.links) {
    link.gravity_compensation = 0.0;
    link.drag = {};
  }
}

namespace {

/// Places the numbers of one model's keyframe among those of all models.
struct KeyReader {
  Document& document;
  const Element& element;
  const int model = document.model_of(element);

  bool owns(const Element& other) const {
    return document.is_within(document.model_of(other), model);
  }

  /// Whether the keyframe has as many numbers as its model. A model that is attached in part has
  /// fewer coordinates than its keyframe has numbers.
  bool fits(const char* name, const std::vector<std::pair<std::size_t, bool>>& sizes) const {
    const std::size_t given = Values(document, element).numbers(name, 0, 1'000'000).size();
    std::size_t count = 0;
    for (const auto& [size, mine] : sizes) count += mine ? size : 0;
    if (given == 0 || given == count) return true;
    if (model == 0)
      document.fail(element, fmt::format("{}: {} numbers; the model has {}", name, given, count));
    document.note(element, fmt::format("{}: {} numbers; what is attached has {}: left out", name,
                                       given, count));
    return false;
  }

  /// `sizes`: for each part its count of numbers, and whether it belongs to this model;
  /// `otherwise`: values for all parts, used for the other models' ones.
  std::vector<double> read(const char* name, const std::vector<std::pair<std::size_t, bool>>& sizes,
                           std::vector<double> otherwise) const {
    const std::vector<double> given = Values(document, element).numbers(name, 0, 1'000'000);
    if (given.empty()) return given;
    std::size_t at = 0, to = 0;
    for (const auto& [size, mine] : sizes) {
      for (std::size_t i = 0; mine && i < size; ++i) otherwise[to + i] = given[at++];
      to += size;
    }
    return otherwise;
  }
};

}  // namespace

void read_keyframes(Document& document, const Bodies& bodies, MjcfModel& model) {
  const std::vector<const Element*> actuators = document.section_children("actuator");
  document.each(document.section_children("keyframe"), [&](const Element& e) {
    document.expect(e, {"name", "time", "qpos", "qvel", "act", "ctrl", "mpos", "mquat"});
    const KeyReader reader{document, e};
    std::vector<std::pair<std::size_t, bool>> q, v, u, positions, rotations;
    std::vector<double> reference, mocap_positions, mocap_rotations;
    std::size_t nv = 0;
    for (std::size_t i = 0; i < model.coordinates.size(); ++i) {
      const MjcfModel::Coordinate& c = model.coordinates[i];
      const bool mine = reader.owns(*bodies.joints[i].element);
      q.emplace_back(joint_nq(c.type), mine);
      v.emplace_back(joint_nv(c.type), mine);
      nv += v.back().first;
      reference.insert(reference.end(), c.reference.begin(), c.reference.end());
    }
    auto mocap = model.mocaps.begin();
    for (const BodyNode& body : bodies.bodies) {
      if (!body.mocap) continue;
      const std::vector<double>& pose = (mocap++)->reference;
      const bool mine = reader.owns(*body.element);
      positions.emplace_back(3, mine);
      rotations.emplace_back(4, mine);
      mocap_positions.insert(mocap_positions.end(), pose.begin(), pose.begin() + 3);
      mocap_rotations.insert(mocap_rotations.end(), pose.begin() + 3, pose.end());
    }
    for (const Element* actuator : actuators) u.emplace_back(1, reader.owns(*actuator));
    if (!reader.fits("qpos", q) || !reader.fits("qvel", v) || !reader.fits("ctrl", u)) return;
    const bool held = document.options().leave_out.count(LeaveOut::kMocap) > 0;
    if (!held && (!reader.fits("mpos", positions) || !reader.fits("mquat", rotations))) return;
    MjcfModel::Keyframe key;
    key.name = Values(document, e).text("name", fmt::format("key{}", model.keyframes.size()));
    key.where = document.where(e);
    key.q = reader.read("qpos", q, reference);
    key.v = reader.read("qvel", v, std::vector<double>(nv));
    key.control = reader.read("ctrl", u, std::vector<double>(u.size()));
    if (!held) key.mocap_position = reader.read("mpos", positions, mocap_positions);
    if (!held) key.mocap_rotation = reader.read("mquat", rotations, mocap_rotations);
    model.keyframes.push_back(key);
  });
}

void check_sections(Document& document) {
  static const std::set<std::string> kRead = {"compiler", "option",    "size",     "asset",
                                              "default",  "worldbody", "contact",  "equality",
                                              "tendon",   "actuator",  "keyframe", "sensor"};
  static const std::set<std::string> kPassed = {"visual", "statistic", "custom", "extension"};
  std::map<std::string, int> passed;
  for (const Element* e : document.children(document.root())) {
    if (kRead.count(e->Name()) > 0) continue;
    if (kPassed.count(e->Name()) > 0) {
      ++passed[e->Name()];
      continue;
    }
    if (std::strcmp(e->Name(), "deformable") == 0 && document.children(*e).empty()) continue;
    document.faults.collect([&] { document.fail(*e, "this section is not supported; remove it"); });
  }
  if (!passed.empty())
    document.notes.push_back(
        {document.file().string(),
         fmt::format("passed over, without effect on the motion: {}", counted(passed))});
  document.notes.push_back(
      {document.file().string(),
       "margin and gap are not used, nor are solref and solimp, but for a negative solref of "
       "contacts: contacts, limits and equalities are as stiff as the scene's contact says "
       "(contact: fast is about as soft as MuJoCo's defaults)"});
}

}  // namespace counterpoint::mjcf
