#include "counterpoint/engine/optimize/files/target_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "counterpoint/engine/optimize/files/mirror_names.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::optimization {
namespace {

/// Largest deviation of a quaternion's length from 1 in a file.
constexpr double kQuaternionError = 1e-3;

struct Sides {
  std::string left, right;
};

std::optional<Sides> read_sides(const YamlValue& in) {
  if (!in.has("mirror")) return std::nullopt;
  const std::vector<YamlValue> words = in.at("mirror").list();
  if (words.size() != 2) in.at("mirror").fail("two words are expected, as [left_, right_]");
  return Sides{words[0].text(), words[1].text()};
}

/// Returns the index of a column. @throws InputError at `in` if there is none.
int column_of(const YamlValue& in, const Table& table, const std::string& name) {
  try {
    return table.column(name);
  } catch (const InputError& error) {
    in.fail(error.what());
  }
}

/// Reads one table as the targets of one term.
class SampleReader {
 public:
  SampleReader(const YamlValue& in, const Table& table, const Model& model, const Term& term)
      : in_(in), table_(table), model_(model), term_(term), time_(rising_time(in, table)) {}

  const std::vector<double>& time() const { return time_; }

  /// Values of a column of zeros and ones.
  Eigen::RowVectorXd flags(const YamlValue& name) const {
    Eigen::RowVectorXd out(static_cast<Eigen::Index>(time_.size()));
    fill(name.text(), out);
    for (Eigen::Index row = 0; row < out.size(); ++row)
      if (out[row] != 0.0 && out[row] != 1.0)
        name.fail(fmt::format("{}: {} is neither 0 nor 1", table_.where(static_cast<int>(row)),
                              out[row]));
    return out;
  }

  /// Values by coordinate; `otherwise` where the file has no column, which has no weight then.
  MatrixX coordinates(const VectorX& otherwise) const {
    const CoordinateNames names = coordinate_names(model_);
    const bool positions = term_.quantity == Quantity::kConfiguration;
    const auto& own = positions                                   ? names.q
                      : term_.quantity == Quantity::kAppliedForce ? names.force
                                                                  : names.v;
    const std::map<std::string, std::string> given = given_columns(own);
    MatrixX out(otherwise.size(), static_cast<Eigen::Index>(time_.size()));
    for (int b = 1; b < model_.num_bodies(); ++b) {
      const Body& body = model_.body(b);
      const int first = positions ? body.q_index : body.v_index;
      const int count = positions ? joint_nq(body.joint_type) : joint_nv(body.joint_type);
      const auto weights = term_.weight.segment(body.v_index, joint_nv(body.joint_type));
      for (int i = first; i < first + count; ++i) {
        const std::string& name = own[static_cast<std::size_t>(i)];
        const auto entry = given.find(name);
        const std::string& theirs = entry == given.end() ? name : entry->second;
        const bool needed =
            entry != given.end() ||
            (count == weights.size() ? weights[i - first] != 0.0 : is_needed(weights, i - first));
        if (needed || table_.find_column(theirs) >= 0) {
          fill(theirs, out.row(i));
        } else {
          out.row(i).setConstant(otherwise[i]);
        }
      }
      const int linear = joint_num_linear(body.joint_type);
      if (count != weights.size()) normalize_quaternions(in_, table_, first + linear, out);
    }
    return out;
  }

  /// Values by row from `columns`: a list of names, or a word before ".x", ".y" and so on.
  MatrixX rows(const std::optional<Sides>& sides) const {
    MatrixX out(target_size(model_, term_.quantity), static_cast<Eigen::Index>(time_.size()));
    const std::vector<std::string> names = names_of_rows(out.rows());
    for (Eigen::Index i = 0; i < out.rows(); ++i) {
      const std::string& name = names[static_cast<std::size_t>(i)];
      fill(sides ? partner_name(name, sides->left, sides->right) : name, out.row(i));
    }
    if (term_.quantity == Quantity::kOrientation) normalize_quaternions(in_, table_, 0, out);
    if (!sides) return out;
    // A reflection in y = 0 turns vectors' y, and the axis of a rotation in the other two.
    if (out.rows() == 3) out.row(1) *= -1.0;
    if (out.rows() == 4) {
      out.row(1) *= -1.0;
      out.row(3) *= -1.0;
    }
    return out;
  }

 private:
  /// True if a row of a floating or spherical joint's q bears weight: a quaternion needs all four.
  static bool is_needed(const VectorRef& weights, int row) {
    const Eigen::Index linear = weights.size() - 3;
    return row < linear ? weights[row] != 0.0 : !weights.tail<3>().isZero(0.0);
  }

  void fill(const std::string& name,
            Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> out) const {
    const int index = column_of(in_, table_, name);
    for (int row = 0; row < table_.num_rows(); ++row) out[row] = table_.value(row, index);
  }

  std::map<std::string, std::string> given_columns(const std::vector<std::string>& own) const {
    std::map<std::string, std::string> given;
    if (!in_.has("columns")) return given;
    const YamlValue columns = in_.at("columns");
    if (!columns.is_map()) columns.fail("a map {coordinate: column of the file} is expected");
    for (const auto& [name, value] : columns.entries()) {
      if (std::find(own.begin(), own.end(), name) == own.end())
        value.fail(fmt::format("'{}' is no coordinate of the scene; known: {}", name,
                               fmt::join(own, ", ")));
      given[name] = value.text();
    }
    return given;
  }

  std::vector<std::string> names_of_rows(Eigen::Index rows) const {
    const YamlValue columns = in_.at("columns");
    std::vector<std::string> names;
    if (columns.is_list()) {
      for (const YamlValue& name : columns.list()) names.push_back(name.text());
      if (static_cast<Eigen::Index>(names.size()) != rows)
        columns.fail(fmt::format("{} columns are expected", rows));
      return names;
    }
    if (rows == 1) return {columns.text()};
    const char* const suffixes = term_.quantity == Quantity::kOrientation     ? "qw qx qy qz"
                                 : term_.quantity == Quantity::kPointVelocity ? "vx vy vz"
                                 : term_.quantity == Quantity::kContactForce  ? "fx fy fz"
                                                                              : "x y z";
    std::string suffix;
    for (const char* c = suffixes;; ++c) {
      if (*c != ' ' && *c != 0) {
        suffix += *c;
        continue;
      }
      names.push_back(columns.text() + "." + suffix);
      suffix.clear();
      if (*c == 0) return names;
    }
  }

  const YamlValue& in_;
  const Table& table_;
  const Model& model_;
  const Term& term_;
  std::vector<double> time_;
};

MatrixX mirrored_coordinates(const YamlValue& in, const Model& model, const Sides& sides,
                             const MatrixX& values) {
  try {
    const Mirror mirror = make_mirror(model, sides.left, sides.right);
    const bool positions = values.rows() == model.nq();
    const auto& index = positions ? mirror.q_index : mirror.v_index;
    const VectorX& sign = positions ? mirror.q_sign : mirror.v_sign;
    MatrixX out(values.rows(), values.cols());
    for (Eigen::Index i = 0; i < values.rows(); ++i)
      out.row(i) = sign[i] * values.row(index[static_cast<std::size_t>(i)]);
    return out;
  } catch (const InputError& error) {
    in.at("mirror").fail(error.what());
  }
}

/// Changes orientations of a link to those of its body.
void turn(const Matrix3& link, MatrixX& quaternions) {
  const Quaternion to_body = Quaternion(link).conjugate();
  for (auto column : quaternions.colwise()) {
    const Quaternion turned = quaternion_of(column) * to_body;
    column << turned.w(), turned.x(), turned.y(), turned.z();
  }
}

}  // namespace

std::vector<double> rising_time(const YamlValue& in, const Table& table) {
  const int column = column_of(in, table, "time");
  std::vector<double> time;
  for (int row = 0; row < table.num_rows(); ++row) time.push_back(table.value(row, column));
  if (time.empty()) in.fail(table.file() + ": no rows below the header");
  for (std::size_t row = 1; row < time.size(); ++row)
    if (!(time[row] > time[row - 1]))
      in.fail(
          fmt::format("{}: time {} does not rise", table.where(static_cast<int>(row)), time[row]));
  return time;
}

void normalize_quaternions(const YamlValue& in, const Table& table, Eigen::Index first,
                           MatrixX& values) {
  for (Eigen::Index i = 0; i < values.cols(); ++i) {
    auto quaternion = values.block<4, 1>(first, i);
    if (std::abs(quaternion.norm() - 1.0) >= kQuaternionError)
      in.fail(fmt::format("{}: a quaternion has the length {:.6g}; 1 is expected",
                          table.where(static_cast<int>(i)), quaternion.norm()));
    quaternion.normalize();
  }
}

Playback read_playback(const YamlValue& in, const std::vector<double>& time) {
  Playback playback{time.front()};
  if (in.has("start")) playback.start = in.at("start").number();
  if (in.has("rate")) playback.rate = in.at("rate").positive();
  if (in.has("loop")) playback.loop = in.at("loop").boolean();
  return playback;
}

const Table& TargetReader::table(const std::filesystem::path& file) {
  std::shared_ptr<const Table>& table = tables_[file];
  if (table == nullptr) table = std::make_shared<const Table>(file);
  return *table;
}

std::vector<char> TargetReader::flags(const YamlValue& in, const Problem& problem) {
  in.expect_map({"file", "column", "is", "start"});
  const Term any;  // its quantity does not matter
  const SampleReader reader(in, table(folder_ / in.at("file").text()), *problem.model, any);
  const Eigen::RowVectorXd flags = reader.flags(in.at("column"));
  const double wanted = in.has("is") ? in.at("is").integer(0, 1) : 1;
  const std::vector<double>& time = reader.time();
  const double start = in.has("start") ? in.at("start").number() : time.front();
  std::vector<char> active;
  for (int t = 0; t <= problem.steps; ++t) {
    // A frame at the time of a row, up to round-off, has its flag.
    const double now = start + (t + 1e-6) * problem.h();
    const auto row = std::upper_bound(time.begin(), time.end(), now) - time.begin();
    active.push_back(flags[std::max<Eigen::Index>(row - 1, 0)] == wanted);
  }
  return active;
}

Samples TargetReader::configurations(const YamlValue& in, const std::filesystem::path& file,
                                     const Model& model) {
  Term all;
  all.weight.setOnes(model.nv());
  const SampleReader reader(in, table(file), model, all);
  return {reader.time(), reader.coordinates(model.default_q())};
}

std::shared_ptr<const Reference> TargetReader::read(const YamlValue& target, const Model& model,
                                                    const Term& term, const VectorX& start,
                                                    const Matrix3& link) {
  target.expect_map({"file", "columns", "start", "rate", "loop", "mirror"});
  if (!may_follow(term.quantity))
    target.fail(fmt::format("{} takes no target from a file", quantity_name(term.quantity)));
  const SampleReader reader(target, table(folder_ / target.at("file").text()), model, term);
  const std::optional<Sides> sides = read_sides(target);
  Samples samples{reader.time(), {}};
  MatrixX mirrored;
  if (of_coordinates(term.quantity)) {
    const bool positions = term.quantity == Quantity::kConfiguration;
    samples.values = reader.coordinates(positions ? start : VectorX(VectorX::Zero(model.nv())));
    if (sides) mirrored = mirrored_coordinates(target, model, *sides, samples.values);
  } else {
    samples.values = reader.rows(std::nullopt);
    if (sides) mirrored = reader.rows(sides);
    if (term.quantity == Quantity::kOrientation) {
      turn(link, samples.values);
      if (sides) turn(link, mirrored);
    }
  }
  return std::make_shared<const Reference>(model, term.quantity, samples,
                                           read_playback(target, samples.time),
                                           sides ? &mirrored : nullptr);
}

}  // namespace counterpoint::optimization
