#include "counterpoint/model/robot_files.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstring>

#include "counterpoint/model/mjcf/bodies/contacts.h"
#include "counterpoint/model/mjcf/forces/actuators.h"
#include "counterpoint/model/mjcf/options.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

constexpr std::pair<LeaveOut, const char*> kLeaveOut[] = {{LeaveOut::kFluid, "fluid"},
                                                          {LeaveOut::kTendons, "tendons"},
                                                          {LeaveOut::kActuators, "actuators"},
                                                          {LeaveOut::kJointForces, "joint_forces"},
                                                          {LeaveOut::kEqualities, "equalities"}};

}  // namespace

const char* leave_out_name(LeaveOut what) {
  for (const auto& [one, name] : kLeaveOut)
    if (one == what) return name;
  return "?";
}

std::optional<LeaveOut> leave_out_from_name(const std::string& name) {
  for (const auto& [one, known] : kLeaveOut)
    if (name == known) return one;
  return std::nullopt;
}

bool is_mjcf(const std::filesystem::path& file) { return root_element_name(file) == "mujoco"; }

MjcfModel load_mjcf(const std::filesystem::path& file, const MjcfOptions& options) {
  mjcf::Document document(file, options);
  const mjcf::Compiler compiler = mjcf::read_compiler(document);
  const mjcf::Defaults defaults(document);
  MjcfModel model;
  model.robot.name = mjcf::Values(document, document.root()).text("model", file.stem().string());
  model.robot.where = file.string();
  mjcf::check_sections(document);
  mjcf::read_options(document, model);
  mjcf::Assets assets(document, compiler, defaults);
  const mjcf::Bodies bodies = mjcf::read_bodies(document, defaults, compiler, model);
  mjcf::read_inertias(document, compiler, assets, bodies, model);
  mjcf::read_air(document, bodies, model);
  const mjcf::Tendons tendons = mjcf::read_tendons(document, bodies);
  mjcf::Couplings couplings(model.robot);
  mjcf::read_equalities(document, defaults, bodies, tendons, couplings, model);
  mjcf::apply_tendon_forces(document, defaults, compiler, tendons, couplings, model);
  mjcf::read_actuators(document, defaults, compiler, bodies, tendons, couplings, model);
  mjcf::read_keyframes(document, model);
  mjcf::read_contacts(document, defaults, assets, bodies, model);
  model.robot.notes = document.notes;
  return model;
}

}  // namespace counterpoint
