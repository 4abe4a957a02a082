#include "server/client.h"

namespace topple::server {

namespace {

constexpr std::size_t kMostAnswers = 256;

}  // namespace

void Client::attach(std::shared_ptr<Outlet> outlet) {
  const std::lock_guard lock(mutex_);
  outlet_ = std::move(outlet);
}

void Client::detach(const Outlet* outlet) {
  const std::lock_guard lock(mutex_);
  if (outlet_.get() != outlet) return;
  outlet_.reset();
  left_ = Clock::now();
}

std::shared_ptr<Outlet> Client::outlet() const {
  const std::lock_guard lock(mutex_);
  return outlet_;
}

double Client::calc_absence() const {
  const std::lock_guard lock(mutex_);
  return outlet_ ? 0 : std::chrono::duration<double>(Clock::now() - left_).count();
}

bool Client::begin(std::int64_t id) {
  std::shared_ptr<const std::string> again;
  std::shared_ptr<Outlet> outlet;
  {
    const std::lock_guard lock(mutex_);
    outlet = outlet_;
    for (const auto& [known, text] : answers_)
      if (known == id) again = text;
    if (!again && pending_.insert(id).second) return true;
  }
  if (again && outlet) outlet->send(again);
  if (outlet) outlet->answered();
  return false;
}

void Client::answer(std::int64_t id, std::string text) {
  auto shared = std::make_shared<const std::string>(std::move(text));
  std::shared_ptr<Outlet> outlet;
  {
    const std::lock_guard lock(mutex_);
    pending_.erase(id);
    answers_.emplace_back(id, shared);
    if (answers_.size() > kMostAnswers) answers_.pop_front();
    outlet = outlet_;
  }
  if (!outlet) return;
  outlet->send(std::move(shared));
  outlet->answered();
}

void Client::send(const std::shared_ptr<const std::string>& text) const {
  if (const auto o = outlet()) o->send(text);
}

}  // namespace topple::server
