#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstring>

#include "counterpoint/model/mjcf/bodies/contacts.h"
#include "counterpoint/model/mjcf/forces/actuators.h"
#include "counterpoint/model/mjcf/forces/damping_ratio.h"
#include "counterpoint/model/mjcf/options.h"
#include "counterpoint/model/mjcf/sensors.h"
#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

bool is_mjcf(const std::filesystem::path& file) { return root_element_name(file) == "mujoco"; }

MjcfModel load_mjcf(const std::filesystem::path& file, const MjcfOptions& options) {
  mjcf::Document document(file, options);
  const mjcf::Defaults defaults(document);
  MjcfModel model;
  model.robot.name = mjcf::Values(document, document.root()).text("model", file.stem().string());
  model.robot.where = file.string();
  mjcf::check_sections(document);
  const mjcf::Switches switches = mjcf::read_options(document, model);
  mjcf::Assets assets(document, defaults);
  const mjcf::Bodies bodies = mjcf::read_bodies(document, defaults, model);
  // Later sections refer to the names of bodies, some of which may now be missing.
  if (document.faults.broken()) document.faults.throw_if_any();
  mjcf::read_inertias(document, assets, bodies, model);
  mjcf::read_air(document, bodies, model);
  mjcf::apply_spring_dampers(bodies, model);
  const mjcf::Tendons tendons = mjcf::read_tendons(document, bodies, model);
  mjcf::Couplings couplings(model.robot);
  if (!switches.constraint_off("equality"))
    mjcf::read_equalities(document, defaults, bodies, tendons, couplings, model);
  mjcf::apply_tendon_forces(document, defaults, tendons, couplings, model);
  mjcf::read_actuators(document, defaults, switches, bodies, tendons, couplings, model);
  mjcf::read_keyframes(document, bodies, model);
  mjcf::read_sensors(document, defaults, bodies, model);
  mjcf::read_contacts(document, defaults, assets, bodies, switches, model);
  if (document.faults.any())
    document.faults.collect([&] { ModelBuilder().add_robot(model.robot, Base::kFixed, Pose()); });
  document.faults.throw_if_any();
  mjcf::switch_off(switches, model);
  model.robot.notes = document.notes;
  return model;
}

}  // namespace counterpoint
