// Overhead of tasks, alone and under mpirun (docs/measurements/tasks.md):
//   counterpoint_bench_tasks [FOLDER]      overhead of a task, in memory and with journals in
//                                          FOLDER; memory of each rank; tasks of 1 ms over threads
//   mpirun -n 2 counterpoint_bench_tasks   the same over ranks; requests that rank 0 answers
//   counterpoint_bench_tasks scaling       only the tasks of 1 ms, over 2 threads or 2 ranks
#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <filesystem>

#include "tasks/archive.h"
#include "tasks/run_tasks.h"

namespace {

using namespace counterpoint::apps::tasks;
using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

TaskList list_of(std::int64_t count, std::size_t bytes, int work) {
  TaskList list;
  list.name = "bench";
  list.count = count;
  list.make_task = [=]() -> Task {
    return [=](std::int64_t i) {
      double x = static_cast<double>(i);
      for (int k = 0; k < work; ++k) x = std::sin(x);
      std::string out(bytes, '\0');
      if (!out.empty()) out[0] = static_cast<char>(x);
      return Outcome{out, true};
    };
  };
  return list;
}

double seconds_of(World& world, const TaskList& list, int threads,
                  const std::filesystem::path& folder) {
  if (!folder.empty() && world.is_root()) std::filesystem::remove_all(folder);
  broadcast(world, "");
  RunSettings settings;
  settings.threads = threads;
  settings.folder = folder;
  return run_tasks(world, list, settings).seconds;
}

void overhead(World& world, const std::filesystem::path& folder) {
  constexpr std::int64_t kCount = 1'000'000;
  for (const auto& [name, where] :
       {std::pair{"in memory", std::filesystem::path()}, {"with journals", folder}}) {
    if (std::string(name) == "with journals" && folder.empty()) continue;
    const double seconds = seconds_of(world, list_of(kCount, 200, 0), 1, where);
    if (world.is_root())
      fmt::print(
          "overhead of a task, {}, 1 thread a rank: {:.2f} us ({} tasks, 200 bytes each, {} "
          "ranks)\n",
          name, 1e6 * seconds * world.size() / static_cast<double>(kCount), kCount, world.size());
  }
}

/// Rate at which rank 0 answers requests of the other ranks.
void requests(World& world) {
  constexpr int kEach = 100'000;
  if (world.size() == 1) return;
  broadcast(world, "");
  if (!world.is_root()) {
    for (int i = 0; i < kEach; ++i) world.send(0, Channel::kTasks, std::string(40, ' '));
    for (int i = 0; i < kEach; ++i) world.wait(Channel::kTasks);
    return;
  }
  const auto start = Clock::now();
  int left = kEach * (world.size() - 1);
  while (left > 0)
    while (const auto message = world.receive(Channel::kTasks)) {
      world.send(message->from, Channel::kTasks, std::string(25, ' '));
      --left;
    }
  fmt::print("rank 0 answers {:.3g} requests a second, of {} ranks\n",
             kEach * (world.size() - 1) / since(start), world.size() - 1);
}

/// Gathers one number of every rank on rank 0.
std::vector<double> gathered(World& world, double mine) {
  std::vector<double> all(static_cast<std::size_t>(world.size()), mine);
  if (!world.is_root()) world.send(0, Channel::kTogether, to_bytes(mine));
  for (int i = 1; world.is_root() && i < world.size(); ++i) {
    const Message message = world.wait(Channel::kTogether);
    all[static_cast<std::size_t>(message.from)] = from_bytes<double>(message.bytes);
  }
  return all;
}

rusage usage() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  return used;
}

double processor_seconds() {
  const rusage used = usage();
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

/// Peak memory of each rank, after lists of increasing length with results in journals.
void memory(World& world, const std::filesystem::path& folder) {
  if (folder.empty()) return;
  for (const std::int64_t count : {1000, 1'000'000}) {
    seconds_of(world, list_of(count, 1, 0), 1, folder);
    const std::vector<double> most = gathered(world, static_cast<double>(usage().ru_maxrss));
    for (std::size_t i = 0; world.is_root() && i < most.size(); ++i)
      fmt::print("{} tasks: rank {} held {:.1f} MiB at most\n", count, i, most[i] / 1024.0);
  }
}

/// Throughput of tasks of about a millisecond.
void scaling(World& world, int threads) {
  constexpr int kSine = 60'000;
  const double before = processor_seconds();
  const double seconds = seconds_of(world, list_of(4000, 200, kSine), threads, {});
  double processor = 0.0;
  for (const double mine : gathered(world, processor_seconds() - before)) processor += mine;
  if (world.is_root())
    fmt::print(
        "{} rank(s) of {} thread(s): 4000 tasks in {:.3f} s, {:.4g} a second; {:.3f} s of "
        "processor time\n",
        world.size(), threads, seconds, 4000 / seconds, processor);
}

}  // namespace

int main(int argc, char** argv) {
  const auto world = join_world();
  const std::string what = argc > 1 ? argv[1] : "";
  const int threads = world->size() > 1 ? 1 : 2;
  if (what == "scaling") {
    scaling(*world, threads);
    return 0;
  }
  const std::filesystem::path folder =
      what.empty() ? "" : std::filesystem::path(what) / "bench_tasks";
  memory(*world, folder);
  overhead(*world, folder);
  requests(*world);
  if (threads > 1) scaling(*world, 1);
  scaling(*world, threads);
  if (!folder.empty() && world->is_root()) std::filesystem::remove_all(folder);
}
