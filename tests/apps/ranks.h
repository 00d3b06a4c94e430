// Runs commands as MPI ranks on this machine, and arbitrary shell command lines.
#pragma once

#include <string>
#include <utility>

#include "apps/command.h"

namespace counterpoint::test {

/// Runs a shell command line; {} is replaced by the folder, COMMAND by the program.
inline CommandResult shell(const CommandFolder& folder, std::string line) {
  for (const auto& [word, text] :
       {std::pair{std::string("{}"), folder.path("")}, {"COMMAND", command_file()}})
    for (size_t at = 0; (at = line.find(word, at)) != std::string::npos; at += text.size())
      line.replace(at, word.size(), text);
  const std::string all = "cd '" + source_dir() + "' && { " + line + "; } >'" +
                          folder.path("stdout") + "' 2>'" + folder.path("stderr") + "'";
  // `ulimit -f` of sh counts 512 bytes.
  const int status = std::system(all.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, folder.read("stdout"),
          folder.read("stderr")};
}

/// Starts ranks, also as root and on a machine with fewer cores.
inline const std::string kMpirun =
    "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 timeout 300 mpirun --oversubscribe ";

/// Reason why ranks cannot be tested; empty if they can.
inline std::string why_no_mpi(const CommandFolder& folder) {
  if (shell(folder, "command -v mpirun").exit_code != 0) return "no mpirun (Debian: openmpi-bin)";
  const std::string version = folder.run("--version").output;
  return version.find("MPI:          no") != std::string::npos
             ? "built without MPI (Debian: libopenmpi-dev)"
             : "";
}

}  // namespace counterpoint::test
