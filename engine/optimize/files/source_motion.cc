#include "counterpoint/engine/optimize/files/source_motion.h"

#include <fmt/format.h>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/files/target_reader.h"
#include "counterpoint/engine/optimize/terms/kinematic_terms.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::optimization {
namespace {

std::filesystem::path beside(const YamlValue& in, const std::filesystem::path& own_file,
                             const char* key) {
  return in.has(key) ? own_file.parent_path() / in.at(key).text() : std::filesystem::path();
}

const Frame& link_frame(const YamlValue& in, const Model& model, const std::string& link) {
  const int frame = model.find_frame(link);
  if (frame < 0) in.fail(fmt::format("the motion's scene has no link '{}'", link));
  return model.frames()[static_cast<std::size_t>(frame)];
}

}  // namespace

SourceMotion::SourceMotion(const YamlValue& in, const SourceFiles& given,
                           std::shared_ptr<const Scene> own,
                           const std::filesystem::path& problem_file)
    : own_(std::move(own)),
      scene_(own_),
      motion_file_(given.motion.empty() ? beside(in, problem_file, "motion") : given.motion),
      scene_file_(given.scene.empty() ? beside(in, problem_file, "scene") : given.scene) {
  in.expect_map({"motion", "scene", "columns", "start", "rate", "loop", "scale", "ground", "fit"});
  if (motion_file_.empty())
    in.fail("which motion? name its table under 'motion', or give --motion FILE");
  if (!scene_file_.empty()) scene_ = std::make_shared<const Scene>(load_scene(scene_file_));
  if (in.has("scale")) scale_ = in.at("scale").positive();
  if (in.has("ground")) ground_ = in.at("ground").number();
  TargetReader tables("");
  samples_ = tables.configurations(in, motion_file_, scene_->model);
  playback_ = read_playback(in, samples_);
}

std::shared_ptr<const Reference> SourceMotion::reference(const YamlValue& target, const Term& term,
                                                         std::size_t index) const {
  const Model& model = own_->model;
  if (term.quantity == Quantity::kConfiguration) {
    if (coordinate_names(scene_->model).q != coordinate_names(model).q)
      target.fail("the motion is that of another robot, with other coordinates; follow its links");
    return std::make_shared<const Reference>(model, term.quantity, samples_, playback_);
  }
  if (term.quantity != Quantity::kPosition && term.quantity != Quantity::kOrientation)
    target.fail("a configuration, a position or an orientation follows the motion");
  if (!target.is_map()) target.fail("which of its links? {source: LINK} is expected");
  const YamlValue source = target.at("source");
  std::string link;
  if (source.is_list()) {
    const std::vector<YamlValue> links = source.list();
    if (index >= links.size()) source.fail("as many links as the term has are expected");
    link = links[index].text();
  } else {
    link = source.text();
    if (index > 0) source.fail("a list of links is expected, one for each of the term's links");
  }
  return std::make_shared<const Reference>(
      model, term.quantity, Samples{samples_.time, link_values(target, term, link)}, playback_);
}

MatrixX SourceMotion::link_values(const YamlValue& target, const Term& term,
                                  const std::string& link) const {
  target.expect_map({"source", "point"});
  const Model& model = scene_->model;
  const Frame& frame = link_frame(target.at("source"), model, link);
  const Vector3 in_link = target.has("point") ? target.at("point").vector3() : Vector3::Zero();
  const Vector3 point = frame.X_BF * in_link;
  Data data(model), own(own_->model);
  compute_poses(model, scene_->q, data);
  compute_poses(own_->model, own_->q, own);
  // Both scenes start in the same posture: what turns one link from there turns the other.
  const Matrix3 rest = data.X_WB[frame.body].rotation.transpose() * own.X_WB[term.body].rotation;
  MatrixX out(target_size(own_->model, term.quantity), samples_.values.cols());
  for (Eigen::Index i = 0; i < out.cols(); ++i) {
    compute_poses(model, samples_.values.col(i), data);
    if (term.quantity == Quantity::kPosition) {
      const Vector3 x = point_position(data, frame.body, point);
      out.col(i) = scale_ * (x - ground_ * Vector3::UnitZ());
    } else {
      const Quaternion q(Matrix3(data.X_WB[frame.body].rotation * rest));
      out.col(i) << q.w(), q.x(), q.y(), q.z();
    }
  }
  return out;
}

}  // namespace counterpoint::optimization
