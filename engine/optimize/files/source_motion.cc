#include "counterpoint/engine/optimize/files/source_motion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/io/marker_columns.h"
#include "counterpoint/engine/optimize/files/pose_reader.h"
#include "counterpoint/engine/optimize/files/target_reader.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::optimization {
namespace {

std::filesystem::path beside(const YamlValue& in, const std::filesystem::path& folder,
                             const char* key) {
  return in.has(key) ? folder / in.at(key).text() : std::filesystem::path();
}

/// Returns the ending of a file's name in small letters.
std::string ending(const std::filesystem::path& file) {
  std::string out = file.extension().string();
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

}  // namespace

SourceMotion::SourceMotion(const YamlValue& in, const SourceFiles& given,
                           std::shared_ptr<const Scene> own,
                           const std::filesystem::path& problem_file)
    : own_(std::move(own)),
      scene_(own_),
      problem_folder_(problem_file.parent_path()),
      motion_file_(given.motion.empty() ? beside(in, problem_folder_, "motion") : given.motion),
      scene_file_(given.scene.empty() ? beside(in, problem_folder_, "scene") : given.scene),
      posture_(own_->q) {
  in.expect_map({"motion", "scene", "columns", "points", "unit", "axes", "posture", "start", "rate",
                 "loop", "scale", "ground", "map", "fit"});
  if (motion_file_.empty())
    in.fail("which motion? name its table under 'motion', or give --motion FILE");
  if (in.has("scale")) scale_ = in.at("scale").positive();
  if (in.has("ground")) ground_ = in.at("ground").number();
  if (in.has("posture")) read_pose(in.at("posture"), own_->model, posture_);
  open(in);
  read_axes(in);
  if (in.has("map")) read_map(in.at("map"));
}

/// Opens the motion: points of a table, or coordinates of a scene.
void SourceMotion::open(const YamlValue& in) {
  const std::string kind = ending(motion_file_);
  const bool points = kind == ".bvh" || kind == ".trc" || kind == ".c3d" ||
                      (in.has("points") && in.at("points").boolean());
  const double unit = read_unit(in);
  if (points) {
    if (!scene_file_.empty() || in.has("columns"))
      in.fail("points of a motion have neither a 'scene' (--motion-scene) nor 'columns'");
    source_ = points_of(in, motion_file_, unit);
  } else {
    if (in.has("unit")) in.at("unit").fail("'unit' is of 'points'; coordinates are in m and rad");
    if (!scene_file_.empty()) scene_ = std::make_shared<const Scene>(load_scene(scene_file_));
    TargetReader reader("");
    coordinates_ = reader.configurations(in, motion_file_, scene_->model);
    const Table& table = *reader.tables().begin()->second;
    for (const Frame& frame : scene_->model.frames())
      if (frame.body == 0 && table.find_column(frame.name + ".qw") >= 0)
        in.fail(
            fmt::format("{} moves '{}', which is fixed in the motion's scene: give a scene in "
                        "which it has 'base: floating'",
                        table.file(), frame.name));
    source_ = links_of(scene_, *coordinates_);
  }
  playback_ = read_playback(in, source_->time());
}

/// Returns the unit of lengths in the motion's file [m].
double SourceMotion::read_unit(const YamlValue& in) const {
  const std::string kind = ending(motion_file_);
  const char* const expected = "mm, cm, m, or the number of metres in a unit is expected";
  if (!in.has("unit")) {
    if (kind == ".bvh")
      in.fail(fmt::format("'unit' is missing: BVH files do not say theirs, most often cm; {}",
                          expected));
    return 1.0;
  }
  const YamlValue unit = in.at("unit");
  if (kind == ".trc" || kind == ".c3d")
    unit.fail("the file says its unit, and is read in m: leave 'unit' out");
  if (const auto per_metre = units_per_metre(unit.text())) return 1.0 / *per_metre;
  const std::optional<double> metres = parse_number(unit.text());
  if (!metres || !(*metres > 0.0 && *metres < 1e6)) unit.fail(expected);
  return *metres;
}

void SourceMotion::read_axes(const YamlValue& in) {
  if (!in.has("axes")) {
    if (ending(motion_file_) == ".bvh")
      in.fail(
          "'axes' is missing: BVH files do not say which of theirs points up; often [z, x, y], "
          "the axes of the file along x, y and z of the world");
    return;
  }
  std::vector<std::string> names;
  for (const YamlValue& axis : in.at("axes").list()) names.push_back(axis.text());
  const auto axes = world_axes(names);
  if (!axes) in.at("axes").fail(kAxesExpected);
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto& [axis, sign] = (*axes)[static_cast<std::size_t>(i)];
    axes_.row(i) = sign * Vector3::Unit(axis - 'x').transpose();
  }
  if (axes_.determinant() < 0.0)
    in.at("axes").fail("a mirror image: turn the sign of one of the axes");
}

void SourceMotion::read_map(const YamlValue& in) {
  if (in.is_map()) {
    for (const auto& [source, value] : in.entries()) map_.push_back(read_follower(source, value));
    return;
  }
  for (const MarkerPlace& place : read_marker_places(problem_folder_ / in.text())) {
    Follower& follower = map_.emplace_back(Follower{in, place.marker});
    follower.point = place.point;
    attach(in, place.where + ": ", place.link, follower);
  }
}

SourceMotion::Follower SourceMotion::read_follower(const std::string& source,
                                                   const YamlValue& in) const {
  Follower out{in, source};
  if (!in.is_map()) {
    attach(in, "", in.text(), out);
    return out;
  }
  in.expect_map({"link", "point", "source_point", "from", "scale"});
  if (in.has("point")) out.point = in.at("point").vector3();
  if (in.has("source_point")) out.source_point = in.at("source_point").vector3();
  attach(in.at("link"), "", in.at("link").text(), out);
  if (in.has("from") != in.has("scale"))
    in.fail("'from' and 'scale' belong together: the distance from that point is scaled");
  if (!in.has("from")) return out;
  out.from = in.at("from").text();
  out.scale = in.at("scale").positive();
  return out;
}

/// Attaches the point to the body that has a link.
void SourceMotion::attach(const YamlValue& in, const std::string& where, const std::string& link,
                          Follower& out) const {
  const int index = own_->model.find_frame(link);
  if (index < 0) in.fail(fmt::format("{}the scene has no link '{}'", where, link));
  const Frame& frame = own_->model.frames()[static_cast<std::size_t>(index)];
  out.body = frame.body;
  out.point = frame.X_BF * out.point;
}

std::shared_ptr<const Reference> SourceMotion::configuration(const YamlValue& target) const {
  const Model& model = own_->model;
  if (!coordinates_ || coordinate_names(scene_->model).q != coordinate_names(model).q)
    target.fail("the motion has no or other coordinates; follow its points by 'sources'");
  return std::make_shared<const Reference>(model, Quantity::kConfiguration, *coordinates_,
                                           playback_);
}

std::vector<Term> SourceMotion::terms(const YamlValue& sources, const Term& common) const {
  if (common.quantity != Quantity::kPosition && common.quantity != Quantity::kOrientation)
    sources.fail("a position or an orientation follows points of the motion");
  std::vector<Term> out;
  std::set<std::string> taken;
  for (const YamlValue& name :
       sources.is_list() ? sources.list() : std::vector<YamlValue>{sources}) {
    bool found = false;
    for (const Follower& follower : map_) {
      if (!matches(name.text(), follower.source)) continue;
      found = true;
      if (!taken.insert(follower.source).second) continue;
      Term& term = out.emplace_back(common);
      term.body = follower.body;
      term.point = follower.point;
      const MatrixX values =
          common.quantity == Quantity::kPosition ? positions(follower) : orientations(follower);
      if (playback_.loop && (values.leftCols<1>().hasNaN() || values.rightCols<1>().hasNaN()))
        name.fail(fmt::format("'{}' is not seen at both ends, where the motion repeats",
                              follower.source));
      term.reference = std::make_shared<const Reference>(
          own_->model, term.quantity, Samples{source_->time(), values}, playback_);
    }
    if (found) continue;
    std::vector<std::string> known;
    for (const Follower& follower : map_) known.push_back(follower.source);
    name.fail(fmt::format("no '{}' in the map of 'retarget'; there are: {}", name.text(),
                          fmt::join(known, ", ")));
  }
  return out;
}

/// Places in the world for a follower's point.
MatrixX SourceMotion::positions(const Follower& follower) const {
  MatrixX x = source_->track(follower.in, follower.source, follower.source_point).position;
  if (!follower.from.empty()) {
    const MatrixX from = source_->track(follower.in, follower.from, Vector3::Zero()).position;
    x = from + follower.scale * (x - from);
  }
  return scale_ * ((axes_ * x).colwise() - ground_ * Vector3::UnitZ());
}

/// Orientations in the world for a follower's body: what turns the source's link from its posture
/// at rest turns the body from `posture`.
MatrixX SourceMotion::orientations(const Follower& follower) const {
  const PointTrack track = source_->track(follower.in, follower.source, follower.source_point);
  if (track.orientation.cols() == 0)
    follower.in.fail(fmt::format("'{}' has no orientation, or no columns {}.qw ... {}.qz",
                                 follower.source, follower.source, follower.source));
  Data own(own_->model);
  compute_poses(own_->model, posture_, own);
  const Quaternion axes(axes_);
  const Quaternion rest =
      track.rest.conjugate() * axes.conjugate() * Quaternion(own.X_WB[follower.body].rotation);
  MatrixX out(4, track.orientation.cols());
  for (Eigen::Index i = 0; i < out.cols(); ++i) {
    const Quaternion q = axes * quaternion_of(track.orientation.col(i)) * rest;
    out.col(i) << q.w(), q.x(), q.y(), q.z();
  }
  return out;
}

}  // namespace counterpoint::optimization
