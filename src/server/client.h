#pragma once
/// Who steers or watches: what is known of a page across its connections.

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/frame.h"

namespace topple::server {

/// A connection as sessions see it; any thread.
class Outlet {
 public:
  virtual ~Outlet() = default;
  /// Sends a text; never dropped. A connection that takes nothing is closed by itself.
  virtual void send(std::shared_ptr<const std::string>) = 0;
  /// Offers a frame; false if it was dropped because frames wait already. Asked for ones are never dropped.
  virtual bool offer(std::shared_ptr<const FrameBody>, unsigned flags) = 0;
  /// A command was answered: another one may be read.
  virtual void answered() = 0;
};

class Client {
 public:
  explicit Client(std::string token) : token_(std::move(token)) {}

  const std::string& token() const { return token_; }
  std::atomic<int> session = 0;             // watched
  std::atomic<int> zone = -1;               // watched
  std::atomic<std::size_t> zone_frame = 0;  // next one to be told
  std::atomic<int> zone_branch = 0;

  void attach(std::shared_ptr<Outlet>);
  /// Forgets a connection if it is still this one.
  void detach(const Outlet*);
  std::shared_ptr<Outlet> outlet() const;
  double calc_absence() const;  // without a connection [s]

  /// Notes a command. False if it was there before; then its answer, if there is one, has been sent again.
  bool begin(std::int64_t id);
  void answer(std::int64_t id, std::string text);
  void send(const std::shared_ptr<const std::string>&) const;

 private:
  using Clock = std::chrono::steady_clock;
  std::string token_;
  mutable std::mutex mutex_;
  std::shared_ptr<Outlet> outlet_;
  Clock::time_point left_ = Clock::now();
  std::set<std::int64_t> pending_;
  std::deque<std::pair<std::int64_t, std::shared_ptr<const std::string>>> answers_;
};

}  // namespace topple::server
