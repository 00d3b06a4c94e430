// The include graph follows docs/architecture.md, and documents refer to things that exist.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "apps/command.h"
#include "support/paths.h"

namespace counterpoint::house_test {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = test::source_dir();

std::string read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<fs::path> files_in(const fs::path& folder, const std::set<std::string>& extensions) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (extensions.count(entry.path().extension().string())) files.push_back(entry.path());
  }
  return files;
}

/// Files of a folder and of all folders below it.
std::vector<fs::path> files_below(const fs::path& folder, const std::set<std::string>& extensions) {
  std::vector<fs::path> files = files_in(folder, extensions);
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_directory()) continue;
    for (const fs::path& file : files_in(entry.path(), extensions)) files.push_back(file);
  }
  return files;
}

/// First capture group of every match.
std::vector<std::string> matches(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), regex), end; it != end; ++it) {
    found.push_back((*it)[1]);
  }
  return found;
}

TEST(House, FoldersIncludeOnlyWhatTheArchitectureAllows) {
  const std::map<std::string, std::set<std::string>> allowed = {
      {"contact", {"contact"}},
      {"model", {"model"}},
      {"collision", {"model", "collision"}},
      {"engine", {"model", "collision", "contact", "engine"}},
  };
  int includes = 0;
  for (const auto& [folder, may_include] : allowed) {
    for (const fs::path& file : files_below(kRoot / folder, {".h", ".cc"})) {
      for (const std::string& target :
           matches(read(file), "#include \"counterpoint/(?!contact/lanes/)([a-z]+)/")) {
        ++includes;
        EXPECT_TRUE(may_include.count(target)) << file << " includes " << target;
      }
    }
  }
  EXPECT_GT(includes, 50);
}

/// Include graph of the libraries' subfolders: folder -> folders it includes, without the top
/// folders.
using Rooms = std::map<std::string, std::set<std::string>>;

Rooms rooms_of_libraries() {
  const std::set<std::string> tops = {"model",  "model/mjcf",      "collision",      "contact",
                                      "engine", "engine/optimize", "engine/estimate"};
  Rooms rooms;
  for (const char* library : {"model", "collision", "contact", "engine"}) {
    for (const fs::path& file : files_below(kRoot / library, {".h", ".cc"})) {
      const std::string room = fs::relative(file.parent_path(), kRoot).string();
      if (tops.count(room)) continue;
      for (const std::string& target :
           matches(read(file), "#include \"counterpoint/([a-z_/.]+)\"")) {
        const std::string other = fs::path(target).parent_path().string();
        if (other != room && !tops.count(other)) rooms[room].insert(other);
      }
    }
  }
  return rooms;
}

/// Whether `from` includes `to`, directly or through others.
bool leads(const Rooms& rooms, const std::string& from, const std::string& to,
           std::set<std::string>& seen) {
  const auto found = rooms.find(from);
  if (found == rooms.end() || !seen.insert(from).second) return false;
  for (const std::string& next : found->second) {
    if (next == to || leads(rooms, next, to, seen)) return true;
  }
  return false;
}

void expect_no_circle(const Rooms& rooms) {
  for (const auto& [room, others] : rooms) {
    std::set<std::string> seen;
    EXPECT_FALSE(leads(rooms, room, room, seen)) << room;
  }
}

TEST(House, NoRoomsIncludeOneAnother) {
  const Rooms rooms = rooms_of_libraries();
  EXPECT_GT(rooms.size(), 15u);
  expect_no_circle(rooms);
}

/// Include graph of the folders of apps/, whose files name one another from apps/ on or from their
/// own folder on.
TEST(House, NoRoomsOfAppsIncludeOneAnother) {
  Rooms rooms;
  for (const fs::path& file : files_below(kRoot / "apps", {".h", ".cc"})) {
    const std::string path = fs::relative(file, kRoot / "apps").string();
    const std::string room = path.substr(0, path.find('/'));
    for (const std::string& target : matches(read(file), "#include \"([a-z_]+)/[a-z_/.0-9]+\""))
      if (target != room && fs::is_directory(kRoot / "apps" / target)) rooms[room].insert(target);
  }
  EXPECT_GT(rooms.size(), 10u);
  expect_no_circle(rooms);
}

/// No header includes itself, directly or through others.
TEST(House, NoFileIncludesItself) {
  Rooms files;
  for (const char* library : {"model", "collision", "contact", "engine"})
    for (const fs::path& file : files_below(kRoot / library, {".h"}))
      for (const std::string& target :
           matches(read(file), "#include \"counterpoint/([a-z_/.0-9]+)\""))
        files[fs::relative(file, kRoot).string()].insert(target);
  for (const fs::path& file : files_below(kRoot / "apps", {".h"}))
    for (const std::string& target : matches(read(file), "#include \"([a-z_/.0-9]+)\""))
      for (const fs::path& base : {file.parent_path(), kRoot / "apps", kRoot / "apps/python"})
        if (fs::exists(base / target))
          files[fs::relative(file, kRoot).string()].insert(
              fs::relative(base / target, kRoot).string());
  EXPECT_GT(files.size(), 150u);
  expect_no_circle(files);
}

/// Reads cmake/public_headers.txt: section -> headers.
std::map<std::string, std::set<std::string>> public_headers() {
  std::map<std::string, std::set<std::string>> sections;
  std::ifstream stream(kRoot / "cmake/public_headers.txt");
  std::string section;
  for (std::string line; std::getline(stream, line);) {
    if (line.empty() || line[0] == '#') continue;
    if (line[0] == '[') {
      section = line;
    } else {
      sections[section].insert(line);
    }
  }
  return sections;
}

/// Installed headers include only installed headers, and each one beyond those for users is
/// included by another or by an app.
TEST(House, PublicHeadersIncludeNoOthers) {
  const auto sections = public_headers();
  ASSERT_EQ(sections.size(), 2u);
  std::set<std::string> all, included;
  for (const auto& [section, headers] : sections) all.insert(headers.begin(), headers.end());
  for (const std::string& header : all) {
    ASSERT_TRUE(fs::exists(kRoot / header)) << header;
    for (const std::string& target :
         matches(read(kRoot / header), "#include \"counterpoint/([a-z_/.0-9]+)\"")) {
      EXPECT_TRUE(all.count(target)) << header << " includes " << target;
      included.insert(target);
    }
  }
  for (const fs::path& file : files_below(kRoot / "apps", {".h", ".cc"}))
    for (const std::string& target :
         matches(read(file), "#include \"counterpoint/([a-z_/.0-9]+)\""))
      included.insert(target);
  for (const auto& [section, headers] : sections) {
    if (section == "[what a user includes]") continue;
    for (const std::string& header : headers)
      EXPECT_TRUE(included.count(header))
          << "nothing that is installed, and no app, needs " << header;
  }
}

TEST(House, LibrariesStayBehindTheirDoors) {
  const std::map<std::string, std::string> doors = {{"fcl", "collision"}, {"assimp", "model"}};
  for (const char* folder : {"contact", "model", "collision", "engine", "apps"}) {
    for (const fs::path& file : files_below(kRoot / folder, {".h", ".cc"})) {
      for (const std::string& library : matches(read(file), "#include <(fcl|assimp)/")) {
        EXPECT_EQ(doors.at(library), folder) << file;
        EXPECT_EQ(file.extension(), ".cc") << file << " shows " << library << " to others";
      }
    }
  }
}

TEST(House, PeersStayInTheirRoom) {
  int includes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "apps")) {
    const fs::path& file = entry.path();
    if (file.extension() != ".cc" && file.extension() != ".h") continue;
    if (matches(read(file), "#include <(mujoco)/").empty()) continue;
    ++includes;
    EXPECT_NE(*fs::relative(file, kRoot / "apps/peers").begin(), "..") << file;
    EXPECT_EQ(file.extension(), ".cc") << file << " shows MuJoCo to others";
  }
  EXPECT_GT(includes, 0);
}

TEST(Documents, LinksLeadSomewhere) {
  std::vector<fs::path> documents = files_in(kRoot / "docs", {".md"});
  for (const char* name : {"README.md", "CHANGELOG.md", "data/README.md"})
    documents.push_back(kRoot / name);
  int links = 0;
  for (const fs::path& document : documents) {
    for (const std::string& link : matches(read(document), "\\]\\(([^)#:]+)\\)")) {
      ++links;
      EXPECT_TRUE(fs::exists(document.parent_path() / link)) << document << ": " << link;
    }
  }
  EXPECT_GT(links, 10);
}

/// Expects every key of a report, at any depth, to be named in docs/reference/json-reports.md.
void expect_documented(const nlohmann::json& report, const std::string& document) {
  if (report.is_array() && !report.empty()) expect_documented(report[0], document);
  if (!report.is_object()) return;
  for (const auto& [key, value] : report.items()) {
    EXPECT_NE(document.find('`' + key + '`'), std::string::npos) << key;
    expect_documented(value, document);
  }
}

TEST(Documents, EveryKeyOfEveryReportIsExplained) {
  const std::string document = read(kRoot / "docs/reference/json-reports.md");
  const test::CommandFolder folder("documents");
  const std::string scene = "data/scenes/cube_toss.yaml";
  folder.write("toss.csv",
               "t,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n0,0,0,1,1,0,0,0,0,0,0,0,0,0\n"
               "1,0,0,1,1,0,0,0,0,0,0,0,0,0\n");
  for (const std::string& command :
       {"inspect " + scene, "simulate " + scene + " --duration 0.01 --output {}/t.csv",
        "inverse " + scene + " {}/t.csv", "derivatives " + scene + " {}/t.csv --forward --check",
        "compare " + scene + " {}/toss.csv --columns data/maps/cube_toss.yaml",
        std::string("hard-cases --only tippe_top --peer-seconds 0.01")}) {
    const test::CommandResult result = folder.run(command + " --json {}/r.json");
    ASSERT_EQ(result.exit_code, 0) << command << "\n" << result.errors;
    expect_documented(folder.json("r.json"), document);
  }
  folder.write("fast.yaml", "max_speed: 1e-3\nmodels:\n  - {name: ball, sphere: 0.1, mass: 1}\n");
  ASSERT_EQ(folder.run("simulate {}/fast.yaml --json {}/r.json").exit_code, 1);
  expect_documented(folder.json("r.json"), document);
}

}  // namespace
}  // namespace counterpoint::house_test
