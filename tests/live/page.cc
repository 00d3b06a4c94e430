#include "live/page.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <utility>

namespace counterpoint::live::test {
namespace {

namespace beast = boost::beast;
namespace net = boost::asio;
using tcp = net::ip::tcp;

constexpr int kSeconds = 10;  ///< until a read fails

tcp::socket connect(net::io_context& context, const std::string& address) {
  tcp::socket socket(context);
  socket.connect(
      {net::ip::make_address("127.0.0.1"), static_cast<unsigned short>(port_of(address))});
  return socket;
}

}  // namespace

int port_of(const std::string& address) {
  return std::stoi(address.substr(address.rfind(':') + 1));
}

SeenFrame decode(const std::string& bytes) {
  SeenFrame out;
  out.bytes = bytes.size();
  const auto read = [&](void* to, size_t at, size_t size) {
    if (at + size > bytes.size()) throw std::runtime_error("a short frame");
    std::memcpy(to, bytes.data() + at, size);
  };
  read(&out.kind, 0, 4);
  read(&out.held_body, 4, 4);
  read(&out.time, 8, 8);
  read(out.counts, 16, sizeof out.counts);
  out.poses.resize(7 * out.counts[0]);
  read(out.poses.data(), 40, 4 * out.poses.size());
  out.curves.resize(out.counts[4]);
  read(out.curves.data(), 40 + 28 * out.counts[0] + 24 * (out.counts[2] + out.counts[3]),
       4 * out.curves.size());
  out.expected_bytes = 40 + 28 * out.counts[0] + 24 * (out.counts[2] + out.counts[3]) +
                       4 * out.counts[4] + 24 + out.counts[1] + out.counts[0];
  return out;
}

struct Page::Impl {
  net::io_context context;
  beast::websocket::stream<tcp::socket> socket{context};

  std::string frame;  ///< the last one, if frame() has not returned it

  /// Reads a message. Returns whether it is a text. @throws std::runtime_error after kSeconds
  bool read(std::string& out) {
    beast::flat_buffer buffer;
    std::optional<beast::error_code> result;
    socket.async_read(buffer, [&](beast::error_code error, size_t) { result = error; });
    context.restart();
    context.run_for(std::chrono::seconds(kSeconds));
    if (!result) {
      socket.next_layer().close();
      context.run();
    }
    if (*result) throw std::runtime_error(result->message());
    out = beast::buffers_to_string(buffer.data());
    return socket.got_text();
  }
  template <class Wanted>
  Json text(const std::string& type, const Wanted& wanted) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(kSeconds);
    std::string bytes;
    while (std::chrono::steady_clock::now() < end) {
      if (!read(bytes)) {
        frame = bytes;
        continue;
      }
      const Json json = Json::parse(bytes);
      if (json["type"] == type && wanted(json)) return json;
    }
    throw std::runtime_error("no such " + type);
  }
};

Page::Page(const std::string& address, const std::string& target)
    : impl_(std::make_unique<Impl>()) {
  auto& socket = impl_->socket;
  socket.next_layer() = connect(impl_->context, address);
  const std::string host = "127.0.0.1:" + std::to_string(port_of(address));
  socket.set_option(beast::websocket::stream_base::decorator(
      [&](auto& request) { request.set(beast::http::field::origin, "http://" + host); }));
  socket.handshake(host, target);
}

Page::~Page() = default;

void Page::send(const std::string& message) { impl_->socket.write(net::buffer(message)); }

Json Page::status(const std::function<bool(const Json&)>& condition) {
  return impl_->text("status", condition);
}

std::string Page::words() {
  return impl_->text("say", [](const Json&) { return true; })["words"];
}

SeenFrame Page::frame() {
  std::string bytes = std::exchange(impl_->frame, {});
  if (bytes.empty())
    while (impl_->read(bytes)) continue;
  return decode(bytes);
}

void Page::vanish() { impl_->socket.next_layer().close(); }

std::string exchange(const std::string& address, const std::string& bytes) {
  net::io_context context;
  tcp::socket socket = connect(context, address);
  beast::error_code error;
  net::write(socket, net::buffer(bytes), error);
  std::string out;
  char part[4096];
  while (!error && out.size() < 1'000'000) {
    const size_t size = socket.read_some(net::buffer(part), error);
    out.append(part, size);
  }
  return out;
}

}  // namespace counterpoint::live::test
