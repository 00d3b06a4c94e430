// What tasks cost beside themselves, alone and under mpirun (docs/measurements/tasks.md):
//   counterpoint_bench_tasks [FOLDER]           overhead of a task, without and with journals in
//   FOLDER mpirun -n 2 counterpoint_bench_tasks        the same over ranks, requests that rank 0
//   answers
// and how tasks of 1 ms, of processor time only, scale with threads and ranks.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>

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

/// Requests of the others, answered by rank 0 as fast as it can.
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

/// Tasks of about a millisecond.
void scaling(World& world, const std::filesystem::path& folder) {
  constexpr int kSine = 60'000;
  for (const int threads : {1, 2}) {
    if (world.size() > 1 && threads > 1) break;
    const double seconds = seconds_of(world, list_of(8000, 200, kSine), threads, folder);
    if (world.is_root())
      fmt::print("{} rank(s) of {} thread(s): 8000 tasks in {:.3f} s, {:.4g} a second\n",
                 world.size(), threads, seconds, 8000 / seconds);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto world = join_world();
  const std::filesystem::path folder =
      argc > 1 ? std::filesystem::path(argv[1]) / "bench_tasks" : "";
  overhead(*world, folder);
  requests(*world);
  scaling(*world, folder);
  if (!folder.empty() && world->is_root()) std::filesystem::remove_all(folder);
}
