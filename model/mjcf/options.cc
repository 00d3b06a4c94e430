#include "counterpoint/model/mjcf/options.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstring>

namespace counterpoint::mjcf {
namespace {

void read_flags(Document& document, const Element& e, MjcfModel& model) {
  // What changes how MuJoCo computes, but not what.
  static const std::set<std::string> kHarmless = {
      "eulerdamp", "warmstart", "refsafe",   "sensor", "midphase",    "nativeccd",
      "multiccd",  "island",    "energy",    "fwdinv", "invdiscrete", "override",
      "autoreset", "sleep",     "clampctrl", "spring", "damper",      "adaptivegap"};
  const Values v(document, e);
  for (const auto* a = e.FirstAttribute(); a; a = a->Next()) {
    const std::string name = a->Name(), value = a->Value();
    if (name == "gravity") {
      if (value == "disable") model.gravity.setZero();
      continue;
    }
    const bool passive = name == "spring" || name == "damper" || name == "clampctrl";
    if (kHarmless.count(name) > 0 && !(passive && value == "disable")) continue;
    if (value == "disable")
      document.fail(
          e,
          fmt::format("{}=\"disable\" is not supported; a scene may switch it off: effects", name));
  }
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

void read_options(Document& document, MjcfModel& model) {
  for (const Element* e : document.sections("option")) {
    const Values v(document, *e);
    model.gravity = v.vector("gravity", model.gravity);
    model.time_step = v.number("timestep", model.time_step);
    if (!(model.time_step > 0.0)) document.fail(*e, "timestep: a positive number is expected");
    read_air_options(document, v, model);
    std::string others;
    for (const char* name :
         {"integrator", "cone", "impratio", "solver", "jacobian", "iterations", "tolerance",
          "noslip_iterations", "o_solref", "o_solimp", "o_friction"})
      if (v.has(name)) others += (others.empty() ? "" : ", ") + std::string(name);
    if (!others.empty())
      document.note(
          *e, fmt::format("{}: of MuJoCo's own method; here steps are as the scene says", others));
    for (const Element* flag : document.children(*e))
      if (std::strcmp(flag->Name(), "flag") == 0) read_flags(document, *flag, model);
  }
}

void read_keyframes(Document& document, MjcfModel& model) {
  std::size_t nq = 0, nv = 0;
  for (const MjcfModel::Coordinate& c : model.coordinates) {
    nq += joint_nq(c.type);
    nv += joint_nv(c.type);
  }
  const std::size_t nu = model.actuators.size();
  for (const Element* e : document.section_children("keyframe")) {
    document.expect(*e, {"name", "time", "qpos", "qvel", "act", "ctrl", "mpos", "mquat"});
    const Values v(document, *e);
    MjcfModel::Keyframe key;
    key.name = v.text("name", fmt::format("key{}", model.keyframes.size()));
    key.where = document.where(*e);
    const auto read = [&](const char* name, std::size_t count) {
      const std::vector<double> given = v.numbers(name, 0, 1'000'000);
      if (given.empty() || given.size() == count) return given;
      document.fail(*e, fmt::format("{}: {} numbers; the model has {}", name, given.size(), count));
    };
    key.q = read("qpos", nq);
    key.v = read("qvel", nv);
    key.control = read("ctrl", nu);
    model.keyframes.push_back(key);
  }
}

void check_sections(Document& document) {
  static const std::set<std::string> kRead = {"compiler", "option",    "size",    "asset",
                                              "default",  "worldbody", "contact", "equality",
                                              "tendon",   "actuator",  "keyframe"};
  static const std::set<std::string> kPassed = {"visual", "statistic", "sensor", "custom",
                                                "extension"};
  std::map<std::string, int> passed;
  for (const Element* e : document.children(document.root())) {
    if (kRead.count(e->Name()) > 0) continue;
    if (kPassed.count(e->Name()) > 0) {
      ++passed[e->Name()];
      continue;
    }
    if (std::strcmp(e->Name(), "deformable") == 0 && document.children(*e).empty()) continue;
    document.fail(*e, "this section is not supported; remove it");
  }
  if (!passed.empty())
    document.notes.push_back(
        {document.file().string(),
         fmt::format("passed over, without effect on the motion: {}", counted(passed))});
  document.notes.push_back(
      {document.file().string(),
       "solref, solimp, margin and gap are not used: contacts, limits and equalities are as stiff "
       "as the "
       "scene's contact says (contact: fast is about as soft as MuJoCo's defaults)"});
}

}  // namespace counterpoint::mjcf
