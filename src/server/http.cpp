/// The sockets: the only file that knows Boost.Beast. permessage-deflate is never offered.

#include <sys/random.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <charconv>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <variant>

#include "server/server.h"

namespace topple::server {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Tcp = asio::ip::tcp;

namespace {

constexpr std::size_t kMostHeader = 8192, kMostMessage = std::size_t{2} << 20;
constexpr int kMostWaiting = 256;  // commands of a connection that are not answered
constexpr int kMostFrames = 4;     // live frames that wait to be sent

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<long>(1000 * seconds));
}

/// The host of "host:port", "[::1]:port" or "host".
std::string host_of(const std::string& text) {
  if (!text.empty() && text.front() == '[') {
    const std::size_t end = text.find(']');
    return end == std::string::npos ? "" : text.substr(0, end + 1);
  }
  return text.substr(0, text.find(':'));
}

bool is_port(const std::string& text) {
  return !text.empty() && text.size() <= 5 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// A name of this machine, with or without a port.
bool is_own_host(const std::string& text) {
  const std::string host = host_of(text);
  if (host != "127.0.0.1" && host != "localhost" && host != "[::1]") return false;
  return text.size() == host.size() || (text[host.size()] == ':' && is_port(text.substr(host.size() + 1)));
}

/// As long for equal texts as for others.
bool is_same(const std::string& a, const std::string& b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < b.size(); ++i)
    difference |= static_cast<unsigned char>(a.empty() ? 0 : a[i % a.size()]) ^ static_cast<unsigned char>(b[i]);
  return difference == 0;
}

struct Context {
  Hub& hub;
  ServerOptions options;
  std::string token;
  std::atomic<std::size_t> connections{0};
};

using Request = http::request<http::empty_body>;
using Response = http::response<http::string_body>;

Response make_response(const Request& q, Reply r) {
  Response out(static_cast<http::status>(r.status), q.version());
  out.set(http::field::content_type, r.type);
  out.set(http::field::cache_control, "no-store");
  out.set("X-Content-Type-Options", "nosniff");
  out.set("Referrer-Policy", "no-referrer");
  out.set("Cross-Origin-Resource-Policy", "same-origin");
  out.set("X-Frame-Options", "DENY");
  if (!r.file_name.empty() && r.type.rfind("text/html", 0) != 0)
    out.set(http::field::content_disposition, "attachment; filename=\"" + r.file_name + "\"");
  if (r.status == 405) out.set(http::field::allow, "GET, HEAD");
  out.keep_alive(q.keep_alive() && r.status < 400);
  const std::size_t size = r.body.size();
  if (q.method() != http::verb::head) out.body() = std::move(r.body);
  out.prepare_payload();
  if (q.method() == http::verb::head) out.content_length(size);
  return out;
}

/// Why a request is refused before anybody looks at its path; nothing if it is not.
std::optional<Reply> refuse(const Context& c, const Request& q, std::string& path, std::string& query) {
  const auto text = [&](http::field f) { return std::string(q[f]); };
  const std::string host = text(http::field::host);
  if (q.count(http::field::host) != 1 || !is_own_host(host))
    return make_error_reply(403, "E902", "this server answers on the loopback address only",
                            "open it as http://127.0.0.1:PORT/...; from elsewhere through an SSH tunnel");
  if (q.count(http::field::origin) > 0 && text(http::field::origin) != "http://" + host)
    return make_error_reply(403, "E902", "pages of other servers may not steer",
                            "open the address that topple steer printed");
  if (q.method() != http::verb::get && q.method() != http::verb::head)
    return make_error_reply(405, "E904", "only GET and HEAD are understood");
  if (q.has_content_length() || q.chunked()) {
    if (text(http::field::content_length) != "0") return make_error_reply(413, "E904", "a request has no body here");
  }
  const std::string target(q.target());
  const std::size_t mark = target.find('?');
  path = target.substr(0, mark);
  query = mark == std::string::npos ? "" : target.substr(mark + 1);
  const std::string wanted = "/" + c.token;
  const std::string first = path.substr(0, path.find('/', 1));
  if (!is_same(first, wanted))
    return make_error_reply(403, "E901", "the address lacks the right token",
                            "open the address that topple steer printed");
  path = path.substr(wanted.size());
  if (path.find('%') != std::string::npos || path.find("..") != std::string::npos ||
      path.find('\\') != std::string::npos)
    return make_error_reply(404, "E903", "there is nothing of that name");
  return std::nullopt;
}

std::string value_of(const std::string& query, const std::string& key) {
  for (std::size_t at = 0; at < query.size();) {
    const std::size_t end = std::min(query.find('&', at), query.size());
    const std::string part = query.substr(at, end - at);
    if (part.rfind(key + "=", 0) == 0) return part.substr(key.size() + 1);
    at = end + 1;
  }
  return {};
}

/// One WebSocket. All but the calls of Outlet run on its strand.
class Socket : public Outlet, public std::enable_shared_from_this<Socket> {
 public:
  Socket(beast::tcp_stream&& stream, std::shared_ptr<Context> context)
      : stream_(std::move(stream)), context_(std::move(context)) {}
  ~Socket() override { --context_->connections; }

  void start(const Request& q, const std::string& query) {
    resume_ = value_of(query, "resume");
    const std::string seq = value_of(query, "seq");
    long n = 0;
    const auto [end, fault] = std::from_chars(seq.data(), seq.data() + seq.size(), n);
    if (fault == std::errc() && end == seq.data() + seq.size() && !seq.empty() && n >= 0) after_ = n;
    websocket::permessage_deflate none;
    none.server_enable = none.client_enable = false;
    stream_.set_option(none);
    websocket::stream_base::timeout t;
    t.handshake_timeout = milliseconds(context_->options.request_timeout);
    // Beast pings when half of it is over
    t.idle_timeout = milliseconds(context_->options.silence);
    t.keep_alive_pings = true;
    beast::get_lowest_layer(stream_).expires_never();
    stream_.set_option(t);
    stream_.read_message_max(kMostMessage);
    stream_.auto_fragment(false);
    stream_.async_accept(q, [self = shared_from_this()](beast::error_code e) {
      if (e) return;
      self->client_ = self->context_->hub.connect(self, self->resume_, self->after_);
      self->read();
    });
  }

  void send(std::shared_ptr<const std::string> text) override {
    unsent_ += text->size();
    asio::post(stream_.get_executor(), [self = shared_from_this(), text = std::move(text)] {
      self->queue({text, nullptr, 0, 0});
    });
  }

  bool offer(std::shared_ptr<const FrameBody> body, unsigned flags) override {
    const std::uint32_t sequence = ++sequence_;
    const bool is_asked = (flags & kAskedFrame) != 0;
    if (!is_asked && frames_waiting_.load() >= kMostFrames) return false;
    if (!is_asked) ++frames_waiting_;
    unsent_ += kFrameHeader + body->bytes.size();
    asio::post(stream_.get_executor(), [self = shared_from_this(), body = std::move(body), flags, sequence] {
      self->queue({nullptr, body, flags, sequence});
    });
    return true;
  }

  void answered() override {
    asio::post(stream_.get_executor(), [self = shared_from_this()] {
      --self->waiting_;
      if (!self->is_reading_) self->read();
    });
  }

  void close() {
    asio::post(stream_.get_executor(), [self = shared_from_this()] { self->end(); });
  }

 private:
  struct Item {
    std::shared_ptr<const std::string> text;
    std::shared_ptr<const FrameBody> body;
    unsigned flags;
    std::uint32_t sequence;
  };

  void read() {
    if (is_over_ || is_reading_ || waiting_ >= kMostWaiting) return;
    is_reading_ = true;
    stream_.async_read(buffer_, [self = shared_from_this()](beast::error_code e, std::size_t) {
      self->is_reading_ = false;
      if (e) return self->end();
      const std::string text = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.consume(self->buffer_.size());
      ++self->waiting_;
      self->context_->hub.receive(self->client_, self->stream_.got_text() ? text : std::string("binary"));
      self->read();
    });
  }

  void queue(Item item) {
    if (is_over_) return;
    if (unsent_ > context_->options.most_unsent) return end();
    items_.push_back(std::move(item));
    if (items_.size() == 1) write();
  }

  void write() {
    const Item& item = items_.front();
    const auto done = [self = shared_from_this()](beast::error_code e, std::size_t) {
      if (e) return self->end();
      const Item& sent = self->items_.front();
      self->unsent_ -= sent.text ? sent.text->size() : kFrameHeader + sent.body->bytes.size();
      if (sent.body && (sent.flags & kAskedFrame) == 0) --self->frames_waiting_;
      self->items_.pop_front();
      if (!self->items_.empty() && !self->is_over_) self->write();
    };
    if (item.text) {
      stream_.text(true);
      stream_.async_write(asio::buffer(*item.text), done);
      return;
    }
    header_ = make_frame_header(*item.body, item.flags, item.sequence);
    stream_.binary(true);
    stream_.async_write(std::array<asio::const_buffer, 2>{asio::buffer(header_), asio::buffer(item.body->bytes)}, done);
  }

  /// Drops the connection; what was not sent is lost, the client may come back.
  void end() {
    if (is_over_) return;
    is_over_ = true;
    if (client_) context_->hub.disconnect(client_, this);
    beast::get_lowest_layer(stream_).cancel();
    beast::error_code ignored;
    beast::get_lowest_layer(stream_).socket().shutdown(Tcp::socket::shutdown_both, ignored);
    beast::get_lowest_layer(stream_).socket().close(ignored);
  }

  websocket::stream<beast::tcp_stream> stream_;
  std::shared_ptr<Context> context_;
  std::shared_ptr<Client> client_;
  beast::flat_buffer buffer_;
  std::string resume_;
  std::optional<long> after_;
  std::deque<Item> items_;
  std::array<std::uint8_t, kFrameHeader> header_{};
  std::atomic<std::uint32_t> sequence_{0};
  std::atomic<int> frames_waiting_{0};
  std::atomic<std::size_t> unsent_{0};
  int waiting_ = 0;
  bool is_reading_ = false, is_over_ = false;
};

/// Requests of one connection, one after the other, until it becomes a WebSocket.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Tcp::socket&& socket, std::shared_ptr<Context> context,
             std::function<void(std::weak_ptr<Socket>)> on_socket)
      : stream_(std::move(socket)), context_(std::move(context)), on_socket_(std::move(on_socket)) {
    is_too_many_ = ++context_->connections > context_->options.most_connections;
  }
  ~Connection() {
    if (!has_moved_) --context_->connections;
  }

  void read() {
    parser_.emplace();
    parser_->header_limit(kMostHeader);
    parser_->body_limit(0);
    stream_.expires_after(milliseconds(context_->options.request_timeout));
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = shared_from_this()](beast::error_code e, std::size_t) { self->take(e); });
  }

 private:
  void take(beast::error_code e) {
    if (e == http::error::end_of_stream || e == beast::error::timeout || e == asio::error::operation_aborted ||
        e == asio::error::connection_reset)
      return finish();
    if (e) {
      request_ = {};
      request_.version(11);
      request_.keep_alive(false);
      const bool is_large = e == http::error::header_limit || e == http::error::body_limit;
      return reply(make_error_reply(e == http::error::body_limit ? 413
                                    : is_large                   ? 431
                                                                 : 400,
                                    "E904",
                                    e == http::error::body_limit ? "a request has no body here"
                                    : is_large                   ? "the header is larger than 8 kB"
                                                                 : "the request cannot be understood"));
    }
    request_ = Request(parser_->get().base());
    std::string path, query;
    std::optional<Reply> refused;
    if (is_too_many_) {
      refused = make_error_reply(503, "E905", "too many connections are open", "close a page");
    } else {
      // a body that is announced is not read, so nothing may follow on this connection
      refused = refuse(*context_, request_, path, query);
    }
    if (refused) return reply(std::move(*refused));
    if (path == "/ws") {
      if (!websocket::is_upgrade(request_)) return reply(make_error_reply(426, "E904", "this path speaks WebSocket"));
      has_moved_ = true;
      stream_.expires_never();
      const auto socket = std::make_shared<Socket>(std::move(stream_), context_);
      on_socket_(socket);
      return socket->start(request_, query);
    }
    if (path.empty()) {
      // relative addresses of the page need the last slash
      Response out(http::status::permanent_redirect, request_.version());
      out.set(http::field::location, "/" + context_->token + "/");
      out.keep_alive(false);
      out.prepare_payload();
      return write(std::move(out));
    }
    stream_.expires_never();
    context_->hub.get(path, [self = shared_from_this()](Reply r) {
      asio::post(self->stream_.get_executor(), [self, r = std::move(r)]() mutable { self->reply(std::move(r)); });
    });
  }

  void reply(Reply r) { write(make_response(request_, std::move(r))); }

  void write(Response out) {
    response_.emplace(std::move(out));
    serializer_.emplace(*response_);
    write_some();
  }

  /// As much as the connection takes; a reply may last as long as it gets on.
  void write_some() {
    stream_.expires_after(milliseconds(context_->options.standstill));
    http::async_write_some(stream_, *serializer_, [self = shared_from_this()](beast::error_code e, std::size_t) {
      if (!e && !self->serializer_->is_done()) return self->write_some();
      if (e || !self->response_->keep_alive()) return self->finish();
      self->read();
    });
  }

  void finish() {
    beast::error_code ignored;
    stream_.socket().shutdown(Tcp::socket::shutdown_send, ignored);
  }

  beast::tcp_stream stream_;
  std::shared_ptr<Context> context_;
  std::function<void(std::weak_ptr<Socket>)> on_socket_;
  beast::flat_buffer buffer_{kMostHeader + 1024};
  std::optional<http::request_parser<http::empty_body>> parser_;
  Request request_;
  std::optional<Response> response_;
  std::optional<http::response_serializer<http::string_body>> serializer_;  // of the response
  bool is_too_many_ = false, has_moved_ = false;
};

}  // namespace

std::string make_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error("the system gives no random numbers");
  static constexpr char digit[] = "0123456789abcdef";
  std::string token;
  for (const unsigned char b : bytes) token += digit[b >> 4], token += digit[b & 15];
  return token;
}

struct Server::Impl {
  std::shared_ptr<Context> context;
  asio::io_context io{1};
  Tcp::acceptor acceptor{io};
  std::mutex mutex;
  std::vector<std::weak_ptr<Socket>> sockets;
  std::thread thread;

  void accept() {
    acceptor.async_accept(asio::make_strand(io), [this](beast::error_code e, Tcp::socket socket) {
      if (!acceptor.is_open()) return;
      if (!e) {
        beast::error_code ignored;
        socket.set_option(Tcp::no_delay(true), ignored);
        std::make_shared<Connection>(std::move(socket), context, [this](std::weak_ptr<Socket> s) {
          const std::lock_guard lock(mutex);
          std::erase_if(sockets, [](const auto& weak) { return weak.expired(); });
          sockets.push_back(std::move(s));
        })->read();
      }
      accept();
    });
  }
};

Server::Server(Hub& hub, const ServerOptions& options)
    : token_(options.token.empty() ? make_token() : options.token), impl_(std::make_unique<Impl>()) {
  impl_->context.reset(new Context{hub, options, token_});
  try {
    const Tcp::endpoint place(asio::ip::make_address("127.0.0.1"), options.port);
    impl_->acceptor.open(place.protocol());
    impl_->acceptor.set_option(asio::socket_base::reuse_address(true));
    impl_->acceptor.bind(place);
    impl_->acceptor.listen();
  } catch (const boost::system::system_error& e) {
    throw std::runtime_error("port " + std::to_string(options.port) +
                             " of 127.0.0.1 cannot be opened: " + e.code().message());
  }
  url_ = "http://127.0.0.1:" + std::to_string(port()) + "/" + token_ + "/";
  impl_->accept();
  impl_->thread = std::thread([this] { impl_->io.run(); });
}

Server::~Server() {
  impl_->context->hub.say_bye("the server ends");
  impl_->context->hub.close();
  asio::post(impl_->io, [this] {
    beast::error_code ignored;
    impl_->acceptor.close(ignored);
    const std::lock_guard lock(impl_->mutex);
    for (const auto& weak : impl_->sockets)
      if (const auto s = weak.lock()) s->close();
  });
  // replies under way are given up
  for (int i = 0; i < 100 && impl_->context->connections > 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  impl_->io.stop();
  impl_->thread.join();
}

std::uint16_t Server::port() const { return impl_->acceptor.local_endpoint().port(); }

std::size_t Server::connections() const { return impl_->context->connections; }

}  // namespace topple::server
