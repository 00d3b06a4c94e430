#include "counterpoint/engine/optimize/files/point_source.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/files/target_reader.h"
#include "counterpoint/engine/optimize/terms/kinematic_terms.h"

namespace counterpoint::optimization {
namespace {

class LinkSource final : public PointSource {
 public:
  LinkSource(std::shared_ptr<const Scene> scene, const Samples& samples)
      : PointSource(samples.time), scene_(std::move(scene)), q_(samples.values) {}

  PointTrack track(const YamlValue& in, const std::string& name,
                   const Vector3& place) const override {
    const Model& model = scene_->model;
    const int index = model.find_frame(name);
    if (index < 0) in.fail(fmt::format("the motion's scene has no link '{}'", name));
    const Frame& frame = model.frames()[static_cast<std::size_t>(index)];
    Data data(model);
    compute_poses(model, scene_->q, data);
    PointTrack out{MatrixX(3, q_.cols()), MatrixX(4, q_.cols()),
                   Quaternion(data.X_WB[frame.body].rotation)};
    for (Eigen::Index i = 0; i < q_.cols(); ++i) {
      compute_poses(model, q_.col(i), data);
      out.position.col(i) = point_position(data, frame.body, frame.X_BF * place);
      const Quaternion q(data.X_WB[frame.body].rotation);
      out.orientation.col(i) << q.w(), q.x(), q.y(), q.z();
    }
    return out;
  }

 private:
  std::shared_ptr<const Scene> scene_;
  MatrixX q_;  ///< nq x times
};

TableOptions options_of_points() {
  TableOptions options;
  options.any_unit = options.nan_is_empty = true;
  return options;
}

class TablePoints final : public PointSource {
 public:
  TablePoints(const YamlValue& in, std::shared_ptr<const Table> table, double unit)
      : PointSource(rising_time(in, *table)), table_(std::move(table)), unit_(unit) {}

  PointTrack track(const YamlValue& in, const std::string& name,
                   const Vector3& place) const override {
    PointTrack out{columns(in, name, {".x", ".y", ".z"}), {}};
    out.position *= unit_;
    const auto seen = [&](Eigen::Index i) { return !out.position.col(i).hasNaN(); };
    if (table_->find_column(name + ".qw") >= 0) {
      out.orientation = columns(in, name, {".qw", ".qx", ".qy", ".qz"});
      normalize_quaternions(in, *table_, 0, out.orientation);
      for (Eigen::Index i = 0; i < out.position.cols(); ++i)
        if (seen(i)) out.position.col(i) += quaternion_of(out.orientation.col(i)) * place;
    } else if (!place.isZero(0.0)) {
      in.fail(fmt::format("'{}' is a point without axes in which there are places", name));
    }
    for (Eigen::Index i = 0; i < out.position.cols(); ++i)
      if (seen(i)) return out;
    in.fail(fmt::format("{}: '{}' is seen at no time", table_->file(), name));
  }

 private:
  /// Values of columns by time; all of them are empty in a row, or none.
  MatrixX columns(const YamlValue& in, const std::string& name,
                  const std::vector<const char*>& rows) const {
    MatrixX out(static_cast<Eigen::Index>(rows.size()), table_->num_rows());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const int column = table_->find_column(name + rows[k]);
      if (column < 0)
        in.fail(fmt::format("{}: no point '{}' (no column '{}{}'); there are: {}", table_->file(),
                            name, name, rows[k], fmt::join(names(), ", ")));
      for (int row = 0; row < table_->num_rows(); ++row)
        out(static_cast<Eigen::Index>(k), row) = table_->cell(row, column);
    }
    for (int row = 0; row < table_->num_rows(); ++row)
      if (out.col(row).hasNaN() && !out.col(row).array().isNaN().all())
        in.fail(
            fmt::format("{}: '{}' has some of its numbers; expected all, or none where it was "
                        "not seen",
                        table_->where(row), name));
    return out;
  }

  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const std::string& column : table_->columns())
      if (column.ends_with(".x")) out.push_back(column.substr(0, column.size() - 2));
    return out;
  }

  std::shared_ptr<const Table> table_;
  double unit_;  ///< [m]
};

}  // namespace

std::unique_ptr<PointSource> links_of(std::shared_ptr<const Scene> scene, const Samples& samples) {
  return std::make_unique<LinkSource>(std::move(scene), samples);
}

std::unique_ptr<PointSource> points_of(const YamlValue& in, const std::filesystem::path& file,
                                       double unit) {
  auto table = std::make_shared<const Table>(file, RowsRead(), options_of_points());
  return std::make_unique<TablePoints>(in, std::move(table), unit);
}

}  // namespace counterpoint::optimization
