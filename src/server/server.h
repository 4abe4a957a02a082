#pragma once
/// Computational steering over HTTP and WebSocket on the loopback address (docs/protocol.md, docs/steer.md).

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/hub.h"

namespace topple::server {

struct ServerOptions {
  std::uint16_t port = 0;  // 0: a free one
  std::string token;       // empty: a random one
  std::size_t most_connections = 64;
  double request_timeout = 10;                      // for a whole header [s]
  double standstill = 30;                           // of a reply that nobody takes [s]
  double silence = 45;                              // a WebSocket without a sign of life is closed [s]
  double ping = 15;                                 // [s]
  std::size_t most_unsent = std::size_t{64} << 20;  // of one connection [bytes]
};

class Server {
 public:
  /// Listens; throws std::runtime_error if it cannot. The hub outlives it.
  Server(Hub&, const ServerOptions&);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  /// "http://127.0.0.1:PORT/TOKEN/"
  const std::string& url() const { return url_; }
  const std::string& token() const { return token_; }
  std::size_t connections() const;

 private:
  struct Impl;
  std::string token_, url_;
  std::unique_ptr<Impl> impl_;
};

/// 32 hexadecimal digits from the system's random numbers.
std::string make_token();

}  // namespace topple::server
