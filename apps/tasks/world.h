// The processes that share the work: this one alone, or the ranks of MPI. The only file that knows
// MPI is mpi_world.cc.
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

/// Messages of one channel are not seen by who listens to the other: a rank may be done with its
/// tasks, and say so to all, while rank 0 still deals with those of others.
enum class Channel { kTasks = 0, kTogether = 1 };

class World {
 public:
  virtual ~World() = default;
  virtual int rank() const = 0;  ///< 0: the one that hands out tasks, prints and writes
  virtual int size() const = 0;
  /// Threads that this rank may keep busy: its processors, over the ranks that share them.
  virtual int cores() const = 0;
  virtual std::string name() const = 0;  ///< "rank 3 on node7", for messages
  /// Does not wait for the receiver. Messages of a channel from one rank to another arrive in
  /// order.
  virtual void send(int to, Channel channel, std::string bytes) = 0;
  /// A message, if one is there.
  virtual std::optional<Message> receive(Channel channel) = 0;

  bool is_root() const { return rank() == 0; }
  /// Waits, asleep for the most part: the processor is others'.
  Message wait(Channel channel);
};

/// This process alone.
std::unique_ptr<World> lone_world();
/// The ranks that this process was started with by mpirun or srun (as their environment says), or
/// this process alone. Call once. @throws InputError where there are ranks but the build has no
/// MPI.
std::unique_ptr<World> join_world();
/// Is this build one with MPI, and of what version? Empty: it is not.
std::string mpi_version();

/// A rank has failed: `what` of the first, for rank 0 to say; the others end in silence.
class WorldFailed : public std::runtime_error {
 public:
  WorldFailed(const std::string& why, bool bad_input)
      : std::runtime_error(why), bad_input_(bad_input) {}
  bool bad_input() const { return bad_input_; }

 private:
  bool bad_input_;
};

/// All ranks come here together, each with what went wrong on it (empty: nothing). @throws
/// WorldFailed on every rank where something did on any: that of rank 0 first, else of the lowest.
void agree(World& world, const std::string& error, bool bad_input = false);
/// Bytes of rank 0, on all ranks.
std::string broadcast(World& world, std::string bytes);

}  // namespace counterpoint::apps::tasks
