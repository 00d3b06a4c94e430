// Packs clips, contacts and curves as streams of integers.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <tuple>

#include "view/packed_scene.h"
#include "view/packing.h"

namespace counterpoint::view {
namespace {

/// Largest distance from the origin that a replay shows along each axis [m], which is the limit for
/// scenes.
constexpr double kFarthest = 1e9;

std::int64_t whole(double value, double unit) {
  return static_cast<std::int64_t>(std::llround(value / unit));
}

void check_pose(const Model& model, int body, const Pose& X, double time) {
  if (X.translation.allFinite() && X.rotation.allFinite() &&
      X.translation.cwiseAbs().maxCoeff() <= kFarthest)
    return;
  throw InputError(fmt::format(
      "'{}' is at [{:.6g}, {:.6g}, {:.6g}] m at {:.6g} s; a replay shows up to {:.0e} m",
      model.joint(body - 1).link, X.translation.x(), X.translation.y(), X.translation.z(), time,
      kFarthest));
}

/// Packs the poses by body, coordinate (x y z qw qx qy qz) and frame.
std::string pack_poses(const Model& model, const Clip& clip, const Resolution& resolution) {
  const int bodies = model.num_bodies(), frames = clip.num_frames();
  std::vector<std::vector<std::int64_t>> values(7 * bodies, std::vector<std::int64_t>(frames));
  std::vector<Quaternion> last(bodies, Quaternion::Identity());
  for (int k = 0; k < frames; ++k) {
    const std::vector<Pose> poses = body_poses(model, clip.states[k].q);
    for (int b = 1; b < bodies; ++b) {
      check_pose(model, b, poses[b], clip.states[k].time);
      for (int i = 0; i < 3; ++i)
        values[7 * b + i][k] = whole(poses[b].translation[i], resolution.position);
      // q and -q are the same rotation: take the one nearer to the last, since the page
      // interpolates linearly.
      Quaternion q(poses[b].rotation);
      if (q.dot(last[b]) < 0.0) q.coeffs() = -q.coeffs();
      last[b] = q;
      const double components[] = {q.w(), q.x(), q.y(), q.z()};
      for (int i = 0; i < 4; ++i)
        values[7 * b + 3 + i][k] = whole(components[i], resolution.quaternion);
    }
  }
  IntegerStream stream;
  for (int i = 7; i < 7 * bodies; ++i) stream.add_smooth(values[i]);
  return stream.packed();
}

std::string pack_asleep(const Clip& clip, int trees) {
  IntegerStream stream;
  std::vector<std::int64_t> flags(clip.num_frames());
  for (int tree = 0; tree < trees; ++tree) {
    for (int k = 0; k < clip.num_frames(); ++k) flags[k] = clip.asleep[k][tree] != 0 ? 1 : 0;
    stream.add_steps(flags);
  }
  return stream.packed();
}

/// Packs for each body and frame whether the joint to its parent is at a limit.
std::string pack_limits(const Model& model, const Clip& clip) {
  IntegerStream stream;
  std::vector<std::int64_t> flags(clip.num_frames(), 0);
  stream.add_steps(flags);  // the world
  for (int b = 1; b < model.num_bodies(); ++b) {
    for (int k = 0; k < clip.num_frames(); ++k) flags[k] = is_at_limit(model, b, clip.states[k].q);
    stream.add_steps(flags);
  }
  return stream.packed();
}

/// A force at a point between two shapes, or the force of a closure.
struct Arrow {
  int frame, a, b;
  Vector3 position, force;
};

/// The arrows of one contact over consecutive frames.
struct Track {
  int a = 0, b = 0, start = 0;
  std::vector<const Arrow*> arrows;
};

/// Joins the arrows above `least` [N] into tracks. Several arrows of one pair in a frame are
/// matched by their order, which the engine keeps from step to step.
std::vector<Track> tracks_of(const std::vector<Arrow>& arrows, double least) {
  std::vector<Track> tracks;
  std::map<std::tuple<int, int, int>, size_t> open;
  std::map<std::tuple<int, int>, int> count;
  int frame = -1;
  for (const Arrow& arrow : arrows) {
    if (!(arrow.force.norm() > least)) continue;
    if (arrow.frame != frame) count.clear();
    frame = arrow.frame;
    const int number = count[{arrow.a, arrow.b}]++;
    const std::tuple key{arrow.a, arrow.b, number};
    const auto found = open.find(key);
    if (found == open.end() ||
        tracks[found->second].start + static_cast<int>(tracks[found->second].arrows.size()) !=
            frame) {
      open[key] = tracks.size();
      tracks.push_back({arrow.a, arrow.b, frame, {}});
    }
    tracks[open[key]].arrows.push_back(&arrow);
  }
  return tracks;
}

/// names(a, b): names of the two shapes, or of the closure.
Json pack_arrows(const std::vector<Arrow>& arrows, const Resolution& resolution,
                 const std::function<Json(int a, int b)>& names) {
  const std::vector<Track> tracks = tracks_of(arrows, resolution.force);
  std::map<std::pair<int, int>, int> pairs;
  Json pair_names = Json::array();
  IntegerStream stream;
  for (const Track& track : tracks) {
    const auto [pair, is_new] =
        pairs.try_emplace({track.a, track.b}, static_cast<int>(pair_names.size()));
    if (is_new) pair_names.push_back(names(track.a, track.b));
    stream.add(pair->second);
    stream.add(track.start);
    stream.add(static_cast<std::int64_t>(track.arrows.size()));
    std::vector<std::int64_t> values(track.arrows.size());
    for (int c = 0; c < 6; ++c) {
      for (size_t k = 0; k < values.size(); ++k) {
        const Arrow& arrow = *track.arrows[k];
        values[k] = c < 3 ? whole(arrow.position[c], resolution.position)
                          : whole(arrow.force[c - 3], resolution.force);
      }
      stream.add_steps(values);
    }
  }
  return {{"pairs", pair_names},
          {"tracks", tracks.size()},
          {"position_resolution_m", resolution.position},
          {"force_resolution_N", resolution.force},
          {"data", stream.packed()}};
}

}  // namespace

bool is_at_limit(const Model& model, int body, const VectorX& q) {
  const JointInfo& joint = model.joint(body - 1);
  if (joint_nq(model.body(body).joint_type) != 1 || !(joint.upper > joint.lower)) return false;
  const double range = joint.upper - joint.lower, at = q[model.body(body).q_index];
  const double slack = std::isfinite(range) ? 1e-3 * range : 1e-3;
  return at <= joint.lower + slack || at >= joint.upper - slack;
}

Json pack_clip(const Model& model, const Clip& clip, const Resolution& resolution) {
  std::vector<double> time;
  for (const State& state : clip.states) time.push_back(state.time);
  Json out = {{"name", clip.name},
              {"frames", clip.num_frames()},
              {"time", pack_doubles(time)},
              {"position_resolution_m", resolution.position},
              {"quaternion_resolution", resolution.quaternion},
              {"poses", pack_poses(model, clip, resolution)},
              {"at_limit", pack_limits(model, clip)}};
  if (!clip.asleep.empty()) out["asleep"] = pack_asleep(clip, model.num_trees());
  return out;
}

Json pack_contacts(const Model& model, const Clip& clip, const Resolution& resolution) {
  const auto& geometries = model.geometries();
  std::vector<Arrow> arrows;
  for (const Contact& c : clip.contacts)
    arrows.push_back({c.frame, c.geometry_a, c.geometry_b, c.position,
                      force_on_moving(geometries[c.geometry_b].body, c.force)});
  return pack_arrows(arrows, resolution, [&](int a, int b) {
    return Json{geometries[a].name, geometries[b].name};
  });
}

Json pack_closure_forces(const Model& model, const Clip& clip, const Resolution& resolution) {
  std::vector<Arrow> arrows;
  for (const ClosureArrow& c : clip.closure_forces)
    arrows.push_back({c.frame, c.closure, c.closure, c.position,
                      force_on_moving(model.closures()[c.closure].body_b, c.force)});
  return pack_arrows(arrows, resolution, [&](int i, int) {
    return Json{model.closures()[i].name, ""};
  });
}

Json pack_curves(const std::vector<Curve>& curves) {
  Json list = Json::array();
  IntegerStream stream;
  for (const Curve& curve : curves) {
    const auto [low, high] = std::minmax_element(curve.values.begin(), curve.values.end());
    const double unit = (*high - *low) / 65535.0;
    std::vector<std::int64_t> values;
    for (const double x : curve.values) values.push_back(unit > 0.0 ? whole(x - *low, unit) : 0);
    stream.add_smooth(values);
    list.push_back({{"group", curve.group},
                    {"label", curve.label},
                    {"unit", curve.unit},
                    {"offset", *low},
                    {"resolution", unit}});
    if (curve.ghost >= 0) list.back()["ghost"] = curve.ghost;
  }
  return {{"list", list}, {"data", stream.packed()}};
}

}  // namespace counterpoint::view
