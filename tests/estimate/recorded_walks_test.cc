// Recorded walks over force plates: forces estimated from the motion alone, against the measured
// ones. The recordings are not part of the project.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "counterpoint/engine/estimate/motion_estimate.h"
#include "counterpoint/engine/tables.h"
#include "support/paths.h"

namespace counterpoint::estimation::recorded_walks_test {
namespace {

namespace fs = std::filesystem;

struct Walk {
  const char* folder;
  const char* recording;
  double from, to;                             ///< time interval [s]
  std::vector<std::vector<const char*>> feet;  ///< links of each foot
  std::vector<std::string> columns;            ///< column names, three per foot; "": not measured
  bool half_rate = false;                      ///< use every second row
};

Recording every_second_row(const Recording& whole) {
  const auto every = Eigen::seq(0, whole.num_rows() - 1, 2);
  Recording out = whole;
  out.time.clear();
  for (std::size_t row = 0; row < whole.time.size(); row += 2) out.time.push_back(whole.time[row]);
  for (MatrixX* rows : {&out.q, &out.v, &out.applied_force, &out.contact_force})
    *rows = MatrixX((*rows)(Eigen::all, every));
  return out;
}

/// Rows between two times [s].
Recording cut(const Recording& whole, double from, double to) {
  int first = 0, last = whole.num_rows();
  while (first < last && whole.time[static_cast<std::size_t>(first)] < from - 1e-6) ++first;
  while (last > first && whole.time[static_cast<std::size_t>(last) - 1] > to + 1e-6) --last;
  return rows_of(whole, first, last - first);
}

/// Root mean square of estimated minus measured forces, in % of the total weight: per foot and
/// axis, and of the sum of the feet per axis. Measured forces are averaged like those of a row.
struct Errors {
  MatrixX foot;  ///< feet x 3; NaN without measurement
  Vector3 total = Vector3::Zero();
  double inside = 0.0;  ///< share of the feet's vertical forces inside their 95 % intervals
  MotionEstimate estimate;
};

/// @param map_file  column map instead of the folder's own
/// @param plates    file of the map's source "plates"; empty: there is none
Errors errors_of(const Walk& walk, fs::path map_file = {}, const std::string& plates = {}) {
  const fs::path folder = fs::path(test::shared_data()) / walk.folder;
  const Scene scene = load_scene(folder / "scene.yaml");
  if (map_file.empty()) map_file = folder / "map.yaml";
  ColumnMap map = load_column_map(map_file, scene.model);
  MotionEstimateOptions options;
  for (std::size_t f = 0; f < walk.feet.size(); ++f) {
    ColumnMap::ContactForce& force = map.contact_forces.emplace_back();
    force.name = walk.feet[f].front();
    force.source = plates.empty() ? "" : "plates";
    for (const char* link : walk.feet[f])
      force.bodies.push_back(
          scene.model.frames()[static_cast<std::size_t>(scene.model.find_frame(link))].body);
    for (std::size_t axis = 0; axis < 3; ++axis)
      force.components.push_back({walk.columns[3 * f + axis], 1.0, 0.0});
    options.sums.push_back({force.name, force.bodies});
  }
  Recording recording = read_all({folder / walk.recording}, map, scene).front();
  if (!plates.empty()) read_sources({{"plates", folder / plates}}, map, recording);
  recording = cut(recording, walk.from, walk.to);
  if (walk.half_rate) recording = every_second_row(recording);
  Errors out;
  out.estimate = estimate_motion(scene, map, recording, options);
  double weight = 0.0;
  for (const Body& body : scene.model.bodies()) weight += 9.80665 * body.inertia.mass;
  const auto feet = static_cast<Eigen::Index>(walk.feet.size());
  const Eigen::Index rows = recording.contact_force.cols();
  const MatrixX& m = recording.contact_force;
  MatrixX error(3 * feet, rows - 2);
  for (Eigen::Index t = 1; t + 1 < rows; ++t)
    error.col(t - 1) = out.estimate.sum_force.col(t).head(3 * feet) -
                       (m.col(t - 1) + 4.0 * m.col(t) + m.col(t + 1)) / 6.0;
  const auto rms = [&](const VectorX& e) {
    return 100.0 * std::sqrt(e.squaredNorm() / static_cast<double>(e.size())) / weight;
  };
  out.foot.resize(feet, 3);
  MatrixX total = MatrixX::Zero(3, rows - 2);
  for (Eigen::Index f = 0; f < feet; ++f) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) out.foot(f, axis) = rms(error.row(3 * f + axis));
    total += error.middleRows(3 * f, 3);
    for (Eigen::Index t = 1; t + 1 < rows; ++t)
      if (std::abs(error(3 * f + 2, t - 1)) <= 1.96 * out.estimate.sum_deviation(3 * f + 2, t))
        out.inside += 1.0 / static_cast<double>(feet * (rows - 2));
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) out.total[axis] = rms(total.row(axis));
  return out;
}

/// Prints a line for docs/measurements/recordings.md.
void print(const char* name, const Errors& errors) {
  std::printf("%s: errors of the sum of the feet %.2f %.2f %.2f %% of the weight;", name,
              errors.total.x(), errors.total.y(), errors.total.z());
  for (Eigen::Index f = 0; f < errors.foot.rows(); ++f)
    std::printf(" of a foot %.2f %.2f %.2f;", errors.foot(f, 0), errors.foot(f, 1),
                errors.foot(f, 2));
  std::printf(" %.0f %% inside; %d Newton steps, %.1f s\n", 100.0 * errors.inside,
              errors.estimate.newton_steps, errors.estimate.seconds);
}

bool missing(const char* folder) {
  return !fs::exists(fs::path(test::shared_data()) / folder / "scene.yaml");
}

// Required bounds (aims in [ ]) in % of the weight. No weights were tuned for this recording.
TEST(RecordedWalks, AManOverForcePlates) {
  if (missing("human_walk")) GTEST_SKIP() << "no human_walk; set COUNTERPOINT_SHARED_DATA";
  const Errors errors = errors_of({"human_walk",
                                   "recording_raw.csv",
                                   0.45,
                                   1.98,
                                   {{"talus_r", "toes_r"}, {"talus_l", "toes_l"}},
                                   {"R.fx", "R.fy", "R.fz", "L.fx", "L.fy", "L.fz"}});
  EXPECT_EQ(errors.estimate.errors, RecordingErrors::kSlow);
  EXPECT_LT(errors.total.x(), 4.5);               // [2.9]
  EXPECT_LT(errors.total.y(), 2.2);               // [1.2]
  EXPECT_LT(errors.total.z(), 3.6);               // [2.6]
  EXPECT_LT(errors.foot.col(2).maxCoeff(), 4.5);  // [3.6]
  EXPECT_LT(errors.foot.col(0).maxCoeff(), 2.7);  // [1.8]
  EXPECT_GT(errors.inside, 0.8);
  print("human_walk", errors);
}

// At 50 Hz, differences of rows cannot separate the motion from noise, so the errors look white at
// first; the residuals are then correlated over many rows.
TEST(RecordedWalks, AManAtHalfTheRate) {
  if (missing("human_walk")) GTEST_SKIP() << "no human_walk; set COUNTERPOINT_SHARED_DATA";
  const Errors errors = errors_of({"human_walk",
                                   "recording_raw.csv",
                                   0.45,
                                   1.98,
                                   {{"talus_r", "toes_r"}, {"talus_l", "toes_l"}},
                                   {"R.fx", "R.fy", "R.fz", "L.fx", "L.fy", "L.fz"},
                                   true});
  EXPECT_EQ(errors.estimate.errors, RecordingErrors::kSlow);
  // 1.5 times the measured 5.4 %; treated as white errors it is 17 %.
  EXPECT_LT(errors.foot.col(2).maxCoeff(), 8.1);
  print("human_walk, 50 Hz", errors);
}

// The same from markers: inverse kinematics of the command, and force plates from a file with its
// own clock and rate.
TEST(RecordedWalks, AManOverForcePlatesFromHisMarkers) {
  if (missing("human_walk")) GTEST_SKIP() << "no human_walk; set COUNTERPOINT_SHARED_DATA";
  const fs::path table = fs::path(test::shared_data()) / "human_walk/markers_on_links.csv";
  const fs::path map = fs::path(::testing::TempDir()) / "marker_map.yaml";
  std::ofstream(map) << "time: time\nmarkers: {table: " << table.string()
                     << "}\nsources: {plates: {time: time}}\n";
  const Errors errors = errors_of({"human_walk",
                                   "markers.csv",
                                   0.45,
                                   1.98,
                                   {{"talus_r", "toes_r"}, {"talus_l", "toes_l"}},
                                   {"R.fx", "R.fy", "R.fz", "L.fx", "L.fy", "L.fz"}},
                                  map, "forces.csv");
  EXPECT_EQ(errors.estimate.errors, RecordingErrors::kSlow);
  EXPECT_LT(errors.total.x(), 4.5);
  EXPECT_LT(errors.total.y(), 2.2);
  EXPECT_LT(errors.total.z(), 3.6);
  EXPECT_LT(errors.foot.col(2).maxCoeff(), 4.5);
  EXPECT_LT(errors.foot.col(0).maxCoeff(), 2.7);
  EXPECT_GT(errors.inside, 0.8);
  print("human_walk, markers", errors);
}

/// Errors of the robot's recording between two times [s].
Errors robot_errors(double from, double to) {
  return errors_of({"icub_walk",
                    "recording_raw.csv",
                    from,
                    to,
                    {{"r_sole"}, {"l_sole"}},
                    {"", "", "R.fz", "", "", "L.fz"}});
}

TEST(RecordedWalks, ARobotThatWalks) {
  if (missing("icub_walk")) GTEST_SKIP() << "no icub_walk; set COUNTERPOINT_SHARED_DATA";
  const Errors errors = robot_errors(3.8, 7.8);
  EXPECT_EQ(errors.estimate.errors, RecordingErrors::kSlow);
  EXPECT_LT(errors.foot.col(2).maxCoeff(), 14.0);  // [12]
  print("icub_walk", errors);
}

// The recorded base pose jumps by 5 cm within 40 ms.
TEST(RecordedWalks, AJumpOfTheRecordingIsNamed) {
  if (missing("icub_walk")) GTEST_SKIP() << "no icub_walk; set COUNTERPOINT_SHARED_DATA";
  const Errors errors = robot_errors(7.8, 8.8);
  bool named = false;
  for (const Outlier& one : errors.estimate.outliers)
    named =
        named || std::abs(errors.estimate.time[static_cast<std::size_t>(one.row)] - 8.37) < 0.06;
  EXPECT_TRUE(named);
}

}  // namespace
}  // namespace counterpoint::estimation::recorded_walks_test
