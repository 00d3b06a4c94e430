#include "view/capture.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>

#include "counterpoint/model/spatial.h"
#include "view/packing.h"

namespace counterpoint::view {
namespace {

namespace fs = std::filesystem;

/// Escapes a path for a file:// address.
std::string escaped(const std::string& path) {
  std::string out;
  for (const char c : path) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) ||
                       std::string("/-_.~").find(c) != std::string::npos;
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return out;
}

/// Runs a program and returns its standard output; its standard error is discarded. Calls
/// `waiting`, if given, ten times a second; if it returns false, the program is ended.
std::string output_of(const std::vector<std::string>& command,
                      const std::function<bool()>& waiting) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  std::vector<char*> words;
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error(fmt::format("{} cannot be started", command[0]));
  if (child == 0) {
    const int nothing = open("/dev/null", O_RDWR);
    dup2(nothing, 0);
    dup2(ends[1], 1);
    dup2(nothing, 2);
    execv(words[0], words.data());
    _exit(127);
  }
  close(ends[1]);
  std::string out;
  char part[1 << 16];
  constexpr int kInterval = 100;  // [ms]
  for (ssize_t size = 1; size > 0;) {
    pollfd ready{ends[0], POLLIN, 0};
    if (poll(&ready, 1, kInterval) == 0) {
      if (waiting && !waiting()) {
        kill(child, SIGTERM);
        out.clear();
        break;
      }
      continue;
    }
    size = read(ends[0], part, sizeof part);
    if (size > 0) out.append(part, static_cast<size_t>(size));
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  return out;
}

/// A temporary profile folder for Chromium, removed at the end.
struct Profile {
  fs::path folder = fs::temp_directory_path() / fmt::format("counterpoint_chromium_{}", getpid());
  ~Profile() {
    std::error_code error;
    fs::remove_all(folder, error);
  }
};

std::string fragment(const Pictures& pictures) {
  std::string out = fmt::format("#ui=0&size={},{}", pictures.width, pictures.height);
  if (!pictures.times.empty()) out += fmt::format("&png={}", fmt::join(pictures.times, ","));
  if (pictures.gif) out += fmt::format("&gif={}", fmt::join(*pictures.gif, ","));
  if (pictures.webm) out += fmt::format("&webm={}", fmt::join(*pictures.webm, ","));
  if (!pictures.link.empty()) out += "&" + pictures.link;
  return out;
}

}  // namespace

std::string find_chromium() {
  if (const char* given = std::getenv("COUNTERPOINT_CHROMIUM")) return given;
  const char* path = std::getenv("PATH");
  const std::string folders = path ? path : "";
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    for (size_t at = 0; at < folders.size();) {
      const size_t end = std::min(folders.find(':', at), folders.size());
      const fs::path file = fs::path(folders.substr(at, end - at)) / name;
      if (access(file.c_str(), X_OK) == 0) return file.string();
      at = end + 1;
    }
  }
  return "";
}

Drawn draw(const fs::path& page, const Pictures& pictures, const std::function<bool()>& waiting) {
  const std::string chromium = find_chromium();
  if (chromium.empty())
    throw InputError(
        "--png, --gif and --webm draw with Chromium, which is not there; install chromium "
        "(Debian)");
  const Profile profile;
  std::vector<std::string> command = {chromium,
                                      "--headless",
                                      "--use-gl=angle",
                                      "--use-angle=swiftshader",
                                      "--enable-unsafe-swiftshader",
                                      "--hide-scrollbars",
                                      "--no-first-run",
                                      "--disable-extensions",
                                      "--user-data-dir=" + profile.folder.string(),
                                      "--dump-dom"};
  if (getuid() == 0) command.push_back("--no-sandbox");  // Chromium refuses root otherwise
  command.push_back("file://" + escaped(fs::absolute(page).string()) + fragment(pictures));
  const std::string text = output_of(command, waiting);
  Drawn out;
  if (waiting && !waiting()) return out;
  for (size_t at = 0; (at = text.find("<pre class=\"capture\"", at)) != std::string::npos;) {
    const size_t begin = text.find('>', at) + 1, end = text.find('<', begin);
    const std::string bytes = from_base64(text.substr(begin, end - begin));
    const std::string tag = text.substr(at, begin - at);
    if (tag.find("\"gif\"") != std::string::npos)
      out.gif = bytes;
    else if (tag.find("\"webm\"") != std::string::npos)
      out.webm = bytes;
    else if (tag.find("\"failed\"") != std::string::npos)
      throw std::runtime_error(fmt::format("{}: {}", chromium, bytes));
    else
      out.png.push_back(bytes);
    at = end;
  }
  if (out.png.size() != pictures.times.size() || out.gif.empty() == pictures.gif.has_value() ||
      out.webm.empty() == pictures.webm.has_value())
    throw std::runtime_error(fmt::format("{} drew no picture of {}", chromium, page.string()));
  return out;
}

}  // namespace counterpoint::view
