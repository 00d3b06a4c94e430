// Recordings as ROS tools write them: tables of rostopic and ros2, .mcap files of rosbag2.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "apps/command.h"
#include "apps/mcap_bag.h"
#include "counterpoint/engine/tables.h"

namespace counterpoint::ros_recordings_test {
namespace {

using test::CommandFolder;
using test::CommandResult;
using test::McapBag;
using test::RosMessage;
using test::test_name;

constexpr long kStart = 1649138880;  // [s] since 1970
constexpr double kInterval = 0.01;   // [s] between rows
/// Times since 1970 as doubles are rounded to 256 ns, 2.6e-5 of an interval of 10 ms. The error of
/// a motion of 2 rad/s over half a second stays below this [rad, m].
constexpr double kRounding = 1e-4;

struct Row {
  long nanoseconds = 0;  ///< since 1970
  std::vector<double> q, v, u;
};

/// Rows of a trajectory made by the engine from the scene itself, so that a comparison predicts
/// them to the round-off of times.
std::vector<Row> own_motion(const CommandFolder& folder, const std::string& scene,
                            const std::vector<std::string>& q, const std::vector<std::string>& v) {
  folder.succeed("simulate " + scene + " --duration 0.5 --timestep 0.002 --output {}/own.csv");
  const Table table(folder.path("own.csv"));
  std::vector<Row> rows;
  for (int row = 0; row < table.num_rows(); row += 5) {
    Row& one = rows.emplace_back();
    one.nanoseconds = kStart * 1'000'000'000 + static_cast<long>(rows.size() - 1) * 10'000'000;
    for (const std::string& name : q) one.q.push_back(table.value(row, table.column(name)));
    for (const std::string& name : v) one.v.push_back(table.value(row, table.column(name)));
  }
  return rows;
}

/// A recording of a pendulum that swings over the top.
class PendulumRecording : public testing::Test {
 protected:
  void SetUp() override {
    folder_.write(
        "pendulum.urdf",
        "<robot name='p'><link name='base'/><link name='rod'><inertial><origin xyz='0 0 "
        "-0.5'/><mass value='1'/>"
        "<inertia ixx='0.083' iyy='0.083' izz='0.001' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        "<joint name='axis' type='continuous'><parent link='base'/><child link='rod'/><axis xyz='0 "
        "1 0'/>"
        "</joint></robot>");
    folder_.write(
        "s.yaml",
        "time_step: 0.002\nduration: 0.5\n"
        "models: [{urdf: pendulum.urdf, joints: {axis: 0.1}, joint_velocities: {axis: 12}}]\n");
    rows_ = own_motion(folder_, "{}/s.yaml", {"axis.q"}, {"axis.v"});
  }

  /// Mean error of the joint angle [rad].
  double compare(const std::string& recording, const std::string& map) const {
    const CommandResult result = folder_.run("compare {}/s.yaml {}/" + recording + " --columns " +
                                             map + " --json {}/r.json");
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return result.exit_code == 0
               ? folder_.json("r.json")["median"]["joint_error_mean"].get<double>()
               : NAN;
  }
  std::string refusal(const std::string& recording, const std::string& map) const {
    const CommandResult result =
        folder_.run("compare {}/s.yaml {}/" + recording + " --columns " + map);
    EXPECT_EQ(result.exit_code, 2);
    return result.errors;
  }

  CommandFolder folder_{"ros_" + test_name()};
  std::vector<Row> rows_;
};

/// Table in the format of `rostopic echo -p /joint_states`.
std::string rostopic(const std::vector<Row>& rows) {
  std::string csv =
      "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.name0,field.position0,"
      "field.velocity0,"
      "field.effort0\n";
  for (const Row& row : rows)
    csv += fmt::format("{},1,{},,axis,{:.12f},{:.12f},0.0\n", row.nanoseconds + 130000,
                       row.nanoseconds, row.q[0], row.v[0]);
  return csv;
}

TEST_F(PendulumRecording, JointStatesOfRostopicAreReadByTheBundledMap) {
  folder_.write("r.csv", rostopic(rows_));
  EXPECT_LT(compare("r.csv", "data/maps/ros_joint_state.yaml"), kRounding);
}

TEST_F(PendulumRecording, NanosecondsSince1970AreReadAsSuchWithANote) {
  folder_.write("r.csv", rostopic(rows_));
  folder_.write(
      "map.yaml",
      "time: field.header.stamp\ncolumns: {axis.q: field.position0, axis.v: field.velocity0}\n");
  const CommandResult result =
      folder_.run("compare {}/s.yaml {}/r.csv --columns {}/map.yaml --json {}/r.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_LT(folder_.json("r.json")["median"]["joint_error_mean"].get<double>(), kRounding);
  EXPECT_NE(result.errors.find("note: "), std::string::npos);
  EXPECT_NE(result.errors.find("read as nanoseconds since 1970"), std::string::npos)
      << result.errors;
  EXPECT_NE(result.errors.find("time: {column: field.header.stamp, scale: 1e-09}"),
            std::string::npos)
      << result.errors;
}

TEST_F(PendulumRecording, OtherTimesThatCannotBeSecondsAreRefusedWithACure) {
  folder_.write("map.yaml", "time: t\ncolumns: {axis.q: q, axis.v: v}\n");
  // Nanoseconds of a clock that starts with the recording or with the machine; microseconds of such
  // a clock.
  for (const auto& [start, unit, words] : {std::tuple{0.0, 1e9, "scale: 1e-9"},
                                           {5e12, 1e9, "scale: 1e-9"},
                                           {0.0, 1e7, "time: {column"}}) {
    std::string csv = "t,q,v\n";
    for (std::size_t k = 0; k < rows_.size(); ++k)
      csv += fmt::format("{:.0f},{},{}\n", start + unit * kInterval * static_cast<double>(k),
                         rows_[k].q[0], rows_[k].v[0]);
    folder_.write("r.csv", csv);
    EXPECT_NE(refusal("r.csv", "{}/map.yaml").find(words), std::string::npos)
        << start << " " << unit;
  }
}

TEST_F(PendulumRecording, ColumnsThatAreNotMappedHoldWhatTheyLike) {
  folder_.write("map.yaml", "time: t\ncolumns: {axis.q: q, axis.v: v}\n");
  // Values that a reader must ignore: text with commas, quotes and line breaks, words, dates, nan,
  // empty cells. Two columns share a name.
  for (const char* other : {"False", "2026-01-01T00:00:00", "nan", "inf", "", "\"a, b\"",
                            "\"he said \"\"no\"\"\"", "\"two\nlines\"", "[1 2]"}) {
    std::string csv = "t,q,\"v\",x,x\n";
    for (const Row& row : rows_)
      csv += fmt::format("{:.9f},{:.12f},\"{:.12f}\",{},{}\n",
                         1e-9 * static_cast<double>(row.nanoseconds), row.q[0], row.v[0], other,
                         other);
    folder_.write("r.csv", csv);
    EXPECT_LT(compare("r.csv", "{}/map.yaml"), kRounding) << other;
  }
  folder_.write("x.yaml", "time: t\ncolumns: {axis.q: q, axis.v: flag}\n");
  folder_.write("x.csv", "t,q,flag\n0,0.1,1\n0.01,0.1,True\n");
  EXPECT_NE(
      refusal("x.csv", "{}/x.yaml").find("x.csv:3: column 'flag': 'True' is no finite number"),
      std::string::npos);
  folder_.write("y.csv", "t,q,flag,flag\n0,0.1,1,1\n0.01,0.1,1,1\n");
  EXPECT_NE(refusal("y.csv", "{}/x.yaml").find("'flag' occurs more than once"), std::string::npos);
  folder_.write("z.csv", "t,q,flag\n0,0.1,\"1\n0.01,0.1,1\n");
  EXPECT_NE(refusal("z.csv", "{}/x.yaml").find("z.csv:2: a quoted cell is not closed"),
            std::string::npos);
}

TEST_F(PendulumRecording, TablesOfRos2WithoutAHeaderAreReadByTheBundledMap) {
  std::string csv;
  for (const Row& row : rows_)
    csv += fmt::format("{},{},,axis,{:.12f},{:.12f},0.0\n", row.nanoseconds / 1'000'000'000,
                       row.nanoseconds % 1'000'000'000, row.q[0], row.v[0]);
  folder_.write("r.csv", csv);
  EXPECT_LT(compare("r.csv", "data/maps/ros2_joint_state.yaml"), kRounding);
  folder_.write("map.yaml", "time: sec\ncolumns: {axis.q: position0}\n");
  EXPECT_NE(refusal("r.csv", "{}/map.yaml").find("names"), std::string::npos)
      << "does not name the way on";
}

/// A bag with sensor_msgs/JointState, its optional content, and another topic.
McapBag bag_of(const std::vector<Row>& rows, const std::vector<std::string>& names) {
  McapBag bag;
  bag.schema(
      1, "sensor_msgs/msg/JointState",
      "# comment\nstd_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
      "float64[] effort\n"
      "================================================================================\nMSG: "
      "std_msgs/Header\n"
      "builtin_interfaces/Time stamp\nstring frame_id\n"
      "================================================================================\n"
      "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
  bag.schema(2, "std_msgs/msg/Bool", "bool data\n");
  bag.channel(1, 1, "/joint_states");
  bag.channel(2, 2, "/estop");
  for (const Row& row : rows) {
    RosMessage message;
    message.number<std::int32_t>(row.nanoseconds / 1000000000);
    message.number<std::uint32_t>(row.nanoseconds % 1'000'000'000);
    message.string("");
    message.number<std::uint32_t>(names.size());
    for (const std::string& name : names) message.string(name);
    for (const std::vector<double>* list : {&row.q, &row.v, &row.u}) {
      message.number<std::uint32_t>(list->size());
      for (const double x : *list) message.number<double>(x);
    }
    bag.message(1, row.nanoseconds + 130000, message);
    bag.message(2, row.nanoseconds, RosMessage().number<std::uint8_t>(1));
  }
  return bag;
}

TEST_F(PendulumRecording, BagsOfRos2AreReadByTheBundledMap) {
  for (Row& row : rows_) row.u = {0.0};
  folder_.write("r.mcap", bag_of(rows_, {"axis"}).file());
  EXPECT_LT(compare("r.mcap", "data/maps/ros_joint_state.yaml"), kRounding);
  folder_.write(
      "map.yaml",
      "time: field.header.stamp\ncolumns: {axis.q: field.position0, axis.v: field.velocity0}\n");
  EXPECT_NE(refusal("r.mcap", "{}/map.yaml").find("several topics: /joint_states, /estop"),
            std::string::npos);
  folder_.write("map.yaml",
                "topic: /joint_states\ntime: field.header.stamp\ncolumns: {axis.q: field.name0}\n");
  EXPECT_NE(refusal("r.mcap", "{}/map.yaml").find("'axis' is no finite number"), std::string::npos);
}

TEST_F(PendulumRecording, BagsWhoseJointsChangePlacesAreRefused) {
  std::vector<Row> two(rows_.begin(), rows_.begin() + 2);
  for (Row& row : two) row.u = {0.0};
  McapBag bag = bag_of({two[0]}, {"axis"});
  bag.append(bag_of({two[1]}, {"other"}));
  folder_.write("r.mcap", bag.file());
  EXPECT_NE(refusal("r.mcap", "data/maps/ros_joint_state.yaml")
                .find("field.name0 'other' where the first message"),
            std::string::npos);
}

TEST_F(PendulumRecording, AnglesThatComeRoundCompareOnTheCircle) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  ASSERT_GT(rows_.back().q[0], std::numbers::pi) << "it does not go over the top";
  const auto recording = [&](auto wrap) {
    std::string csv = "t,q,v\n";
    for (std::size_t k = 0; k < rows_.size(); ++k)
      csv += fmt::format("{:.9f},{:.12f},{:.12f}\n", kInterval * static_cast<double>(k),
                         wrap(rows_[k].q[0]), rows_[k].v[0]);
    return csv;
  };
  folder_.write("counted.csv", recording([](double q) { return q; }));
  folder_.write("half.csv", recording([&](double q) { return std::remainder(q, kTurn); }));
  folder_.write("whole.csv",
                recording([&](double q) { return q - kTurn * std::floor(q / kTurn); }));
  for (const int average : {1, 5}) {
    folder_.write(
        "map.yaml",
        fmt::format("time: t\naverage: {}\ncolumns: {{axis.q: q, axis.v: v}}\n", average));
    const double counted = compare("counted.csv", "{}/map.yaml");
    EXPECT_LT(counted, 0.1);
    // The angles agree modulo whole turns, to the twelve digits written and their growth.
    for (const char* wrapped : {"half.csv", "whole.csv"})
      EXPECT_NEAR(compare(wrapped, "{}/map.yaml"), counted, 1e-8) << wrapped << " " << average;
  }
}

/// A recording of the bundled cube, thrown.
class CubeRecording : public testing::Test {
 protected:
  void SetUp() override {
    rows_ = own_motion(folder_, "data/scenes/cube_drop.yaml",
                       {"cube.x", "cube.y", "cube.z", "cube.qw", "cube.qx", "cube.qy", "cube.qz"},
                       {"cube.vx", "cube.vy", "cube.vz", "cube.wx", "cube.wy", "cube.wz"});
    rows_.resize(20);  // until it reaches the ground
  }
  double compare(const std::string& recording, const std::string& map) const {
    const CommandResult result = folder_.run("compare data/scenes/cube_drop.yaml {}/" + recording +
                                             " --columns " + map + " --json {}/r.json");
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    if (result.exit_code != 0) return NAN;
    const nlohmann::json median = folder_.json("r.json")["median"];
    return std::max(median["position_error_mean_m"].get<double>(),
                    median["rotation_error_mean_deg"].get<double>());
  }
  CommandFolder folder_{"ros_" + test_name()};
  std::vector<Row> rows_;
};

/// Returns R' v for the quaternion (w, x, y, z) in q[3..6].
std::vector<double> in_body_axes(const std::vector<double>& q, const std::vector<double>& v) {
  const Quaternion orientation(q[3], q[4], q[5], q[6]);
  const Vector3 turned = orientation.conjugate() * Vector3(v[0], v[1], v[2]);
  return {turned.x(), turned.y(), turned.z()};
}

TEST_F(CubeRecording, OdometryIsReadByTheBundledMapAndItsTwistIsOfTheBody) {
  std::string csv = "%time,field.header.stamp,field.header.frame_id,field.child_frame_id";
  for (const char* part :
       {"pose.pose.position.x", "pose.pose.position.y", "pose.pose.position.z",
        "pose.pose.orientation.x", "pose.pose.orientation.y", "pose.pose.orientation.z",
        "pose.pose.orientation.w", "twist.twist.linear.x", "twist.twist.linear.y",
        "twist.twist.linear.z", "twist.twist.angular.x", "twist.twist.angular.y",
        "twist.twist.angular.z"})
    csv += std::string(",field.") + part;
  csv += '\n';
  for (const Row& row : rows_) {
    const std::vector<double>& q = row.q;
    const std::vector<double> v = in_body_axes(q, row.v);
    csv += fmt::format("{0},{0},odom,cube", row.nanoseconds);
    for (const double x :
         {q[0], q[1], q[2], q[4], q[5], q[6], q[3], v[0], v[1], v[2], row.v[3], row.v[4], row.v[5]})
      csv += fmt::format(",{:.12f}", x);
    csv += '\n';
  }
  folder_.write("r.csv", csv);
  EXPECT_LT(compare("r.csv", "data/maps/ros_odometry.yaml"), kRounding);
}

TEST_F(CubeRecording, TransformsOfOneFrameAreChosenByTheBundledMap) {
  std::string csv =
      "%time,field.transforms0.header.stamp,field.transforms0.header.frame_id,field.transforms0."
      "child_frame_id,"
      "field.transforms0.transform.translation.x,field.transforms0.transform.translation.y,"
      "field.transforms0.transform.translation.z,field.transforms0.transform.rotation.x,"
      "field.transforms0.transform.rotation.y,field.transforms0.transform.rotation.z,"
      "field.transforms0.transform.rotation.w\n";
  for (const Row& row : rows_) {
    csv +=
        fmt::format("{0},{0},world,camera,9,9,9,0,0,0,1,77,no row of ours\n", row.nanoseconds - 5);
    csv += fmt::format("{0},{0},world,cube", row.nanoseconds);
    for (const int i : {0, 1, 2, 4, 5, 6, 3})
      csv += fmt::format(",{:.12f}", row.q[static_cast<std::size_t>(i)]);
    csv += '\n';
  }
  folder_.write("r.csv", csv);
  // Without velocity columns the scene's initial velocity applies, which is the recorded one.
  EXPECT_LT(compare("r.csv", "data/maps/ros_tf.yaml"), kRounding);
}

TEST_F(CubeRecording, MeansOfQuaternionsOfEitherSignAreThoseOfOne) {
  const std::string header = "t,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz";
  folder_.write("map.yaml", test::free_body_map("average: 5\ntime: t\n", "cube", true));
  const auto recording = [&](bool flip) {
    std::string csv = header + "\n";
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      csv += fmt::format("{}", kInterval * static_cast<double>(k));
      for (std::size_t i = 0; i < 7; ++i)
        csv += fmt::format(",{:.17g}", (flip && i >= 3 && k % 3 == 1 ? -1.0 : 1.0) * rows_[k].q[i]);
      for (const double x : rows_[k].v) csv += fmt::format(",{:.17g}", x);
      csv += '\n';
    }
    return csv;
  };
  folder_.write("one.csv", recording(false));
  folder_.write("either.csv", recording(true));
  EXPECT_EQ(compare("either.csv", "{}/map.yaml"), compare("one.csv", "{}/map.yaml"))
      << "to the bit";
}

}  // namespace
}  // namespace counterpoint::ros_recordings_test
