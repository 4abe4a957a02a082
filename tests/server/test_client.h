#pragma once
/// A client over plain sockets, so that it can also misbehave. Being cut off is an answer, not an end of the test.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace topple::server {

using TestJson = nlohmann::ordered_json;

struct HttpAnswer {
  int status = 0;  // 0: the connection was cut off
  std::string head, body;
  TestJson json() const { return TestJson::parse(body, nullptr, false); }
};

class TestClient {
 public:
  explicit TestClient(std::uint16_t port) : port_(port) {
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_port = htons(port);
    a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(socket_, reinterpret_cast<sockaddr*>(&a), sizeof a) != 0) close();
  }
  ~TestClient() { close(); }
  TestClient(const TestClient&) = delete;
  TestClient& operator=(const TestClient&) = delete;
  void close() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }

  /// From here on waits before it reads, and the system takes little for it meanwhile.
  void read_slowly(std::chrono::milliseconds pause) {
    const int size = 65536;
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &size, sizeof size);
    pause_ = pause;
  }

  /// False if the other side takes nothing any more.
  bool send_raw(const std::string& bytes) {
    std::size_t done = 0;
    while (socket_ >= 0 && done < bytes.size()) {
      const ssize_t n = ::send(socket_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
      if (n <= 0) return false;
      done += static_cast<std::size_t>(n);
    }
    return socket_ >= 0;
  }

  std::uint16_t port() const { return port_; }
  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }

  HttpAnswer get(const std::string& path, const std::string& extra = {}, std::string host_text = {},
                 const std::string& method = "GET") {
    if (host_text.empty()) host_text = host();
    send_raw(method + " " + path + " HTTP/1.1\r\nHost: " + host_text + "\r\n" + extra + "\r\n");
    return read_answer(method == "HEAD");
  }

  HttpAnswer read_answer(bool head_only = false) {
    HttpAnswer a;
    std::size_t end = std::string::npos;
    while ((end = input_.find("\r\n\r\n")) == std::string::npos)
      if (!fill()) return a;
    a.head = input_.substr(0, end);
    input_.erase(0, end + 4);
    a.status = std::stoi(a.head.substr(9, 3));
    std::size_t length = 0;
    if (const std::size_t at = a.head.find("Content-Length: "); at != std::string::npos)
      length = std::stoul(a.head.substr(at + 16));
    if (head_only || a.status == 101) return a;
    while (input_.size() < length)
      if (!fill()) return {};
    a.body = input_.substr(0, length);
    input_.erase(0, length);
    return a;
  }

  /// True if the server takes the WebSocket.
  bool upgrade(const std::string& token, const std::string& query = {}, const std::string& origin = {}) {
    return get("/" + token + "/ws" + query,
               "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: "
               "dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n" +
                   (origin.empty() ? "" : "Origin: " + origin + "\r\n"))
               .status == 101;
  }

  bool send_frame(int opcode, const std::string& payload, bool masked = true, bool last = true) {
    std::string f;
    f += static_cast<char>((last ? 0x80 : 0) | opcode);
    const int mask = masked ? 0x80 : 0;
    if (payload.size() < 126) {
      f += static_cast<char>(mask | static_cast<int>(payload.size()));
    } else if (payload.size() < 65536) {
      f += static_cast<char>(mask | 126);
      for (int shift = 8; shift >= 0; shift -= 8) f += static_cast<char>(payload.size() >> shift);
    } else {
      f += static_cast<char>(mask | 127);
      for (int shift = 56; shift >= 0; shift -= 8) f += static_cast<char>(payload.size() >> shift);
    }
    const char key[4] = {1, 2, 3, 4};
    if (masked) f.append(key, 4);
    for (std::size_t i = 0; i < payload.size(); ++i)
      f += static_cast<char>(masked ? payload[i] ^ key[i % 4] : payload[i]);
    return send_raw(f);
  }
  bool send_text(const std::string& text) { return send_frame(1, text); }

  struct Message {
    bool is_text = false;
    std::string bytes;
  };
  /// The next message; none when the connection is over. Pings are answered.
  std::optional<Message> receive() {
    Message m;
    for (;;) {
      if (!need(2)) return std::nullopt;
      const int first = byte(0), second = byte(1);
      std::size_t length = static_cast<std::size_t>(second & 127), head = 2;
      const std::size_t more = length == 126 ? 2 : length == 127 ? 8 : 0;
      if (more > 0) {
        if (!need(2 + more)) return std::nullopt;
        length = 0;
        for (std::size_t i = 0; i < more; ++i) length = length << 8 | static_cast<std::size_t>(byte(2 + i));
        head += more;
      }
      if (!need(head + length)) return std::nullopt;
      const std::string payload = input_.substr(at_ + head, length);
      at_ += head + length;
      // consumed bytes are let go now and then
      if (at_ > (std::size_t{1} << 20)) input_.erase(0, at_), at_ = 0;
      const int opcode = first & 15;
      if (opcode == 9) {
        send_frame(10, payload);
        if (std::chrono::steady_clock::now() - heard_ > std::chrono::seconds(60)) return std::nullopt;
      }
      if (opcode < 8) heard_ = std::chrono::steady_clock::now();
      if (opcode == 8) return std::nullopt;
      if (opcode > 2) continue;
      if (opcode != 0) m.is_text = opcode == 1;
      m.bytes += payload;
      if ((first & 128) != 0) return m;
    }
  }

  /// Texts until one fits; frames go to `frames`.
  TestJson wait_for(const std::function<bool(const TestJson&)>& fits) {
    for (std::size_t i = 0; i < later_.size(); ++i)
      if (fits(later_[i])) {
        const TestJson found = later_[i];
        later_.erase(later_.begin() + static_cast<std::ptrdiff_t>(i));
        return found;
      }
    const auto begin = std::chrono::steady_clock::now();
    while (auto m = receive()) {
      // pings keep a connection alive for which nothing comes
      if (std::chrono::steady_clock::now() - begin > std::chrono::seconds(60)) break;
      if (!m->is_text) {
        frames.push_back(std::move(m->bytes));
        continue;
      }
      TestJson j = TestJson::parse(m->bytes);
      if (j.contains("seq")) last_seq = j["seq"];
      if (fits(j)) return j;
      later_.push_back(std::move(j));
    }
    return nullptr;
  }
  TestJson wait_for_type(const std::string& type) {
    return wait_for([&](const TestJson& j) { return j["type"] == type; });
  }
  TestJson wait_for_phase(const std::string& phase) {
    return wait_for([&](const TestJson& j) { return j["type"] == "state" && j["phase"] == phase; });
  }
  /// Sends a command and waits for its answer; null if the connection is over.
  TestJson command(const std::string& word, TestJson keys = TestJson::object()) {
    const int id = ++last_id_;
    TestJson whole{{"id", id}, {"command", word}};
    for (auto& [key, value] : keys.items()) whole[key] = value;
    if (!send_text(whole.dump())) return nullptr;
    return wait_for([&](const TestJson& j) { return (j["type"] == "ack" || j["type"] == "error") && j["id"] == id; });
  }
  /// The result of a command that must succeed.
  TestJson result(const std::string& word, TestJson keys = TestJson::object()) {
    const TestJson answer = command(word, std::move(keys));
    return answer.is_object() && answer["type"] == "ack" ? answer["result"] : TestJson{{"refused", answer}};
  }
  std::string code(const std::string& word, TestJson keys = TestJson::object()) {
    const TestJson answer = command(word, std::move(keys));
    return answer.is_object() && answer["type"] == "error" ? answer["error"]["code"].get<std::string>() : "accepted";
  }
  /// Nothing comes any more.
  bool is_cut_off() {
    while (receive()) {}
    return true;
  }
  void forget() { later_.clear(); }
  const std::deque<TestJson>& later() const { return later_; }
  void set_id(int id) { last_id_ = id; }

  std::vector<std::string> frames;
  long last_seq = 0;

 private:
  int byte(std::size_t i) const { return static_cast<unsigned char>(input_[at_ + i]); }
  bool need(std::size_t n) {
    while (input_.size() - at_ < n)
      if (!fill()) return false;
    return true;
  }
  bool fill() {
    if (socket_ < 0) return false;
    pollfd p{socket_, POLLIN, 0};
    if (poll(&p, 1, 60000) <= 0) return false;
    if (pause_.count() > 0) std::this_thread::sleep_for(pause_);
    char buffer[65536];
    const ssize_t n = recv(socket_, buffer, sizeof buffer, 0);
    if (n <= 0) return false;
    input_.append(buffer, static_cast<std::size_t>(n));
    return true;
  }

  std::uint16_t port_;
  int socket_ = -1, last_id_ = 0;
  std::chrono::milliseconds pause_{0};  // before each reading
  std::string input_;
  std::size_t at_ = 0;
  std::chrono::steady_clock::time_point heard_ = std::chrono::steady_clock::now();  // but for pings
  std::deque<TestJson> later_;
};

}  // namespace topple::server
