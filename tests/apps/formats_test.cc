// The version that files carry: files of every kind as version 0.1 wrote them, in
// tests/apps/formats/, are read by every later version (docs/reference/versions.md).
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "apps/command.h"
#include "counterpoint/engine/tables.h"
#include "support/paths.h"

namespace counterpoint::formats_test {
namespace {

using test::CommandFolder;
namespace fs = std::filesystem;

const std::string kOld = "tests/apps/formats/";
const std::string kScene = kOld + "scene.yaml";

/// Copies an old file with one text replaced, which it must have.
void write_changed(const CommandFolder& folder, const std::string& name, const std::string& from,
                   const std::string& to) {
  std::ifstream stream(test::source_dir() + "/" + kOld + name);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  const size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << name << " has no " << from;
  folder.write(name, text.replace(at, from.size(), to));
}

TEST(Formats, OldFilesAreRead) {
  const CommandFolder folder("formats");
  folder.succeed("simulate " + kScene + " --resume " + kOld + "state.csv --duration 0.1");
  folder.succeed("simulate " + kScene + " --inputs " + kOld + "motion.csv");
  folder.succeed("sweep " + kOld + "study.yaml --output {}/table.csv");
  folder.succeed("optimize " + kOld + "problem.yaml --quiet --output {}/plan.csv");
  folder.succeed("compare " + kScene + " " + kOld + "motion.csv --columns " + kOld + "map.yaml");
  folder.succeed("contact-problem " + kOld + "contact_problem");
  const Table contacts(test::source_dir() + "/" + kOld + "contacts.csv");
  EXPECT_GT(contacts.num_rows(), 0);
  EXPECT_GE(contacts.find_column("time"), 0);
}

TEST(Formats, OldMotionsHaveTheirBits) {
  const CommandFolder folder("formats_motions");
  const bool hdf5 = folder.report("--version")["hdf5"];
  for (const char* name : {"motion.csv", "motion.h5", "motion.npz", "motion.mcap"}) {
    if (!hdf5 && fs::path(name).extension() == ".h5") continue;
    const nlohmann::json report = folder.report("inverse " + kScene + " " + kOld + name);
    EXPECT_EQ(report["altered_rows"], 0) << name;
    EXPECT_EQ(report["steps"], 20) << name;
  }
}

TEST(Formats, FilesOfALaterVersionAreRefused) {
  const CommandFolder folder("formats_later");
  const std::string later = "the file has format 0.2, and counterpoint 0.1";
  for (const auto& [name, command] :
       {std::pair{"scene.yaml", "simulate {}/scene.yaml"},
        std::pair{"study.yaml", "sweep {}/study.yaml --output {}/table.csv"},
        std::pair{"problem.yaml", "optimize {}/problem.yaml"},
        std::pair{"map.yaml",
                  "compare tests/apps/formats/scene.yaml "
                  "tests/apps/formats/motion.csv --columns {}/map.yaml"}}) {
    write_changed(folder, name, "format: 0.1", "format: 0.2");
    folder.refuse(command, std::string(name) + ":1: format: " + later);
  }
  write_changed(folder, "motion.csv", "format.0.1", "format.0.2");
  folder.refuse("inverse " + kScene + " {}/motion.csv",
                "motion.csv: column 'format.0.2': " + later);
  write_changed(folder, "state.csv", "format.0.1", "format.0.2");
  folder.refuse("simulate " + kScene + " --resume {}/state.csv", later);
}

TEST(Formats, WhatIsNoVersionIsRefused) {
  const CommandFolder folder("formats_wrong");
  for (const auto& [line, message] :
       {std::pair{"format: new", "scene.yaml:1: format: 'new' is no format; MAJOR.MINOR"},
        std::pair{"format: [0, 1]", "format: '' is no format"},
        std::pair{"format: 0.1\nformat: 0.1", "scene.yaml:2: format: 'format' is given twice"},
        std::pair{"format: 1.0", "the file has format 1.0"},
        std::pair{"format: 0.10", "the file has format 0.10"}}) {
    write_changed(folder, "scene.yaml", "format: 0.1", line);
    folder.refuse("simulate {}/scene.yaml", message);
  }
  // A column of another program is none of ours.
  write_changed(folder, "motion.csv", "format.0.1", "format.x");
  folder.refuse("inverse " + kScene + " {}/motion.csv", "'format.x' is no coordinate");
}

}  // namespace
}  // namespace counterpoint::formats_test
