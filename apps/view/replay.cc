#include "view/replay.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "counterpoint/model/spatial.h"
#include "report/chart.h"
#include "view/packed_scene.h"
#include "view/packing.h"
#include "view/program.h"

namespace counterpoint::view {
namespace {

/// Escapes '<' so that the JSON cannot end its <script> element. It occurs in strings only.
std::string without_markup(const std::string& json) {
  std::string out;
  out.reserve(json.size());
  for (const char c : json) {
    if (c == '<')
      out += "\\u003c";
    else
      out += c;
  }
  return out;
}

/// Smallest drawn radius of a body [m]; infinity if no body has one.
double smallest_radius(const Model& model) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const double radius : drawn_radii(model))
    if (radius > 0.0) smallest = std::min(smallest, radius);
  return smallest;
}

/// Median of the drawn radii [m]; `without_bodies` if there are none.
double typical_radius(const Model& model, double without_bodies) {
  std::vector<double> radii = drawn_radii(model);
  radii.erase(radii.begin());  // the world
  std::erase(radii, 0.0);
  if (radii.empty()) return without_bodies;
  std::nth_element(radii.begin(), radii.begin() + radii.size() / 2, radii.end());
  return radii[radii.size() / 2];
}

double farthest(const Model& model, const Clip& clip) {
  double most = 0.0;
  for (const State& state : clip.states)
    for (const Pose& X : body_poses(model, state.q))
      most = std::max(most, X.translation.cwiseAbs().maxCoeff());
  return most;
}

Json pack_inputs(const std::vector<InputFile>& inputs) {
  Json out = Json::array();
  for (const InputFile& input : inputs)
    out.push_back(
        {{"name", input.name}, {"bytes", input.bytes.size()}, {"data", pack(input.bytes)}});
  return out;
}

void pack_forces(const Model& model, const Clip& clip, const Resolution& resolution, Json& out) {
  if (!clip.contacts.empty()) out["contacts"] = pack_contacts(model, clip, resolution);
  if (!clip.closure_forces.empty())
    out["closure_forces"] = pack_closure_forces(model, clip, resolution);
}

}  // namespace

Resolution resolution_of(const Replay& replay) {
  return resolution_of(replay.scene->model, replay.clip);
}

Resolution resolution_of(const Model& model, const Clip& clip) {
  Resolution out;
  const double size = bounds(model, clip).radius;
  out.position = std::min(std::ldexp(size, -16), 1e-3 * smallest_radius(model));
  // Integers stay within 2^40, well inside the range that the page's doubles hold exactly.
  out.position = std::max(out.position, std::ldexp(farthest(model, clip), -40));
  double force = 0.0;
  for (const Contact& contact : clip.contacts) force = std::max(force, contact.force.norm());
  for (const ClosureArrow& closure : clip.closure_forces)
    force = std::max(force, closure.force.norm());
  out.force = force > 0.0 ? std::ldexp(force, -16) : 1.0;
  return out;
}

std::string replay_data(const Replay& replay) {
  const Model& model = replay.scene->model;
  if (replay.clip.states.empty()) throw InputError("the motion is empty");
  const Resolution resolution = resolution_of(replay);
  const Ball ball = bounds(model, replay.clip);
  Json out;
  out["format"] = 1;
  out["title"] = replay.title;
  out["made"] = replay.made;
  out["center"] = {ball.center.x(), ball.center.y(), ball.center.z()};
  out["radius"] = ball.radius;
  out["body_radius"] = typical_radius(model, ball.radius);
  pack_model(model, replay.visuals, out);
  out["motions"] = {pack_clip(model, replay.clip, resolution)};
  for (const Clip& ghost : replay.ghosts)
    out["motions"].push_back(pack_clip(model, ghost, resolution));
  pack_forces(model, replay.clip, resolution, out);
  std::vector<Curve> curves = replay.curves;
  if (!replay.controls.empty()) {
    out["live"] = Json::parse(replay.controls);
  } else {
    for (Curve& curve : curves_of(model, replay.clip, replay.ghosts))
      curves.push_back(std::move(curve));
  }
  out["curves"] = pack_curves(curves);
  out["shown_curves"] = first_groups(curves);
  out["inputs"] = pack_inputs(replay.inputs);
  return without_markup(out.dump(-1, ' ', false, Json::error_handler_t::replace));
}

Json motion_data(const Scene& scene, const Clip& clip) {
  const Resolution resolution = resolution_of(scene.model, clip);
  Json out = {{"motion", pack_clip(scene.model, clip, resolution)}};
  pack_forces(scene.model, clip, resolution, out);
  const std::vector<Curve> curves = curves_of(scene.model, clip, {});
  out["curves"] = pack_curves(curves);
  out["shown_curves"] = first_groups(curves);
  return out;
}

bool can_make_pages() { return *program() != '\0'; }

std::string why_no_pages() {
  return fmt::format("this build has no replay page: {}", program_missing());
}

std::string replay_page(const Replay& replay) {
  if (!can_make_pages()) throw InputError(why_no_pages());
  const std::string title = apps::escape_markup(replay.title);
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src "
         "'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:" +
         (replay.connect_to.empty() ? "" : "; connect-src " + replay.connect_to) +
         "\">\n"
         "<link rel=\"icon\" href=\"data:,\">\n<title>" +
         title + "</title>\n</head>\n<body>\n<noscript>This replay needs JavaScript.</noscript>\n" +
         "<script type=\"application/json\" id=\"replay-data\">" + replay_data(replay) +
         "</script>\n<script>" + program() + "</script>\n</body>\n</html>\n";
}

void write_whole(const std::filesystem::path& file, const std::string& bytes) {
  const std::string wrong = fmt::format(
      "{}: cannot be written; expected a path in an existing, writable folder", file.string());
  std::error_code error;
  // A device or pipe is written directly, since it cannot be replaced by a file.
  const bool whole =
      !std::filesystem::exists(file, error) || std::filesystem::is_regular_file(file);
  const std::filesystem::path part =
      whole ? file.string() + fmt::format(".{}.part", getpid()) : file.string();
  {
    std::ofstream stream(part, std::ios::binary | std::ios::trunc);
    stream << bytes << std::flush;
    if (!stream) {
      if (whole) std::filesystem::remove(part, error);
      throw InputError(wrong);
    }
  }
  if (!whole) return;
  std::filesystem::rename(part, file, error);
  if (error) {
    std::filesystem::remove(part, error);
    throw InputError(wrong);
  }
}

}  // namespace counterpoint::view
