#include "live/server.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <future>
#include <map>
#include <random>
#include <thread>

#include "counterpoint/model/spatial.h"
#include "live/protocol.h"
#include "live/viewer.h"

namespace counterpoint::live {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
namespace websocket = beast::websocket;
using tcp = net::ip::tcp;
using Request = http::request<http::empty_body>;

/// Time for a page to send its request [s], and the most bytes of it.
constexpr std::chrono::seconds kPatience(10);
constexpr std::uint32_t kMaxHeader = 16384;
/// Texts that may wait for a page, and pages and unfinished requests at a time.
constexpr size_t kMaxTexts = 256, kMaxConnections = 64;

/// Whether two texts are equal, in a time that does not depend on where they differ.
bool same_secret(std::string_view a, std::string_view b) {
  unsigned char difference = a.size() == b.size() ? 0 : 1;
  for (size_t i = 0; i < a.size() && i < b.size(); ++i)
    difference |= static_cast<unsigned char>(a[i] ^ b[i]);
  return difference == 0;
}

/// 128 random bits of the system, as hexadecimal digits.
std::string random_token() {
  std::random_device device;
  std::string out;
  for (int i = 0; i < 4; ++i) out += fmt::format("{:08x}", device());
  return out;
}

/// The data that all connections of a server share.
struct Site {
  std::string page, token;
  std::vector<std::string> hosts;  ///< values of Host that name this server
  std::function<void(Event)> handler;
  size_t connections = 0;
  long clients = 0;
  std::map<long, std::shared_ptr<class Client>> open;

  /// Whether a request may name this server so. Where no token is needed, a page of another site
  /// could reach the server under a name of its own (DNS rebinding).
  bool knows_host(std::string_view host) const {
    return !token.empty() || std::find(hosts.begin(), hosts.end(), host) != hosts.end();
  }
  /// Whether the target of a request, "/live?token=...", has the token.
  bool has_token(std::string_view target) const {
    if (token.empty()) return true;
    const size_t query = target.find("?token=");
    return query != std::string_view::npos && same_secret(target.substr(query + 7), token);
  }
};

/// Counts a connection while it lives.
class Counted {
 public:
  explicit Counted(Site& site) : site_(site) { ++site_.connections; }
  ~Counted() { --site_.connections; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;

 private:
  Site& site_;
};

/// A page's WebSocket. At most one write is under way; texts go first, then the newest frames.
class Client : public std::enable_shared_from_this<Client> {
 public:
  Client(tcp::socket socket, Site& site)
      : socket_(std::move(socket)), site_(site), counted_(site), number_(++site.clients) {}

  void accept(const Request& request) {
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kMaxMessage);
    socket_.auto_fragment(false);  // one message, one write
    socket_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
      if (error) return;
      self->site_.open[self->number_] = self;
      self->site_.handler({Event::Kind::kOpened, self->number_, {}});
      self->read();
    });
  }

  void send(std::string text) {
    if (texts_.size() >= kMaxTexts) return close();
    texts_.push_back(std::move(text));
    write();
  }
  void send_frame(int kind, std::shared_ptr<const std::string> bytes) {
    frames_[static_cast<size_t>(kind)] = std::move(bytes);
    write();
  }
  /// Whether the page has got all that was sent.
  bool is_idle() const { return !writing_ && texts_.empty() && !frames_[0] && !frames_[1]; }
  /// Ends the connection. Later calls do nothing.
  void close() {
    if (site_.open.erase(number_) == 0) return;
    site_.handler({Event::Kind::kClosed, number_, {}});
    beast::error_code ignored;
    beast::get_lowest_layer(socket_).close(ignored);
  }

 private:
  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, size_t) {
      if (error) return self->close();
      if (self->site_.open.count(self->number_) == 0) return;
      if (self->socket_.got_text())
        self->site_.handler(
            {Event::Kind::kMessage, self->number_, beast::buffers_to_string(self->buffer_.data())});
      self->buffer_.consume(self->buffer_.size());
      self->read();
    });
  }

  void write() {
    if (writing_ || site_.open.count(number_) == 0) return;
    if (!texts_.empty()) {
      const auto text = std::make_shared<const std::string>(std::move(texts_.front()));
      texts_.pop_front();
      return write(text, true);
    }
    for (auto& frame : frames_)
      if (frame) return write(std::exchange(frame, nullptr), false);
  }
  void write(std::shared_ptr<const std::string> bytes, bool text) {
    writing_ = true;
    socket_.text(text);
    const net::const_buffer buffer = net::buffer(*bytes);
    socket_.async_write(buffer, [self = shared_from_this(), bytes = std::move(bytes)](
                                    beast::error_code error, size_t) {
      self->writing_ = false;
      error ? self->close() : self->write();
    });
  }

  websocket::stream<tcp::socket> socket_;
  Site& site_;
  Counted counted_;
  const long number_;
  beast::flat_buffer buffer_;
  std::deque<std::string> texts_;
  std::array<std::shared_ptr<const std::string>, 2> frames_;
  bool writing_ = false;
};

/// A connection until its request is answered or has become a WebSocket.
class Visitor : public std::enable_shared_from_this<Visitor> {
 public:
  Visitor(tcp::socket socket, Site& site)
      : stream_(std::move(socket)), site_(site), counted_(site) {
    parser_.header_limit(kMaxHeader);
    parser_.body_limit(0);
  }

  void read() {
    stream_.expires_after(kPatience);
    http::async_read(stream_, buffer_, parser_,
                     [self = shared_from_this()](beast::error_code error, size_t) {
                       if (!error) self->answer(self->parser_.get());
                     });
  }

 private:
  void answer(const Request& request) {
    const std::string_view target(request.target().data(), request.target().size());
    const std::string_view path = target.substr(0, target.find('?'));
    const auto host = request[http::field::host];
    if (!site_.knows_host({host.data(), host.size()}))
      return reply(http::status::misdirected_request, "this server has another name\n");
    if (!site_.has_token(target))
      return reply(http::status::forbidden, "the address lacks its token\n");
    if (path == "/live" && websocket::is_upgrade(request)) {
      const auto origin = request[http::field::origin];
      if (origin != "http://" + std::string(host))
        return reply(http::status::forbidden, "only the page of this server may connect\n");
      stream_.expires_never();
      return std::make_shared<Client>(stream_.release_socket(), site_)->accept(request);
    }
    if (path != "/") return reply(http::status::not_found, "there is only /\n");
    if (request.method() != http::verb::get)
      return reply(http::status::method_not_allowed, "only GET\n");
    reply(http::status::ok, site_.page, "text/html; charset=utf-8");
  }

  void reply(http::status status, const std::string& body, const char* type = "text/plain") {
    response_.result(status);
    response_.set(http::field::content_type, type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("X-Frame-Options", "DENY");
    response_.set("Referrer-Policy", "no-referrer");
    response_.keep_alive(false);
    response_.body() = body;
    response_.prepare_payload();
    stream_.expires_after(kPatience);
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code, size_t) {
      beast::error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  beast::tcp_stream stream_;
  Site& site_;
  Counted counted_;
  beast::flat_buffer buffer_;
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

/// Host and port as in an address: [::1]:8890.
std::string authority(const std::string& host, int port) {
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port)
                                             : fmt::format("[{}]:{}", host, port);
}

}  // namespace

struct Server::Impl {
  Site site;
  net::io_context context{1};
  tcp::acceptor acceptor{context};
  std::string address;
  std::thread thread;

  /// Listens at a port. Returns the error, if any.
  beast::error_code listen(const net::ip::address& host, int port) {
    beast::error_code error;
    const tcp::endpoint endpoint(host, static_cast<std::uint16_t>(port));
    if (acceptor.is_open()) acceptor.close(error);
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(net::socket_base::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
    return error;
  }

  void accept() {
    acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (!acceptor.is_open()) return;
      if (!error && site.connections < kMaxConnections) {
        beast::error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        std::make_shared<Visitor>(std::move(socket), site)->read();
      }
      accept();
    });
  }
};

Server::Server(const ServerOptions& options,
               const std::function<std::string(const std::string& sources)>& page,
               std::function<void(Event)> handler)
    : impl_(std::make_unique<Impl>()) {
  beast::error_code error;
  const net::ip::address host = net::ip::make_address(options.host, error);
  if (error)
    throw InputError(fmt::format("host {}: expected an address such as 127.0.0.1, 0.0.0.0 or ::1",
                                 options.host));
  error = impl_->listen(host, options.port);
  if (error && options.any_port) error = impl_->listen(host, 0);
  if (error)
    throw InputError(fmt::format("{}: cannot listen there ({}); choose another --port",
                                 authority(options.host, options.port), error.message()));
  const int port = impl_->acceptor.local_endpoint().port();
  Site& site = impl_->site;
  site.handler = std::move(handler);
  site.hosts = {authority(options.host, port), authority("localhost", port)};
  if (!host.is_loopback()) site.token = random_token();
  const std::string at = authority(options.host, port);
  impl_->address =
      fmt::format("http://{}/{}", at, site.token.empty() ? "" : "?token=" + site.token);
  site.page = page(site.token.empty() ? fmt::format("ws://{} ws://{}", site.hosts[0], site.hosts[1])
                                      : fmt::format("ws://*:{}", port));
  impl_->accept();
  impl_->thread = std::thread([this] { impl_->context.run(); });
}

Server::~Server() {
  net::post(impl_->context, [this] {
    beast::error_code ignored;
    impl_->acceptor.close(ignored);
    impl_->site.handler = [](const Event&) {};
    const auto open = impl_->site.open;
    for (const auto& [number, client] : open) client->close();
    impl_->context.stop();
  });
  impl_->thread.join();
}

const std::string& Server::address() const { return impl_->address; }

void Server::send(long client, std::string text) {
  net::post(impl_->context, [this, client, text = std::move(text)]() mutable {
    const auto found = impl_->site.open.find(client);
    if (found != impl_->site.open.end()) {
      const auto page = found->second;
      page->send(std::move(text));
    }
  });
}

void Server::send_frame(int kind, std::string bytes) {
  net::post(impl_->context,
            [this, kind, shared = std::make_shared<const std::string>(std::move(bytes))] {
              const auto open = impl_->site.open;
              for (const auto& [number, client] : open) client->send_frame(kind, shared);
            });
}

void Server::drain(double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  for (bool idle = false; !idle && Clock::now() < end;) {
    std::promise<bool> answer;
    net::post(impl_->context, [&] {
      const auto& open = impl_->site.open;
      answer.set_value(std::all_of(open.begin(), open.end(),
                                   [](const auto& one) { return one.second->is_idle(); }));
    });
    idle = answer.get_future().get();
    if (!idle) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

}  // namespace counterpoint::live
