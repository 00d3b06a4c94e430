// A server of one page and its WebSocket, on a thread of its own (docs/reference/live.md,
// Security). Only server.cc includes Boost.Beast: its headers take half a minute to compile.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace counterpoint::live {

struct ServerOptions;  // viewer.h

/// A page that came, spoke or left.
struct Event {
  enum class Kind { kOpened, kMessage, kClosed };
  Kind kind = Kind::kOpened;
  long client = 0;   ///< number of the page, from 1
  std::string text;  ///< text of kMessage
};

class Server {
 public:
  /// Starts to listen. `page` makes the page's bytes from the sources to which it may connect
  /// (connect-src of its content security policy). `handler` is called on the server's thread.
  /// @throws InputError if the address cannot be listened at.
  Server(const ServerOptions& options,
         const std::function<std::string(const std::string& sources)>& page,
         std::function<void(Event)> handler);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Address of the page, with the token if it needs one.
  const std::string& address() const;

  /// Sends a text to a page, after those sent before. A page that does not read is closed.
  void send(long client, std::string text);
  /// Sends bytes to all pages. A page that is busy gets the newest of each kind (0 or 1) only.
  void send_frame(int kind, std::string bytes);
  /// Waits until pages have got all messages, for at most `seconds` [s].
  void drain(double seconds);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace counterpoint::live
