// The ranks of MPI. One thread of each rank calls MPI.
#include <fmt/format.h>
#include <mpi.h>

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstdlib>
#include <list>

#include "counterpoint/engine/batch.h"
#include "counterpoint/model/spatial.h"
#include "world.h"

namespace counterpoint::apps::tasks {
namespace {

/// Bit mask of processors; indices are taken modulo its length.
using Mask = std::bitset<1024>;

class MpiWorld : public World {
 public:
  MpiWorld() {
    int given = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &given);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    count_cores();
  }
  ~MpiWorld() override {
    for (Sending& sending : sending_) MPI_Wait(&sending.request, MPI_STATUS_IGNORE);
    MPI_Finalize();
  }
  int rank() const override { return rank_; }
  int size() const override { return size_; }
  int cores() const override { return cores_; }
  std::string name() const override {
    std::array<char, MPI_MAX_PROCESSOR_NAME> host{};
    int length = 0;
    MPI_Get_processor_name(host.data(), &length);
    return fmt::format("rank {} on {}", rank_,
                       std::string(host.data(), static_cast<size_t>(length)));
  }

  void send(int to, Channel channel, std::string bytes) override {
    if (bytes.size() > 0x7fffffffu)
      throw std::runtime_error(
          "results of more than 2 GiB cannot be sent at once; give --parts DIR");
    clear_sent();
    Sending& sending = sending_.emplace_back(Sending{std::move(bytes), MPI_REQUEST_NULL});
    MPI_Isend(sending.bytes.data(), static_cast<int>(sending.bytes.size()), MPI_BYTE, to,
              static_cast<int>(channel), MPI_COMM_WORLD, &sending.request);
  }

  std::optional<Message> receive(Channel channel) override {
    clear_sent();
    int there = 0;
    MPI_Status status;
    const int tag = static_cast<int>(channel);
    MPI_Iprobe(MPI_ANY_SOURCE, tag, MPI_COMM_WORLD, &there, &status);
    if (there == 0) return {};
    int length = 0;
    MPI_Get_count(&status, MPI_BYTE, &length);
    Message message{status.MPI_SOURCE, std::string(static_cast<size_t>(length), '\0')};
    MPI_Recv(message.bytes.data(), length, MPI_BYTE, status.MPI_SOURCE, tag, MPI_COMM_WORLD,
             MPI_STATUS_IGNORE);
    return message;
  }

 private:
  struct Sending {
    std::string bytes;
    MPI_Request request;
  };
  void clear_sent() {
    sending_.remove_if([](Sending& sending) {
      int done = 0;
      MPI_Test(&sending.request, &done, MPI_STATUS_IGNORE);
      return done != 0;
    });
  }

  /// Counts the cores of this rank. Ranks of one machine that may run on the same processors share
  /// them, and also the processors granted by control groups.
  void count_cores() {
    Mask mine{};
    const std::vector<int> affinity = affinity_cores();
    for (const int core : affinity) mine.set(static_cast<size_t>(core) % mine.size());
    MPI_Comm machine = MPI_COMM_NULL;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    int ranks = 1;
    MPI_Comm_size(machine, &ranks);
    std::vector<Mask> all(static_cast<size_t>(ranks));
    MPI_Allgather(&mine, sizeof mine, MPI_BYTE, all.data(), sizeof mine, MPI_BYTE, machine);
    MPI_Comm_free(&machine);
    const auto sharing = std::count_if(all.begin(), all.end(),
                                       [&](const Mask& other) { return (mine & other).any(); });
    const double share =
        std::min(static_cast<double>(affinity.size()) / static_cast<double>(sharing),
                 cgroup_cores() / ranks);
    cores_ = std::max(1, static_cast<int>(std::floor(share)));
  }

  int rank_ = 0, size_ = 1, cores_ = 1;
  std::list<Sending> sending_;  ///< messages that may not have left yet
};

}  // namespace

std::unique_ptr<World> join_world() {
  // Variables set by mpirun (Open MPI, MPICH) and by srun --mpi=pmix or --mpi=pmi2. Other processes
  // avoid the 0.1 s that MPI_Init takes.
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"})
    if (std::getenv(name) != nullptr) return std::make_unique<MpiWorld>();
  return lone_world();
}

std::string mpi_version() {
  std::array<char, MPI_MAX_LIBRARY_VERSION_STRING> text{};
  int length = 0;
  MPI_Get_library_version(text.data(), &length);
  const std::string all(text.data(), static_cast<size_t>(length));
  return all.substr(0, all.find(','));
}

}  // namespace counterpoint::apps::tasks
