// The server of a live session: who gets in, and what hostile or dead clients can do.
#include "live/server.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <random>

#include "counterpoint/model/spatial.h"
#include "live/page.h"
#include "live/protocol.h"
#include "live/viewer.h"

namespace counterpoint::live::server_test {
namespace {

using test::Page;

class LiveServer : public testing::Test {
 protected:
  void start(const std::string& host = "127.0.0.1") {
    server_.emplace(
        ServerOptions{host, 0, false},
        [&](const std::string& sources) {
          sources_ = sources;
          return std::string("the page");
        },
        [&](const Event& event) { ++events_[static_cast<int>(event.kind)]; });
  }
  std::string get(const std::string& target, const std::string& headers) const {
    return test::exchange(server_->address(),
                          "GET " + target + " HTTP/1.1\r\n" + headers + "\r\n\r\n");
  }
  std::string host() const {
    return fmt::format("Host: 127.0.0.1:{}", test::port_of(server_->address()));
  }
  /// Whether a WebSocket with this origin is refused.
  bool refuses(const std::string& origin, const std::string& target = "/live") const {
    return get(target, host() + "\r\nOrigin: " + origin +
                           "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                           "Sec-WebSocket-Version: 13\r\n"
                           "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==")
        .starts_with("HTTP/1.1 403");
  }
  std::string own_origin() const {
    return fmt::format("http://127.0.0.1:{}", test::port_of(server_->address()));
  }

  std::optional<Server> server_;
  std::string sources_;
  std::atomic<int> events_[3] = {};
};

TEST_F(LiveServer, GivesThePageToItsOwnNameOnly) {
  start();
  EXPECT_TRUE(get("/", host()).starts_with("HTTP/1.1 200"));
  EXPECT_TRUE(get("/", host()).ends_with("the page"));
  for (const char* wrong : {"Host: evil.example", "Host: 127.0.0.1", "X: y", "Host: localhost:1"})
    EXPECT_TRUE(get("/", wrong).starts_with("HTTP/1.1 421")) << wrong;
  EXPECT_TRUE(get("/etc/passwd", host()).starts_with("HTTP/1.1 404"));
  EXPECT_TRUE(get("/live", host()).starts_with("HTTP/1.1 404"));
  EXPECT_NE(sources_.find("ws://localhost:"), std::string::npos);
}

TEST_F(LiveServer, AcceptsOnlyItsOwnPage) {
  start();
  const Page page(server_->address());
  for (const char* wrong : {"http://evil.example", "https://127.0.0.1", "null", "file://", ""})
    EXPECT_TRUE(refuses(wrong)) << wrong;
}

TEST_F(LiveServer, OtherAddressesNeedTheToken) {
  start("0.0.0.0");
  const std::string& address = server_->address();
  const std::string token = address.substr(address.find("?token="));
  EXPECT_EQ(token.size(), 7u + 32u);
  EXPECT_TRUE(get("/", host()).starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(get("/?token=" + std::string(32, '0'), host()).starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(get("/" + token, host()).starts_with("HTTP/1.1 200"));
  EXPECT_TRUE(refuses(own_origin()));
  EXPECT_TRUE(refuses("http://evil.example", "/live" + token));
  const Page page(address.substr(0, address.rfind('/')), "/live" + token);
}

TEST_F(LiveServer, SaysWhatAnAddressMustBe) {
  EXPECT_THROW(start("nonsense"), InputError);
  EXPECT_THROW(start("192.0.2.1"), InputError);  // an address of no machine (RFC 5737)
}

TEST_F(LiveServer, ADeadOrSlowPageDelaysNobody) {
  start();
  Page slow(server_->address());
  Page quick(server_->address());
  Page dead(server_->address());
  dead.vanish();
  // The slow page reads nothing: 300 MB would not fit into its socket.
  Frame frame;
  frame.poses.resize(100);
  for (int k = 0; k < 1000; ++k) {
    frame.time = k;
    frame.curves.assign(75'000, 0.0);
    server_->send_frame(0, encode(frame));
    if (k % 100 == 0) {
      EXPECT_EQ(quick.frame().counts[0], 100u);
    }
  }
  while (quick.frame().time < 999.0) continue;
}

TEST_F(LiveServer, LongAndRandomBytesDoNoHarm) {
  start();
  std::mt19937 random(1);
  for (int i = 0; i < 50; ++i) {
    std::string bytes(1 + random() % 3000, ' ');
    for (char& c : bytes) c = static_cast<char>(random());
    if (i % 2) bytes = "GET /live HTTP/1.1\r\n" + bytes;
    bytes += "\r\n\r\n";
    test::exchange(server_->address(), bytes);
  }
  test::exchange(server_->address(), "GET / HTTP/1.1\r\nX: " + std::string(100'000, 'a'));
  for (int i = 0; i < 20; ++i) {
    Page page(server_->address());
    page.send(std::string(kMaxMessage + 1 + 1000 * i, 'x'));
    EXPECT_ANY_THROW(page.words());
  }
  EXPECT_EQ(events_[1], 0);
  const Page page(server_->address());
}

}  // namespace
}  // namespace counterpoint::live::server_test
