// The status that a live session sends to its pages ten times a second.
#include <algorithm>

#include "counterpoint/engine/clocks.h"
#include "live/page.h"
#include "live/session.h"
#include "view/input_files.h"

namespace counterpoint::live {

Session::Json Session::settings() const {
  const SimulationOptions& options = simulator_.options();
  const EffectCounts& counts = simulator_.effect_counts();
  Json effects;
  for (int i = 0; i < kNumEffects; ++i) {
    const auto effect = static_cast<Effect>(i);
    effects[effect_name(effect)] = {{"on", options.effects.has(effect)},
                                    {"used", counts[effect] > counted_[effect]}};
  }
  std::string preset;
  for (const ContactPreset one :
       {ContactPreset::kFast, ContactPreset::kDefault, ContactPreset::kHard}) {
    ContactOptions with = options.contact;
    apply_contact_preset(one, with);
    if (with == options.contact) preset = contact_preset_name(one);
  }
  return {{"time_step", options.time_step},
          {"integrator", integrator_name(options.integrator)},
          {"contact", preset},
          {"contact.friction_model", friction_model_name(options.contact.friction_model)},
          {"contact.compliance", options.contact.compliance},
          {"contact.smoothing", options.contact.smoothing},
          {"effects", effects}};
}

Session::Json Session::status() {
  const Model& model = simulator_.model();
  const double steps = static_cast<double>(std::max(last_pace_.steps, 1L));
  const double us = 1e6 / steps;
  const PhaseTimes& phases = last_pace_.phases;
  const double rest =
      phases.step - phases.contacts - phases.dynamics - phases.constraints - phases.overlaps;
  Json out = {{"type", "status"},
              {"time", simulator_.state().time},
              {"playing", playing_},
              {"speed", speed_},
              {"real_time", last_pace_.since > 0.0 ? last_pace_.simulated / last_pace_.since : 0.0},
              {"clients", clients_.size()},
              {"history", {{"start", history_.start()}, {"end", history_.end()}}}};
  out["saved"] = Json::array();
  for (const State& state : saved_) out["saved"].push_back(state.time);
  out["recording"] = {{"can", takes_.possible()},
                      {"on", takes_.running()},
                      {"file", takes_.file().string()},
                      {"steps", takes_.steps()}};
  out["step_us"] = us * phases.step;
  out["phases_us"] = {{"contacts", us * phases.contacts},
                      {"dynamics", us * phases.dynamics},
                      {"constraints", us * phases.constraints},
                      {"overlaps", us * phases.overlaps},
                      {"rest", us * std::max(rest, 0.0)}};
  out["frame_us"] =
      1e6 * last_pace_.frame_seconds / static_cast<double>(std::max(last_pace_.frames, 1L));
  out["newton"] = static_cast<double>(last_pace_.newton_iterations) / steps;
  out["contacts"] = static_cast<double>(last_pace_.contacts) / steps;
  out["rows"] = static_cast<double>(last_pace_.rows) / steps;
  out["softened"] = softened_;
  out["unfinished"] = unfinished_;
  out["energy_J"] = picture_.energy();
  out["overlap_m"] = report_.max_penetration;
  out["hand"] = nullptr;
  if (hand_.body() != 0)
    out["hand"] = {{"body", model.joint(hand_.body() - 1).link},
                   {hand_.turns() ? "torque_Nm" : "force_N", hand_.force().norm()}};
  out["settings"] = settings();
  out["sliders"] = wanted_.values(simulator_.state().z);
  out["ghost"] = {{"on", ghost_ != nullptr}};
  if (ghost_)
    out["ghost"].update({{"time_step", simulator_.options().time_step / kFinerSteps},
                         {"behind", ghost_->behind()},
                         {"distance_m", ghost_->distance()},
                         {"ended", ghost_->ended()}});
  out["command"] = takes_.running() ? takes_.command() : command();
  out["fault"] = fault_;
  return out;
}

void Session::send_status() {
  const double now = wall_seconds();
  if (const double age = now - pace_.since; age >= kStatusInterval && pace_.steps > 0) {
    last_pace_ = pace_;
    last_pace_.since = age;
    pace_ = {};
    pace_.since = now;
  }
  Json all = status();
  if (last_pace_.steps > 0) counted_ = simulator_.effect_counts();
  for (const long client : clients_) {
    all["driver"] = client == clients_.front();
    server_->send(client, all.dump(-1, ' ', false, Json::error_handler_t::replace));
  }
}

/// The command line that runs the scene with the present options.
std::string Session::command() const {
  std::string out = "counterpoint simulate";
  for (const std::string& word : options_.scene_words) out += " " + view::shell_word(word);
  if (first_options_.step_control) out += " --adaptive off";
  for (const auto& [key, value] : changes_)
    out += " --option " + view::shell_word(key + "=" + value);
  return out;
}

}  // namespace counterpoint::live
