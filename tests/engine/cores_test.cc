// Number of threads that CPU affinity and control groups (cgroups) grant a process.
#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "counterpoint/engine/batch.h"

namespace counterpoint::cores_test {
namespace {

namespace fs = std::filesystem;

class Cgroup : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / ("counterpoint_cgroup_" + std::to_string(getpid()));
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }
  void write(const std::string& file, const std::string& text) const {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }
  fs::path root_;
};

TEST_F(Cgroup, Version2TheTightestOfAllGroupsAbove) {
  write("job/cpu.max", "250000 100000\n");
  write("job/task/cpu.max", "max 100000\n");
  EXPECT_DOUBLE_EQ(cgroup_cores(root_, "0::/job/task\n"), 2.5);
  write("job/task/cpu.max", "150000 100000\n");
  EXPECT_DOUBLE_EQ(cgroup_cores(root_, "0::/job/task\n"), 1.5);
  // A container sees its own group as the root.
  write("cpu.max", "50000 100000\n");
  EXPECT_DOUBLE_EQ(cgroup_cores(root_, "0::/\n"), 0.5);
}

TEST_F(Cgroup, Version1ByItsControllerAlone) {
  write("cpu,cpuacct/job/cpu.cfs_quota_us", "300000\n");
  write("cpu,cpuacct/job/cpu.cfs_period_us", "100000\n");
  EXPECT_DOUBLE_EQ(cgroup_cores(root_, "5:memory:/other\n4:cpu,cpuacct:/job\n"), 3.0);
  EXPECT_TRUE(std::isinf(cgroup_cores(root_, "4:cpuset:/job\n")));
  write("cpu,cpuacct/job/cpu.cfs_quota_us", "-1\n");
  EXPECT_TRUE(std::isinf(cgroup_cores(root_, "4:cpu,cpuacct:/job\n")));
}

TEST_F(Cgroup, NoLimitIsInfinite) {
  EXPECT_TRUE(std::isinf(cgroup_cores(root_, "0::/job\n")));
  EXPECT_TRUE(std::isinf(cgroup_cores(root_, "")));
}

TEST(Cores, FollowTheAffinity) {
  cpu_set_t before;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  const std::vector<int> all = affinity_cores();
  EXPECT_EQ(static_cast<int>(all.size()), CPU_COUNT(&before));
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(all.back(), &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  EXPECT_EQ(affinity_cores(), std::vector<int>{all.back()});
  EXPECT_EQ(available_cores(), 1);
  EXPECT_EQ(Batch(scene_of(ModelBuilder().build())).num_threads(), 1);
  ASSERT_EQ(sched_setaffinity(0, sizeof before, &before), 0);
}

}  // namespace
}  // namespace counterpoint::cores_test
