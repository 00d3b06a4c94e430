// Trajectory and CSV files are read back bit for bit; errors name the place in the file.
#include "counterpoint/engine/trajectory.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "counterpoint/model/model_builder.h"
#include "support/random_model.h"

namespace counterpoint::trajectory_test {
namespace {

namespace fs = std::filesystem;

class TrajectoryFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ =
        fs::path(testing::TempDir()) / ("counterpoint_trajectory_" + std::string(info->name()));
    fs::create_directories(folder_);
    file_ = folder_ / "t.csv";
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& text) const { std::ofstream(file_, std::ios::binary) << text; }
  std::string content() const {
    std::ifstream stream(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  /// Returns the message of the InputError that `action` throws; empty if it throws none.
  template <class Action>
  static std::string message_of(Action action) {
    try {
      action();
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }
  void expect_message(const std::string& text, const std::string& part) const {
    write(text);
    // Cells and names are checked when they are read.
    const std::string message = message_of([&] {
      const Table table(file_);
      for (const std::string& name : table.columns()) {
        const int column = table.column(name);
        for (int row = 0; row < table.num_rows(); ++row) table.cell(row, column);
      }
    });
    EXPECT_NE(message.find(part), std::string::npos) << "got: " << message;
  }

  fs::path folder_, file_;
};

/// One robot with a chain of every joint type: planar, spherical, revolute, prismatic.
Model every_joint_type() {
  RobotSpec robot;
  robot.name = "zoo";
  const auto add_link = [&](const std::string& name) {
    LinkSpec link;
    link.name = name;
    link.inertia = {1.0, Vector3::Zero(), 0.01 * Matrix3::Identity()};
    robot.links.push_back(link);
  };
  const auto add_joint = [&](const std::string& name, JointType type, const std::string& parent,
                             const std::string& child) {
    JointSpec joint;
    joint.name = name;
    joint.type = type;
    joint.parent = parent;
    joint.child = child;
    joint.axis = Vector3::UnitZ();
    robot.joints.push_back(joint);
  };
  for (const char* name : {"base", "plate", "ball", "arm, left", "slider"}) add_link(name);
  add_joint("slide_on", JointType::kPlanar, "base", "plate");
  add_joint("socket", JointType::kSpherical, "plate", "ball");
  add_joint("turn \"it\", now", JointType::kRevolute, "ball", "arm, left");
  add_joint("push", JointType::kPrismatic, "arm, left", "slider");
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFloating, Pose());
  return builder.build();
}

const std::vector<std::string> kNamesQ = {
    "base.x",  "base.y",  "base.z",  "base.qw", "base.qx",
    "base.qy", "base.qz", "plate.x", "plate.y", "plate.angle",
    "ball.qw", "ball.qx", "ball.qy", "ball.qz", "turn \"it\", now.q",
    "push.q"};
const std::vector<std::string> kNamesV = {"base.vx",
                                          "base.vy",
                                          "base.vz",
                                          "base.wx",
                                          "base.wy",
                                          "base.wz",
                                          "plate.vx",
                                          "plate.vy",
                                          "plate.w",
                                          "ball.wx",
                                          "ball.wy",
                                          "ball.wz",
                                          "turn \"it\", now.v",
                                          "push.v"};
const std::vector<std::string> kNamesForce = {"base.fx",
                                              "base.fy",
                                              "base.fz",
                                              "base.tx",
                                              "base.ty",
                                              "base.tz",
                                              "plate.fx",
                                              "plate.fy",
                                              "plate.tz",
                                              "ball.tx",
                                              "ball.ty",
                                              "ball.tz",
                                              "turn \"it\", now.u",
                                              "push.u"};

TEST_F(TrajectoryFile, NamesEveryCoordinate) {
  const CoordinateNames names = coordinate_names(every_joint_type());
  EXPECT_EQ(names.q, kNamesQ);
  EXPECT_EQ(names.v, kNamesV);
  EXPECT_EQ(names.force, kNamesForce);
}

bool same_bits(const VectorX& a, const VectorX& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

TEST_F(TrajectoryFile, ReadsBackTheSameBits) {
  const Model model = every_joint_type();
  constexpr int kSteps = 20;
  std::vector<State> states;
  std::vector<VectorX> forces;
  double time = 0.0;
  const double step = 0.1;  // not a finite binary fraction
  {
    TrajectoryWriter writer(file_, model);
    for (int k = 0; k <= kSteps; ++k) {
      states.push_back({time, test::random_configuration(model, k),
                        test::random_vector(model.nv(), 100 + k, std::pow(10.0, k - 10))});
      forces.push_back(test::random_vector(model.nv(), 200 + k, 1e-300 * (k + 1)));
      time += step;
      if (k < kSteps) writer.write_step(states[k], {forces[k], {}, {}, {}}, step);
    }
    writer.write_end(states[kSteps]);
  }
  const Trajectory read = read_trajectory(file_, model);
  ASSERT_EQ(read.num_rows(), kSteps + 1);
  ASSERT_EQ(read.applied_force.cols(), kSteps);
  for (int k = 0; k <= kSteps; ++k) {
    EXPECT_EQ(read.time[k], states[k].time);
    EXPECT_TRUE(same_bits(read.q.col(k), states[k].q)) << k;
    EXPECT_TRUE(same_bits(read.v.col(k), states[k].v)) << k;
    if (k < kSteps) {
      EXPECT_TRUE(same_bits(read.applied_force.col(k), forces[k])) << k;
      EXPECT_EQ(read.time_step[k], step);
    }
  }
  const std::vector<double> lengths = step_lengths(read, std::nullopt, 999.0);
  for (const double length : lengths) EXPECT_EQ(length, step);
  EXPECT_NE(message_of([&] { step_lengths(read, 0.2, 999.0); }).find("0.2"), std::string::npos);
}

TEST_F(TrajectoryFile, KeepsTheSofteningOfEachStep) {
  const Model model = every_joint_type();
  const Softening given[] = {{}, {8.0, 0}, {-32768.0, -1}};
  {
    TrajectoryWriter writer(file_, model);
    State state{0.0, test::random_configuration(model, 1), VectorX::Zero(model.nv())};
    for (const Softening& softening : given) {
      writer.write_step(state, Input(), 0.1, softening);
      state.time += 0.1;
    }
    writer.write_end(state);
  }
  const Trajectory read = read_trajectory(file_, model);
  ASSERT_EQ(read.softening.size(), 3u);
  Input known;
  for (int k = 0; k < 3; ++k) {
    read.set_known(model, k, known);
    EXPECT_EQ(known.softening, given[k]) << k;
  }
}

TEST_F(TrajectoryFile, RefusesASofteningThatIsNone) {
  const Model model = every_joint_type();
  const State state{0.0, test::random_configuration(model, 1), VectorX::Zero(model.nv())};
  for (const Softening& wrong : {Softening{0.5, 0}, Softening{2.0, 1000}, Softening{2.0, -2}}) {
    {
      TrajectoryWriter writer(file_, model);
      writer.write_step(state, Input(), 0.1, wrong);
      writer.write_end({0.1, state.q, state.v});
    }
    EXPECT_NE(message_of([&] { read_trajectory(file_, model); }).find("soften"), std::string::npos)
        << wrong.factor;
  }
}

TEST_F(TrajectoryFile, KeepsWhatWasWrittenBeforeAnEndWithoutLastRow) {
  const Model model = every_joint_type();
  const State state{0.0, test::random_configuration(model, 1), VectorX::Zero(model.nv())};
  { TrajectoryWriter(file_, model).write_step(state, Input(), 0.01); }
  EXPECT_EQ(read_trajectory(file_, model).num_rows(), 1);
}

/// A model of one revolute joint "j", for files written by hand.
Model one_joint() {
  RobotSpec robot;
  robot.name = "one";
  for (const char* name : {"a", "b"}) {
    LinkSpec link;
    link.name = name;
    link.inertia = {1.0, Vector3::Zero(), Matrix3::Identity()};
    robot.links.push_back(link);
  }
  JointSpec joint;
  joint.name = "j";
  joint.parent = "a";
  joint.child = "b";
  robot.joints.push_back(joint);
  ModelBuilder builder;
  builder.add_robot(robot, Base::kFixed, Pose());
  return builder.build();
}

TEST_F(TrajectoryFile, TakesColumnsInAnyOrderAndWithoutForcesOrSteps) {
  const Model model = one_joint();
  write("j.v,time,j.q\r\n1,0,0.25\r\n2,0.5,0.5\r\n");
  const Trajectory read = read_trajectory(file_, model);
  EXPECT_EQ(read.q(0, 1), 0.5);
  EXPECT_EQ(read.v(0, 0), 1.0);
  EXPECT_EQ(read.applied_force.size(), 0);
  EXPECT_EQ(step_lengths(read, std::nullopt, 0.5), std::vector<double>{0.5});
  EXPECT_EQ(step_lengths(read, 0.5, 0.1), std::vector<double>{0.5});
  const std::string message = message_of([&] { step_lengths(read, std::nullopt, 0.1); });
  EXPECT_NE(message.find("--timestep"), std::string::npos) << message;
}

TEST_F(TrajectoryFile, SaysWhereATrajectoryIsWrong) {
  const Model model = one_joint();
  const auto expect = [&](const std::string& text, const std::string& part) {
    write(text);
    const std::string message = message_of([&] { read_trajectory(file_, model); });
    EXPECT_NE(message.find(part), std::string::npos) << "got: " << message;
  };
  expect("time,j.q\n0,1\n", "no column 'j.v'");
  expect("time,j.q,j.v,k.q\n0,1,1,1\n", "'k.q' is no coordinate");
  expect("time,j.q,j.v\n0,1,1\n0,1,1\n", "t.csv:3: time 0 does not rise");
  expect("time,j.q,j.v\n0,1,\n", "t.csv:2: column 'j.v' is empty");
  expect("time,j.q,j.v,j.u\n0,1,1,\n1,1,1,\n", "t.csv:2: column 'j.u' is empty");
  expect("time,j.q,j.v\n", "no rows");
}

TEST_F(TrajectoryFile, RefusesQuaternionsThatAreNone) {
  const Model model = every_joint_type();
  State state{0.0, test::random_configuration(model, 1), VectorX::Zero(model.nv())};
  state.q[3] += 0.1;
  { TrajectoryWriter(file_, model).write_end(state); }
  const std::string message = message_of([&] { read_trajectory(file_, model); });
  EXPECT_NE(message.find("t.csv:2: quaternion of 'base'"), std::string::npos) << message;
}

TEST_F(TrajectoryFile, SaysWhereACsvIsWrong) {
  expect_message("", "empty");
  expect_message("\n", "empty");
  expect_message("a,a\n", "'a' occurs more than once");
  expect_message("a,b\n1\n", "t.csv:2: 1 cells; the header names 2");
  expect_message("a,b\n1,2\n\n1,2,3\n", "t.csv:4: more cells");
  expect_message("a,b\n1,2x\n", "t.csv:2: column 'b': '2x'");
  expect_message("a,b\n1,nan\n", "column 'b': 'nan'");
  expect_message("a,b\n1e999,1\n", "column 'a': '1e999'");
  expect_message("a,\"b\n1,1\n", "not closed");
  EXPECT_NE(message_of([&] { Table table(folder_ / "none.csv"); }).find("there is no such file"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              TableWriter writer(folder_ / "no" / "t.csv", {"a"});
            }).find("cannot be created"),
            std::string::npos);
}

TEST_F(TrajectoryFile, QuotesNamesThatNeedIt) {
  {
    TableWriter writer(file_, {{"a,b", CellType::kText}, "c\"d", "e"});
    writer.text("x,y");
    writer.empty();
    writer.number(-0.0);
    writer.end_row();
  }
  EXPECT_EQ(content(), "\"a,b\",\"c\"\"d\",e\n\"x,y\",,-0\n");
  write("\"a,b\",\"c\"\"d\", e \n1,2,+3\n");
  const Table table(file_);
  EXPECT_EQ(table.columns(), (std::vector<std::string>{"a,b", "c\"d", "e"}));
  EXPECT_EQ(table.value(0, 2), 3.0);
}

TEST(ModelHash, TellsPairSurfacesAndIncludedPairsApart) {
  const auto hash_of = [](const auto& change) {
    Shape box;
    box.type = ShapeType::kBox;
    box.size = Vector3(0.1, 0.1, 0.1);
    ModelBuilder builder;
    for (const char* name : {"a/", "b/"})
      builder.add_robot(object_of("box", box, 1.0), Base::kFloating, Pose(), name);
    change(builder);
    return model_hash(builder.build());
  };
  const auto none = hash_of([](ModelBuilder&) {});
  const auto with_friction = [&](double friction) {
    PairSurface surface;
    surface.friction = friction;
    return hash_of(
        [&](ModelBuilder& builder) { builder.set_pair_surface("a/body", "b/body", surface); });
  };
  EXPECT_EQ(none, hash_of([](ModelBuilder&) {}));
  EXPECT_NE(none, with_friction(0.2));
  EXPECT_NE(with_friction(0.2), with_friction(0.3));
  EXPECT_NE(none, hash_of([](ModelBuilder& builder) { builder.include_pair("a/body", "b/body"); }));
}

}  // namespace
}  // namespace counterpoint::trajectory_test
