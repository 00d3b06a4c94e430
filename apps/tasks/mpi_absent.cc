// Definitions for builds without MPI.
#include <cstdlib>
#include <string>

#include "counterpoint/model/spatial.h"
#include "world.h"

namespace counterpoint::apps::tasks {

std::unique_ptr<World> join_world() {
  const char* size = std::getenv("OMPI_COMM_WORLD_SIZE");
  if (size != nullptr && std::string(size) != "1")
    throw InputError(
        "mpirun has started " + std::string(size) +
        " processes, but this build has no MPI: they would all do the same work. Build "
        "with MPI (Debian: libopenmpi-dev), or use --tasks K/N");
  return lone_world();
}

std::string mpi_version() { return {}; }

}  // namespace counterpoint::apps::tasks
