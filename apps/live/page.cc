#include "live/page.h"

#include <nlohmann/json.hpp>

#include "view/replay.h"
#include "view/view_option.h"

namespace counterpoint::live {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

std::string controls_of(const std::vector<Slider>& sliders) {
  Json list = Json::array();
  for (const Slider& one : sliders)
    list.push_back({{"do", one.force ? "force" : "input"},
                    {"index", one.index},
                    {"group", one.group},
                    {"name", one.name},
                    {"unit", one.unit},
                    {"lower", one.lower},
                    {"upper", one.upper},
                    {"switch", one.closure >= 0},
                    {"value", one.value}});
  Json choices = {{"integrator", Json::array()},
                  {"contact", {"fast", "default", "hard"}},
                  {"contact.friction_model", {"convex", "lagged", "coulomb"}}};
  for (const Integrator one :
       {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint, Integrator::kRungeKutta4})
    choices["integrator"].push_back(integrator_name(one));
  Json effects = Json::array();
  for (int i = 0; i < kNumEffects; ++i) effects.push_back(effect_name(static_cast<Effect>(i)));
  return Json{{"sliders", list}, {"choices", choices}, {"effects", effects}}.dump();
}

std::string watching_controls() {
  return Json{{"watch", true},
              {"sliders", Json::array()},
              {"choices", Json::object()},
              {"effects", Json::array()}}
      .dump();
}

std::string live_page(const PageSource& source, std::vector<view::Curve> curves,
                      const std::string& controls, const std::string& sources) {
  const Scene& scene = source.scene;
  view::Clip clip;
  clip.name = scene.name;
  clip.states = {source.state};
  clip.rows = 1;
  view::Replay replay =
      view::make_replay(scene, {source.file, {}, source.packages}, std::move(clip), {});
  replay.curves = std::move(curves);
  replay.controls = controls;
  replay.connect_to = sources;
  return view::replay_page(replay);
}

}  // namespace counterpoint::live
