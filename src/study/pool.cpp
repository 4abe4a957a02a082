#include "study/pool.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <random>

#include "study/evaluator.h"

namespace topple::study {
namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

std::string find_host() {
  char name[256] = {};
  gethostname(name, sizeof name - 1);
  return name;
}

/// Unlike any other, also when the number of the process comes again.
std::string make_name() {
  std::random_device random;
  return fmt::format("{}:{}:{:08x}", find_host(), getpid(), random());
}

}  // namespace

Pool::Pool(std::string address, const RunnerFactories& factories, const PoolOptions& options)
    : address_(std::move(address)), name_(make_name()), factories_(factories), options_(options), last_work_(now()) {
  if (options_.models.empty()) options_.models.emplace_back();
  for (int i = 0; i < options.jobs; ++i) names_.push_back(fmt::format("{}:{}", name_, i));
  for (const std::string& n : names_) threads_.emplace_back([this, n] { work(n); });
  if (!names_.empty()) threads_.emplace_back([this] { keep_alive(); });
}

Pool::~Pool() {
  stop();
  join();
}

void Pool::join() {
  for (std::thread& t : threads_)
    if (t.joinable()) t.join();
}

void Pool::stop() {
  stop_ = true;
  wake();
}

void Pool::wake() {
  {
    const std::lock_guard lock(mutex_);
    ++wake_count_;
  }
  wakes_.notify_all();
}

void Pool::wait_for_news(double seconds) {
  std::unique_lock lock(mutex_);
  news_.wait_for(lock, std::chrono::duration<double>(seconds),
                 [this] { return news_count_ != seen_ || failure_ || stop_; });
  seen_ = news_count_;
}

std::string Pool::get_refusal() const {
  const std::lock_guard lock(mutex_);
  return refusal_;
}

void Pool::check() {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
}

double Pool::calc_idle_time() const { return running_ > 0 ? 0 : now() - last_work_; }

void Pool::sleep(double seconds) {
  std::unique_lock lock(mutex_);
  const long before = wake_count_;
  wakes_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return stop_ || wake_count_ != before; });
}

void Pool::work(const std::string& name) {
  try {
    Store store(address_, &stop_, options_.patience);
    std::map<std::string, Runner> runners;  // by model
    double pause = 0.01, looked = now();
    while (!stop_) {
      long wakes = 0;
      {
        const std::lock_guard lock(mutex_);
        wakes = wake_count_;
      }
      const bool may_suspect = !has_suspect_.exchange(true);
      std::vector<Job> jobs;
      for (const std::string& model : options_.models) {
        jobs = store.claim(name, options_.batch, options_.lease, model, may_suspect);
        if (!jobs.empty()) break;
      }
      const bool is_suspect = may_suspect && !jobs.empty() && jobs.front().vanished >= suspect_vanished;
      if (may_suspect && !is_suspect) has_suspect_ = false;
      if (!jobs.empty()) {
        pause = 0.01;
        run_jobs(store, name, std::move(jobs), runners);
        if (is_suspect) has_suspect_ = false;
        continue;
      }
      if (now() - looked > 1) {
        store.quarantine(name_);
        looked = now();
      }
      {
        const std::lock_guard lock(mutex_);
        if (wakes != wake_count_) continue;  // jobs were added meanwhile
      }
      sleep(pause);
      pause = std::min(2 * pause, 0.5);
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!failure_ && !stop_) failure_ = std::current_exception();
  }
  news_.notify_all();
}

Answer Pool::compare(Store& store, const std::string& model, const Answer& a) {
  if (a.kind == Answer::Kind::Refused) {
    const Refusal r = read_refusal(a.text);
    if (r.diagnostic.code != no_answer_code || !store.find_form(model)) return a;
    Answer crashed = a;
    crashed.kind = Answer::Kind::Crashed, crashed.text = r.line;
    return crashed;
  }
  if (a.kind != Answer::Kind::Done) return a;
  const std::lock_guard lock(forms_mutex_);
  auto known = forms_.find(model);
  if (known == forms_.end()) known = forms_.emplace(model, store.find_form(model).value_or(form_of(a))).first;
  Answer compared = compare_form(a, known->second);
  if (compared.kind == Answer::Kind::Done && known->second.ordinates == 0)
    known->second.ordinates = compared.trajectory.size();
  return compared;
}

void Pool::run_jobs(Store& store, const std::string& name, std::vector<Job> jobs,
                    std::map<std::string, Runner>& runners) {
  const int count = static_cast<int>(jobs.size());
  running_ += count;
  std::vector<bool> is_given(jobs.size(), false);
  const auto finish = [&](std::size_t i, const Answer& a) {
    is_given[i] = true;
    const Answer compared = compare(store, jobs[i].model, a);
    const bool is_kept = store.finish(jobs[i], name, compared);
    {
      const std::lock_guard lock(mutex_);
      ++news_count_;
      if (!is_kept) {
        ++too_late_;
      } else if (Store::is_result(jobs[i], compared)) {
        ++finished_;
      } else if (compared.kind == Answer::Kind::Refused) {
        ++refused_, refusal_ = compared.text;
      }
    }
    news_.notify_all();
  };
  const auto runner_of = [&](const std::string& model) -> Runner& {
    const auto known = runners.find(model);
    if (known != runners.end()) return known->second;
    const std::string definition = store.find_model(model).value_or("{}");
    const std::string kind = nlohmann::json::parse(definition).value("kind", "");
    const auto factory = factories_.find(kind);
    if (factory == factories_.end())
      throw std::runtime_error(fmt::format("this topple knows no model of the kind \"{}\"", kind));
    return runners[model] = factory->second(definition);
  };
  try {
    // what was lost before runs alone, so that it cannot take others with it
    for (std::size_t first = 0; first < jobs.size() && !stop_;) {
      std::size_t end = first + 1;
      while (end < jobs.size() && jobs[first].attempt == 1 && jobs[end].attempt == 1 &&
             jobs[end].model == jobs[first].model)
        ++end;
      std::vector<Point> points;
      for (std::size_t i = first; i < end; ++i) points.push_back(jobs[i].inputs);
      runner_of(jobs[first].model)(
          points, [&](std::size_t i, const Answer& a) { finish(first + i, a); }, stop_);
      first = end;
    }
    for (std::size_t i = 0; i < jobs.size(); ++i)
      if (!is_given[i]) store.finish(jobs[i], name, {});
  } catch (...) {
    const std::exception_ptr failure = std::current_exception();
    running_ -= count;
    last_work_ = now();
    try {
      for (std::size_t i = 0; i < jobs.size(); ++i)
        if (!is_given[i]) store.finish(jobs[i], name, {});
    } catch (const std::exception&) {
      has_kept_ = true;  // the first failure is the one to tell
    }
    std::rethrow_exception(failure);
  }
  running_ -= count;
  last_work_ = now();
}

void Pool::keep_alive() {
  const double interval = std::min(options_.lease / 3, 1e5);  // what a clock can wait for
  std::unique_ptr<Store> store;
  while (!stop_) {
    {
      // claims of others must not shorten the pause
      std::unique_lock lock(mutex_);
      wakes_.wait_for(lock, std::chrono::duration<double>(interval), [this] { return stop_.load(); });
    }
    if (stop_ || running_ == 0) continue;
    try {
      if (!store) store = std::make_unique<Store>(address_, &stop_, interval);
      store->renew(names_, options_.lease);
    } catch (const std::exception&) {
      store.reset();  // next time; who holds a job finds out when it finishes
    }
  }
}

void release_dead_workers(Store& store) {
  const std::string host = find_host() + ":";
  std::vector<std::string> dead;
  for (const std::string& name : store.list_workers()) {
    if (!name.starts_with(host)) continue;
    const int pid = std::atoi(name.c_str() + host.size());
    if (pid > 0 && kill(pid, 0) != 0 && errno == ESRCH) dead.push_back(name);
  }
  if (!dead.empty()) store.renew(dead, 0);
}

}  // namespace topple::study
