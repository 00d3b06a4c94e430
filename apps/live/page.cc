#include "live/page.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "view/replay.h"
#include "view/view_option.h"

namespace counterpoint::live {
namespace {

using Json = nlohmann::ordered_json;

/// Range of a target without limits: +- this many turns, or metres.
constexpr double kSliderRange = 1.0;

/// Whether a joint has a slider for the force of its motor.
bool has_motor(const Model& model, int joint) {
  const JointInfo& info = model.joint(joint);
  return joint_nv(model.body(joint + 1).joint_type) == 1 && info.actuated && !info.prescribed;
}

}  // namespace

std::string controls_of(const Model& model) {
  Json sliders = Json::array();
  for (size_t i = 0; i < model.servos().size(); ++i) {
    const JointServo& servo = model.servos()[i];
    const JointInfo& joint = model.joint(servo.joint);
    const bool slides = model.body(servo.joint + 1).joint_type == JointType::kPrismatic;
    const double range = kSliderRange * (slides ? 1.0 : 2.0 * std::numbers::pi);
    sliders.push_back({{"do", "target"},
                       {"index", i},
                       {"name", joint.name},
                       {"unit", view::joint_units(model.body(servo.joint + 1).joint_type).q},
                       {"lower", std::max(joint.lower, -range)},
                       {"upper", std::min(joint.upper, range)},
                       {"value", servo.position}});
  }
  for (int j = 0; j < model.num_joints(); ++j) {
    const Body& body = model.body(j + 1);
    const JointInfo& joint = model.joint(j);
    if (!has_motor(model, j)) continue;
    const bool slides = body.joint_type == JointType::kPrismatic;
    double mass = 0.0;
    for (int b = j + 1; b < body.subtree_end; ++b) mass += model.body(b).inertia.mass;
    const double load = mass * kStandardGravity * (slides ? 1.0 : 0.5);
    const double most = std::isfinite(joint.effort_limit) ? joint.effort_limit : load;
    sliders.push_back({{"do", "force"},
                       {"index", body.v_index},
                       {"name", joint.name},
                       {"unit", view::joint_units(body.joint_type).force},
                       {"lower", -most},
                       {"upper", most},
                       {"value", 0.0}});
  }
  Json choices = {{"integrator", Json::array()},
                  {"contact", {"fast", "default", "hard"}},
                  {"contact.friction_model", {"convex", "lagged", "coulomb"}}};
  for (const Integrator one :
       {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint, Integrator::kRungeKutta4})
    choices["integrator"].push_back(integrator_name(one));
  Json effects = Json::array();
  for (int i = 0; i < kNumEffects; ++i) effects.push_back(effect_name(static_cast<Effect>(i)));
  return Json{{"sliders", sliders}, {"choices", choices}, {"effects", effects}}.dump();
}

std::vector<double> slider_values(const Model& model, const VectorX& targets,
                                  const VectorX& forces) {
  std::vector<double> out(targets.begin(), targets.end());
  for (int j = 0; j < model.num_joints(); ++j)
    if (has_motor(model, j)) out.push_back(forces[model.body(j + 1).v_index]);
  return out;
}

std::string watching_controls() {
  return Json{{"watch", true},
              {"sliders", Json::array()},
              {"choices", Json::object()},
              {"effects", Json::array()}}
      .dump();
}

std::string live_page(const PageSource& source, Picture& picture, const std::string& controls,
                      const std::string& sources) {
  const Scene& scene = source.scene;
  view::Clip clip;
  clip.name = scene.name;
  clip.states = {source.state};
  clip.rows = 1;
  view::Replay replay =
      view::make_replay(scene, {source.file, {}, source.packages}, std::move(clip), {});
  replay.curves = picture.curves(source.state);
  replay.controls = controls;
  replay.connect_to = sources;
  return view::replay_page(replay);
}

}  // namespace counterpoint::live
