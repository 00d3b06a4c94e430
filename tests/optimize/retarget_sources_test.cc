// Motions to follow, given as points over time: links of a robot, joints of a BVH file, markers.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/control/normal.h"
#include "counterpoint/engine/optimize/reference.h"
#include "counterpoint/engine/optimize/retarget.h"
#include "counterpoint/engine/trajectory.h"
#include "engine/io/c3d_file.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::optimization::retarget_sources_test {
namespace {

std::filesystem::path data() { return std::filesystem::path(test::source_dir()) / "data"; }
std::filesystem::path humanoid() { return data() / "scenes/optimize/scenes/humanoid.yaml"; }

/// Frames of the humanoid 0.05 s apart that bend and turn all of its joints.
std::vector<VectorX> bending(const Scene& scene) {
  std::vector<VectorX> q(6, scene.q);
  const Eigen::Index nv = scene.model.nv();
  for (std::size_t t = 0; t < q.size(); ++t) {
    const VectorX change = VectorX::LinSpaced(nv, -0.3, 0.4) * std::sin(1.0 + 0.5 * double(t));
    integrate_configuration(scene.model, scene.q, change, 1.0, q[t]);
  }
  return q;
}

/// A problem of the humanoid whose fit has these entries below `fit`.
std::string problem(const std::string& retarget, const std::string& fit, int steps = 5,
                    double h = 0.05) {
  return fmt::format(
      "scene: {}\ntime_step: {}\nsteps: {}\nretarget:\n{}  fit:\n{}terms:\n"
      "  - {{quantity: configuration, target: fit}}\n",
      humanoid().string(), h, steps, retarget, fit);
}

/// Links that joints turn, and the floating one.
std::vector<std::string> links_of(const Model& model) {
  std::vector<std::string> links = {"pelvis"};
  for (int i = 1; i < model.num_joints(); ++i) links.push_back(model.joint(i).link);
  return links;
}

Pose pose_of(const Model& model, const VectorX& q, const std::string& link) {
  const Frame& frame = model.frames()[static_cast<std::size_t>(model.find_frame(link))];
  Data poses(model);
  compute_poses(model, q, poses);
  return poses.X_WB[frame.body] * frame.X_BF;
}

/// Largest root mean square of a coordinate's deviation.
double largest(const Model& model, const std::vector<VectorX>& a, const std::vector<VectorX>& b) {
  return rms_deviation(model, a, b).maxCoeff();
}

// The figure of the file has the build of the humanoid, and moves as turning_jump.csv says. The
// file rounds angles to 1e-6 rad, of which at most six add up in a coordinate.
TEST(RetargetSources, AMotionWrittenAsBvhComesBack) {
  const ProblemFile drawn = load_problem(data() / "scenes/retarget/turning_jump.yaml");
  const std::vector<VectorX>& wanted = drawn.retargeting->fit.terms[0].targets;
  ProblemFile file = load_problem(data() / "scenes/retarget/jump_bvh.yaml");
  auto only_points = std::make_shared<Retargeting>(*file.retargeting);
  std::erase_if(only_points->fit.terms, [](const Term& t) { return t.reference == nullptr; });
  ASSERT_EQ(only_points->fit.terms.size(), 3u + 13u);
  file.retargeting = only_points;
  EXPECT_LT(largest(*drawn.problem.model, wanted, fit_motion(file).q), 6e-6);
}

/// Writes the links as points of a figure whose joints are at rest in a posture of the humanoid,
/// in mm, with y up and x ahead; returns the table.
std::string figure(const Scene& scene, const std::vector<VectorX>& q, const VectorX& posture) {
  Matrix3 to_world;  // the world's x, y, z are the file's x, -z, y
  to_world << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  std::string text = "time";
  for (const std::string& link : links_of(scene.model))
    text += fmt::format(",{0}.x,{0}.y,{0}.z,{0}.qw,{0}.qx,{0}.qy,{0}.qz", link);
  for (std::size_t t = 0; t < q.size(); ++t) {
    text += fmt::format("\n{}", 0.05 * double(t));
    for (const std::string& link : links_of(scene.model)) {
      const Pose at = pose_of(scene.model, q[t], link);
      const Matrix3 rest = pose_of(scene.model, posture, link).rotation;
      const Vector3 x = 1000.0 * to_world.transpose() * at.translation;
      const Quaternion turn(
          Matrix3(to_world.transpose() * at.rotation * rest.transpose() * to_world));
      for (const double value : {x[0], x[1], x[2], turn.w(), turn.x(), turn.y(), turn.z()})
        text += fmt::format(",{:.17g}", value);
    }
  }
  return text + "\n";
}

// Unit, axes and posture at rest of a figure are undone: orientations determine the joints.
TEST(RetargetSources, AFigureWithOtherAxesUnitAndRestComesBack) {
  const Scene scene = load_scene(humanoid());
  const std::vector<VectorX> q = bending(scene);
  VectorX change = VectorX::Zero(scene.model.nv()), posture = scene.q;
  change.tail(scene.model.nv() - 6).setLinSpaced(0.5, -0.4);
  integrate_configuration(scene.model, scene.q, change, 1.0, posture);
  const CoordinateNames names = coordinate_names(scene.model);
  std::string joints;
  for (Eigen::Index i = 7; i < scene.model.nq(); ++i)
    joints += fmt::format("{}{}: {:.17g}", i == 7 ? "" : ", ", names.q[std::size_t(i)], posture[i]);
  const test::TempFolder folder;
  folder.write("figure.csv", figure(scene, q, posture));
  std::string map;
  for (const std::string& link : links_of(scene.model)) map += "    " + link + ": " + link + "\n";
  ProblemFile file = load_problem(folder.write(
      "p.yaml", problem("  motion: figure.csv\n  points: true\n  unit: mm\n  axes: [x, -z, y]\n"
                        "  posture: {" +
                            joints + "}\n  map:\n" + map,
                        "    - {quantity: position, sources: pelvis}\n"
                        "    - {quantity: orientation, sources: \"*\"}\n")));
  // Gauss-Newton ends where a step gains 1e-5 of the cost; its last steps converge quadratically.
  EXPECT_LT(largest(scene.model, q, fit_motion(file).q), 1e-8);
}

/// Places of three markers on each link, 0.1 m from its origin, as the table of a map.
std::string marker_places(const Model& model) {
  std::string text = "marker,link,x,y,z\n";
  for (const std::string& link : links_of(model))
    text += fmt::format("{0}1,{0},0.1,0,0\n{0}2,{0},0,0.1,0\n{0}3,{0},0,0,0.1\n", link);
  return text;
}

/// Calls use(frame, marker, place, seen) for the markers of a motion with errors of this standard
/// deviation [m]; a fifth of them is not seen.
void for_each_marker(
    const Scene& scene, const std::vector<VectorX>& q, double deviation,
    const std::function<void(std::size_t, const std::string&, const Vector3&, bool)>& use) {
  NormalNumbers normal(7);
  for (std::size_t t = 0; t < q.size(); ++t) {
    std::size_t count = 0;
    for (const std::string& link : links_of(scene.model)) {
      const Pose at = pose_of(scene.model, q[t], link);
      for (int k = 0; k < 3; ++k, ++count) {
        Vector3 x = at * (0.1 * Vector3::Unit(k));
        for (int i = 0; i < 3; ++i) x[i] += deviation * normal();
        use(t, fmt::format("{}{}", link, k + 1), x, (count + 3 * t) % 5 != 0);
      }
    }
  }
}

/// Returns the fit of the humanoid to a file of markers.
std::vector<VectorX> fit_markers(const test::TempFolder& folder, const Scene& scene,
                                 const std::string& motion) {
  folder.write("places.csv", marker_places(scene.model));
  ProblemFile file = load_problem(folder.write(
      "p.yaml", problem("  motion: " + motion + "\n  map: places.csv\n",
                        "    - {quantity: position, name: markers, sources: \"*\"}\n")));
  return fit_motion(file).q;
}

std::vector<VectorX> fit_marker_table(const Scene& scene, const std::vector<VectorX>& q,
                                      double deviation) {
  std::string header = "time", rows;
  for_each_marker(scene, q, deviation,
                  [&](std::size_t t, const std::string& marker, const Vector3& x, bool seen) {
                    if (t == 0) header += fmt::format(",{0}.x,{0}.y,{0}.z", marker);
                    if (marker == "pelvis1") rows += fmt::format("\n{}", 0.05 * double(t));
                    rows += seen ? fmt::format(",{:.17g},{:.17g},{:.17g}", x[0], x[1], x[2])
                                 : std::string(t % 2 == 0 ? ",,," : ",nan,nan,nan");
                  });
  const test::TempFolder folder;
  folder.write("markers.csv", header + rows + "\n");
  return fit_markers(folder, scene, "markers.csv\n  points: true");
}

// Gaps weigh nothing: the markers that are seen determine the motion, of which nothing is missing.
TEST(RetargetSources, MarkersWithGapsGiveTheMotion) {
  const Scene scene = load_scene(humanoid());
  const std::vector<VectorX> q = bending(scene);
  EXPECT_LT(largest(scene.model, q, fit_marker_table(scene, q, 0.0)), 1e-8);
}

// Errors of 1 mm turn a link whose two markers beside its axis are 0.1 m from it by 7 mrad, and
// its parent's error adds: 10 mrad with all markers, 13 mrad where one of the two is not seen.
TEST(RetargetSources, NoisyMarkersGiveTheMotionWithinTheirErrors) {
  const Scene scene = load_scene(humanoid());
  const std::vector<VectorX> q = bending(scene);
  const VectorX off = rms_deviation(scene.model, q, fit_marker_table(scene, q, 1e-3));
  const double rms = off.norm() / std::sqrt(static_cast<double>(off.size()));
  EXPECT_LT(rms, 0.013);
  EXPECT_GT(rms, 1e-3) << "there was no noise";
}

// In C3D files a marker that was not seen is at zero or has a negative residual. The reals of the
// file round places to 1e-7 m, angles at 0.1 m to 1e-6 rad.
TEST(RetargetSources, MarkersOfC3dFilesMayHaveGaps) {
  const Scene scene = load_scene(humanoid());
  const std::vector<VectorX> q = bending(scene);
  test::C3dFile c3d;
  c3d.rate = 20.0;
  c3d.last = static_cast<int>(q.size());
  std::vector<std::string> labels;
  for_each_marker(scene, q, 0.0,
                  [&](std::size_t t, const std::string& marker, const Vector3& x, bool seen) {
                    if (t == 0) labels.push_back(marker);
                    const Vector3 mm = seen || t % 2 == 0 ? Vector3(1000.0 * x) : Vector3::Zero();
                    c3d.point(mm[0], mm[1], mm[2], seen ? 0.0 : -1.0 * double(t % 2 == 0));
                  });
  c3d.points = static_cast<int>(labels.size());
  c3d.group(1, "POINT");
  c3d.texts(1, "LABELS", labels, 20);
  c3d.text(1, "UNITS", "mm");
  const test::TempFolder folder;
  folder.write("markers.c3d", c3d.bytes());
  EXPECT_LT(largest(scene.model, q, fit_markers(folder, scene, "markers.c3d")), 1e-5);
}

// Lengths from another point of the motion are scaled on their own, then all with the motion.
TEST(RetargetSources, LengthsOfLimbsMayBeScaled) {
  const Scene scene = load_scene(humanoid());
  const std::vector<VectorX> q = bending(scene);
  VectorX rest = scene.q;
  const test::TempFolder folder;
  folder.write("figure.csv", figure(scene, q, rest));
  const ProblemFile file = load_problem(folder.write(
      "p.yaml",
      problem("  motion: figure.csv\n  points: true\n  unit: mm\n  axes: [x, -z, y]\n"
              "  scale: 0.8\n  ground: 0.1\n  map:\n    left_forearm: {link: left_forearm, "
              "source_point: [0, -0.2, 0], from: chest, scale: 1.5}\n",
              "    - {quantity: position, sources: left_forearm}\n")));
  for (std::size_t t = 0; t < q.size(); ++t) {
    const Vector3 from = pose_of(scene.model, q[t], "chest").translation;
    // The axes of a joint at rest are those of the file, whose -y points down.
    const Pose arm = pose_of(scene.model, q[t], "left_forearm");
    const Matrix3 turn =
        arm.rotation * pose_of(scene.model, rest, "left_forearm").rotation.transpose();
    const Vector3 tip = arm.translation + turn * Vector3(0, 0, -0.2);
    const Vector3 wanted = 0.8 * (from + 1.5 * (tip - from) - 0.1 * Vector3::UnitZ());
    EXPECT_LT((file.retargeting->fit.terms[0].targets[t] - wanted).norm(), 1e-12);
  }
}

// A smaller robot, whose root looks back, is followed to 1 mm by the soles and 5 mm by the pelvis,
// and to 2 and 3 degrees by trunk and limbs, whose joints differ from the humanoid's.
TEST(RetargetSources, AnotherRobotsLinksAreFollowed) {
  const std::filesystem::path icub = std::filesystem::path(test::shared_data()) / "icub_walk";
  if (!std::filesystem::exists(icub)) GTEST_SKIP() << icub << " is missing";
  ProblemFile file = load_problem(data() / "scenes/retarget/icub_walk.yaml", {},
                                  {icub / "recording_raw.csv", icub / "scene.yaml"});
  const Fit fit = fit_motion(file);
  const std::map<std::string, double> bounds = {
      {"hips", 5e-3}, {"soles", 1e-3}, {"trunk", 0.035}, {"legs", 0.052}, {"arms", 0.052}};
  ASSERT_EQ(fit.errors.size(), bounds.size());
  for (const FitError& error : fit.errors) EXPECT_LT(error.rms, bounds.at(error.name));
}

TEST(RetargetSources, RefusalsSayWhatIsMissing) {
  const test::TempFolder folder;
  folder.write("p.csv", "time,a.x,a.y,a.z,b.x,b.y,b.z\n0,1,2,3,,,\n0.1,1,2,3,,,\n");
  folder.write("half.csv", "time,a.x,a.y,a.z\n0,1,,3\n");
  folder.write("places.csv", "marker,link,x,y,z\na,pelvis,0,0,0\nb,tail,0,0,0\n");
  folder.write("fixed.yaml", "models:\n  - {urdf: " + (data() / "robots/humanoid.urdf").string() +
                                 ", base: fixed}\n");
  const std::filesystem::path walk = data() / "scenes/retarget/turning_jump.csv";
  const std::string bvh = (data() / "scenes/retarget/jump_bvh.bvh").string();
  const std::string fit = "    - {quantity: position, sources: a}\n";
  const std::string csv = "  motion: p.csv\n  points: true\n", map = "  map: {a: pelvis}\n";
  const struct {
    std::string retarget, fit, expected;
  } cases[] = {
      {"  motion: " + bvh + "\n" + map, fit, "'unit' is missing: BVH files do not say theirs"},
      {"  motion: " + bvh + "\n  unit: cm\n" + map, fit, "'axes' is missing"},
      {"  motion: " + bvh + "\n  unit: cm\n  axes: [x, y, z]\n  scene: x.yaml\n" + map, fit,
       "neither a 'scene'"},
      {"  motion: " + bvh + "\n  unit: ell\n  axes: [x, y, z]\n" + map, fit,
       "p.yaml:6: retarget.unit: mm, cm, m, or the number"},
      {"  motion: " + bvh + "\n  unit: cm\n  axes: [x, z]\n" + map, fit, "expected the axes of"},
      {"  motion: " + bvh + "\n  unit: cm\n  axes: [x, z, y]\n" + map, fit, "a mirror image"},
      {"  motion: " + bvh + "\n  unit: cm\n  axes: [z, x, y]\n" + map, fit,
       "there are: Hips, Ches"},
      {"  motion: walk.trc\n  unit: mm\n" + map, fit, "the file says its unit"},
      {"  motion: p.csv\n  unit: mm\n" + map, fit, "'unit' is of 'points'"},
      {csv, fit, "no 'a' in the map of 'retarget'"},
      {csv + "  map: {a: tail}\n", fit, "the scene has no link 'tail'"},
      {csv + "  map: {a: {link: pelvis, from: b}}\n", fit, "'from' and 'scale' belong together"},
      {csv + "  map: {a: {link: pelvis, source_point: [1, 0, 0]}}\n", fit, "without axes"},
      {csv + "  map: {b: pelvis}\n", "    - {quantity: position, sources: b}\n", "at no time"},
      {csv + "  map: places.csv\n", fit, "places.csv:3: the scene has no link 'tail'"},
      {csv + map, "    - {quantity: orientation, sources: a}\n", "'a' has no orientation"},
      {csv + map, "    - {quantity: velocity, sources: a}\n", "is of coordinates, not of a link"},
      {csv + map, "    - {quantity: position, sources: a, link: chest}\n", "are in their map"},
      {csv + map, "    - {quantity: configuration, target: source}\n", "no or other coordinates"},
      {"  motion: " + walk.string() + "\n  scene: fixed.yaml\n", fit,
       "moves 'pelvis', which is fixed in the motion's scene"},
      {"  motion: half.csv\n  points: true\n" + map, fit, "half.csv:2: 'a' has some of its"},
  };
  for (const auto& c : cases) {
    std::string message;
    try {
      load_problem(folder.write("p.yaml", problem(c.retarget, c.fit)));
    } catch (const InputError& error) {
      message = error.what();
    }
    EXPECT_NE(message.find(c.expected), std::string::npos) << c.retarget << "gave: " << message;
  }
}

}  // namespace
}  // namespace counterpoint::optimization::retarget_sources_test
