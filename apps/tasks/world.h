// Processes that share the work: this one only, or the ranks of MPI. Only mpi_world.cc uses MPI.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace counterpoint::apps::tasks {

struct Message {
  int from = 0;
  std::string bytes;
};

/// Channels are independent: a rank may finish its tasks and send its outcome while rank 0 still
/// handles task messages of others.
enum class Channel { kTasks = 0, kTogether = 1 };

class World {
 public:
  virtual ~World() = default;
  virtual int rank() const = 0;  ///< rank 0 hands out tasks, prints and writes
  virtual int size() const = 0;
  /// Number of threads for this rank: its processors divided by the number of ranks that share
  /// them.
  virtual int cores() const = 0;
  virtual std::string name() const = 0;  ///< "rank 3 on node7", for messages
  /// Sends without waiting for the receiver. Messages of a channel from one rank to another arrive
  /// in order.
  virtual void send(int to, Channel channel, std::string bytes) = 0;
  /// Next message, if one has arrived.
  virtual std::optional<Message> receive(Channel channel) = 0;

  bool is_root() const { return rank() == 0; }
  /// Waits for a message, mostly asleep, so that the processor is free for others.
  Message wait(Channel channel);
};

/// World of this process only.
std::unique_ptr<World> lone_world();
/// Ranks that mpirun or srun started this process with (according to the environment), or this
/// process only. Call once. @throws InputError if there are ranks but the build has no MPI.
std::unique_ptr<World> join_world();
/// Version of MPI in this build; empty without MPI.
std::string mpi_version();

/// Thrown after a failure of a rank; what() is the first error, printed by rank 0 only.
class WorldFailed : public std::runtime_error {
 public:
  WorldFailed(const std::string& why, bool bad_input)
      : std::runtime_error(why), bad_input_(bad_input) {}
  bool bad_input() const { return bad_input_; }

 private:
  bool bad_input_;
};

/// Synchronizes all ranks, each with its error (empty: none). @throws WorldFailed on every rank if
/// any has an error: that of the lowest rank.
void agree(World& world, const std::string& error, bool bad_input = false);
/// Sends bytes of rank 0 to all ranks and returns them.
std::string broadcast(World& world, std::string bytes);

}  // namespace counterpoint::apps::tasks
