// A page of a live session, as a client of its WebSocket.
#pragma once

#include <cstring>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace counterpoint::live::test {

using Json = nlohmann::json;

/// The first numbers of a frame, and the poses.
struct SeenFrame {
  std::uint32_t kind = 0, held_body = 0;
  double time = 0.0;
  std::uint32_t counts[6] = {};  ///< bodies, trees, contacts, closures, curves, 0
  std::vector<float> poses;      ///< 7 per body
  std::vector<float> curves;
  std::size_t bytes = 0, expected_bytes = 0;
};
SeenFrame decode(const std::string& bytes);

class Page {
 public:
  /// Connects to "http://127.0.0.1:PORT/". @throws std::runtime_error if it is refused
  explicit Page(const std::string& address, const std::string& target = "/live");
  ~Page();

  void send(const std::string& message);
  void send(const Json& message) { send(message.dump()); }
  /// Reads on until a status fulfils a condition. @throws std::runtime_error after 10 s
  Json status(const std::function<bool(const Json&)>& condition);
  /// Reads on until the server says something, and returns its words.
  std::string words();
  /// Returns the last frame that came since the last call, or the next one.
  SeenFrame frame();
  /// Closes the connection without a word.
  void vanish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Sends bytes to a port of this machine and returns the answer until its end, at most 1 MB.
std::string exchange(const std::string& address, const std::string& bytes);

/// Port of "http://127.0.0.1:PORT/...".
int port_of(const std::string& address);

}  // namespace counterpoint::live::test
